// Slosh: a part of a body's mass hangs in it by springs and dampers (liquid in a tank, a loose payload):
//   m_s x'' = m_s g - m_s w^2 (x - x_body) - 2 zeta m_s w (x' - x'_body),   the body feels the opposite; the body itself is lighter by m_s
// Source: F. T. Dodge, "The New Dynamic Behavior of Liquids in Moving Containers" (2000), ch. 3, equivalent mechanical model (spring-mass).
#include "effects/effect.hpp"

namespace rille::effects {
namespace {

using Eigen::Vector3d;

class PayloadSlosh final : public BodyEffect {
 public:
  PayloadSlosh(double mass, double natural_frequency, double damping_ratio)
      : mass_(mass), stiffness_(mass * natural_frequency * natural_frequency), damping_(2 * damping_ratio * mass * natural_frequency) {}

  void start(const BodyMotion& body) override {  // hangs at rest in the body
    offset_ = mass_ / stiffness_ * body.gravity;
    velocity_ = body.velocity;
  }

  void carry(const Vector3d& velocity) override { velocity_ += velocity; }

  // Spring and damper are taken implicitly together with the mass behind them, which is eliminated (2 x 2 system by hand).
  void push(const BodyMotion& body, double h, std::vector<BodyForce>& forces) const override {
    const double slope = h * stiffness_ + damping_;
    const Vector3d given = stiffness_ * offset_ + slope * free_velocity(body, h);
    for (int axis = 0; axis < 3; ++axis) {
      BodyForce force{.direction = Vector3d::Unit(axis)};
      force.weight = h * slope * mass_ / (mass_ + h * slope);
      force.target = h * given[axis] / force.weight;
      forces.push_back(force);
    }
  }

  void advance(const BodyMotion& body, double h) override {
    const double slope = h * stiffness_ + damping_;
    velocity_ = (mass_ * velocity_ + h * (mass_ * body.gravity - stiffness_ * offset_ + slope * body.velocity)) / (mass_ + h * slope);
    offset_ += h * (velocity_ - body.velocity);
  }
  void visit(Archive& archive) override { archive(offset_, velocity_); }

 private:
  // Velocity of the mass at the end of the step if the body stood still.
  Vector3d free_velocity(const BodyMotion& body, double h) const {
    return (mass_ * velocity_ + h * (mass_ * body.gravity - stiffness_ * offset_)) / (mass_ + h * (h * stiffness_ + damping_));
  }

  double mass_;       // [kg]
  double stiffness_;  // [N/m]
  double damping_;    // [N s/m]
  Vector3d offset_ = Vector3d::Zero();    // [m] from the body's centre of mass
  Vector3d velocity_ = Vector3d::Zero();  // [m/s]
};

}  // namespace

void attach_payload_slosh(const Attachment& a) {
  a.each(a.model.rover.bodies.size(), [&](std::size_t k) {
    Body& body = a.model.rover.bodies[k];
    if (!(a["mass"] < body.mass))
      throw InputRefused("payload_slosh lets more mass slosh than body '" + body.name + "' has; choose a smaller value of mass");
    body.inertia *= (body.mass - a["mass"]) / body.mass;
    body.mass -= a["mass"];
  });
  a.to_bodies<PayloadSlosh>(a["mass"], a["natural_frequency"], a["damping_ratio"]);
}

}  // namespace rille::effects
