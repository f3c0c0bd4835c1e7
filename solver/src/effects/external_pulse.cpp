// External pulse: an unknown push, a force and a torque of constant size over a short time, at the centre of mass, in W.
// The impulse is exact also where the pulse begins or ends inside a step.
#include <algorithm>

#include "effects/effect.hpp"

namespace rille::effects {
namespace {

using Eigen::Vector3d;

class ExternalPulse final : public BodyEffect {
 public:
  ExternalPulse(const Vector3d& force, const Vector3d& torque, double start, double duration)
      : force_(force), torque_(torque), start_(start), end_(start + duration) {}
  void push(const BodyMotion& body, double h, std::vector<BodyForce>& forces) const override {
    const double overlap = std::min(body.time + h, end_) - std::max(body.time, start_);
    if (overlap <= 0) return;
    const double share = overlap / h;
    if (force_.squaredNorm() > 0) forces.push_back(given_force(share * force_, h));
    if (torque_.squaredNorm() > 0) forces.push_back(given_force(share * torque_, h, true));
  }

 private:
  Vector3d force_, torque_;  // [N], [N m] in W
  double start_, end_;       // [s]
};

}  // namespace

void attach_external_pulse(const Attachment& a) {
  a.to_bodies<ExternalPulse>(Vector3d(a["force_x"], a["force_y"], a["force_z"]), Vector3d(a["torque_x"], a["torque_y"], a["torque_z"]),
                             a["start"], a["duration"]);
}

}  // namespace rille::effects
