// Tether: a cable from the body's centre of mass to an anchor, slack up to its length, then elastic; it only pulls:
//   T = stiffness max(0, |x - anchor| - length),   implicit along the cable
// Source: Hooke's law, one-sided.
#include <algorithm>

#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class TetherPull final : public BodyEffect {
 public:
  TetherPull(double stiffness, double length, const Eigen::Vector3d& anchor) : stiffness_(stiffness), length_(length), anchor_(anchor) {}
  void push(const BodyMotion& body, double h, std::vector<BodyForce>& forces) const override {
    const Eigen::Vector3d reach = anchor_ - body.com;
    const double distance = reach.norm();
    const double closing = -body.velocity.dot(reach) / std::max(distance, 1e-12);  // speed of pulling out
    if (distance + h * std::abs(closing) <= length_ || distance == 0) return;
    BodyForce force{.direction = reach / distance, .weight = h * h * stiffness_, .lower = 0};
    force.target = (distance - length_) / h;
    forces.push_back(force);
  }

 private:
  double stiffness_;        // [N/m]
  double length_;           // [m]
  Eigen::Vector3d anchor_;  // [m] in W
};

}  // namespace

void attach_tether_pull(const Attachment& a) {
  a.to_bodies<TetherPull>(a["stiffness"], a["length"], Eigen::Vector3d(a["anchor_x"], a["anchor_y"], a["anchor_z"]));
}

}  // namespace rille::effects
