// Stribeck friction: more at rest than in motion,
//   tau = -sign(w) (coulomb_torque + stiction_excess exp(-(w / stribeck_speed)^2))
// Source: B. Armstrong-Helouvry et al., Automatica 30 (1994), eq. 8; H. Olsson et al. (1998), eq. 5.
#include <cmath>

#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class StribeckFriction final : public JointEffect {
 public:
  StribeckFriction(double coulomb_torque, double stiction_excess, double stribeck_speed) : coulomb_torque_(coulomb_torque), stiction_excess_(stiction_excess), stribeck_speed_(stribeck_speed) {}
  void rub(const JointMotion& motion, JointFriction& friction) const override {
    const double ratio = motion.velocity / stribeck_speed_;
    friction.dry += coulomb_torque_ + stiction_excess_ * std::exp(-ratio * ratio);
  }

 private:
  double coulomb_torque_;  // [N m or N]
  double stiction_excess_;  // [N m or N] of static over sliding friction
  double stribeck_speed_;  // [rad/s or m/s]
};

}  // namespace

void attach_stribeck_friction(const Attachment& a) { a.to_joints<StribeckFriction>(a["coulomb_torque"], a["stiction_excess"], a["stribeck_speed"]); }

}  // namespace rille::effects
