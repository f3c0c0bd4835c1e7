// Viscous friction in a joint: tau = -coefficient w. Source: H. Olsson et al., "Friction models and friction compensation",
// European J. Control 4 (1998), eq. 3.
#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class ViscousFriction final : public JointEffect {
 public:
  explicit ViscousFriction(double coefficient) : coefficient_(coefficient) {}
  void rub(const JointMotion&, JointFriction& friction) const override { friction.viscous += coefficient_; }

 private:
  double coefficient_;  // [N m s/rad or N s/m]
};

}  // namespace

void attach_viscous_friction(const Attachment& a) { a.to_joints<ViscousFriction>(a["coefficient"]); }

}  // namespace rille::effects
