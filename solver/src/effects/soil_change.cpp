// Soil change: inside a circle the soil differs from the map's:
//   moduli x (1 + stiffness_change),  cohesion x (1 + cohesion_change),  tan phi x (1 + friction_change)
// Source: rille (a patch that nobody drew).
#include <cmath>

#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class SoilChange final : public WheelEffect {
 public:
  SoilChange(const Eigen::Vector2d& center, double radius, double stiffness, double cohesion, double friction)
      : center_(center), radius_(radius), stiffness_(stiffness), cohesion_(cohesion), friction_(friction) {}
  void before(WheelSite& site) const override {
    if ((site.position - center_).squaredNorm() > radius_ * radius_) return;
    scale_pressure(site.soil, 1 + stiffness_);
    site.soil.cohesion *= 1 + cohesion_;
    site.soil.friction_angle = std::atan((1 + friction_) * std::tan(site.soil.friction_angle));
  }

 private:
  Eigen::Vector2d center_;  // [m] in W
  double radius_;           // [m]
  double stiffness_, cohesion_, friction_;  // [-]
};

}  // namespace

void attach_soil_change(const Attachment& a) {
  a.to_wheels<SoilChange>(Eigen::Vector2d(a["center_x"], a["center_y"]), a["radius"], a["stiffness_change"], a["cohesion_change"],
                          a["friction_change"]);
}

}  // namespace rille::effects
