// Linear drag on a body: F = -coefficient v at its centre of mass, taken implicitly. Source: G. G. Stokes (1851).
#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class LinearDrag final : public BodyEffect {
 public:
  explicit LinearDrag(double coefficient) : coefficient_(coefficient) {}
  void push(const BodyMotion&, double h, std::vector<BodyForce>& forces) const override {
    for (int axis = 0; axis < 3; ++axis) forces.push_back({.direction = Eigen::Vector3d::Unit(axis), .weight = h * coefficient_});
  }

 private:
  double coefficient_;  // [N s/m]
};

}  // namespace

void attach_linear_drag(const Attachment& a) { a.to_bodies<LinearDrag>(a["coefficient"]); }

}  // namespace rille::effects
