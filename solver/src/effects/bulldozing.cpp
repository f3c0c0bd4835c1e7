// Bulldozing: the front of a sunken wheel pushes soil like a wall; passive earth pressure over the sinkage resists:
//   R = efficiency b (gamma z^2 K_p / 2 + 2 c z sqrt(K_p)),   K_p = tan^2(45 deg + phi/2),   drawbar pull falls by R
// Source: W. J. M. Rankine (1857); as a wheel's resistance in J. Y. Wong, "Theory of Ground Vehicles" (2008), ch. 2.5.
#include <cmath>

#include "effects/effect.hpp"

namespace rille::effects {
// [N] passive earth pressure on a wall of the given width and depth
double passive_pressure(double width, double depth, double unit_weight, double cohesion, double friction_angle) {
  const double root = std::tan(M_PI / 4 + friction_angle / 2);  // sqrt(K_p)
  return width * (0.5 * unit_weight * depth * depth * root * root + 2 * cohesion * depth * root);
}

namespace {

class Bulldozing final : public WheelEffect {
 public:
  explicit Bulldozing(double efficiency) : efficiency_(efficiency) {}
  void after(const WheelSite& site, SoilReaction& reaction) const override {
    const Soil& soil = site.soil;
    if (site.sinkage > 0)
      reaction.drawbar_pull -=
          efficiency_ * passive_pressure(site.wheel->width, site.sinkage, soil.unit_weight, soil.cohesion, soil.friction_angle);
  }

 private:
  double efficiency_;  // [-]
};

}  // namespace

void attach_bulldozing(const Attachment& a) { a.to_wheels<Bulldozing>(a["efficiency"]); }

}  // namespace rille::effects
