// Load-dependent friction, as of gears: dry friction in proportion to the effort that is transmitted,
//   tau = -coefficient |tau_drive| sign(w)
// Source: S. Dohring et al., "A load-dependent transmission friction model", ICRA 1993.
#include <cmath>

#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class LoadFriction final : public JointEffect {
 public:
  explicit LoadFriction(double coefficient) : coefficient_(coefficient) {}
  void rub(const JointMotion& motion, JointFriction& friction) const override {
    friction.dry += coefficient_ * std::abs(motion.drive_effort);
  }

 private:
  double coefficient_;  // [-]
};

}  // namespace

void attach_load_friction(const Attachment& a) { a.to_joints<LoadFriction>(a["coefficient"]); }

}  // namespace rille::effects
