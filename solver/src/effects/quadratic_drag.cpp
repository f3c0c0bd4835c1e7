// Quadratic drag on a body: F = -coefficient |v| v at its centre of mass; |v| from the beginning of the step, v implicitly.
// Source: Lord Rayleigh (1876).
#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class QuadraticDrag final : public BodyEffect {
 public:
  explicit QuadraticDrag(double coefficient) : coefficient_(coefficient) {}
  void push(const BodyMotion& body, double h, std::vector<BodyForce>& forces) const override {
    const double secant = coefficient_ * body.velocity.norm();
    for (int axis = 0; axis < 3; ++axis) forces.push_back({.direction = Eigen::Vector3d::Unit(axis), .weight = h * secant});
  }

 private:
  double coefficient_;  // [N s^2/m^2]
};

}  // namespace

void attach_quadratic_drag(const Attachment& a) { a.to_bodies<QuadraticDrag>(a["coefficient"]); }

}  // namespace rille::effects
