// Coulomb friction in a joint: tau = -torque sign(w); at rest it holds anything up to that.
// Source: C. A. de Coulomb (1785); implicit as a bounded row, so that sticking is exact.
#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class CoulombFriction final : public JointEffect {
 public:
  explicit CoulombFriction(double torque) : torque_(torque) {}
  void rub(const JointMotion&, JointFriction& friction) const override { friction.dry += torque_; }

 private:
  double torque_;  // [N m or N]
};

}  // namespace

void attach_coulomb_friction(const Attachment& a) { a.to_joints<CoulombFriction>(a["torque"]); }

}  // namespace rille::effects
