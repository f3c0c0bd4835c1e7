// Torque ripple (cogging, gear teeth): a torque that depends on the joint's angle alone, tau = torque sin(cycles theta + phase).
// It does no work over a turn. Source: J. Holtz & L. Springob, "Identification and compensation of torque ripple", IEEE Trans. Ind. Electronics 43 (1996).
#include <cmath>

#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class TorqueRipple final : public JointEffect {
 public:
  TorqueRipple(double torque, double cycles, double phase) : torque_(torque), cycles_(cycles), phase_(phase) {}
  double effort(const JointMotion& motion) const override { return torque_ * std::sin(cycles_ * motion.position + phase_); }

 private:
  double torque_;  // [N m or N]
  double cycles_;  // [1/rad x rad] per turn
  double phase_;  // [rad]
};

}  // namespace

void attach_torque_ripple(const Attachment& a) { a.to_joints<TorqueRipple>(a["torque"], a["cycles"], a["phase"]); }

}  // namespace rille::effects
