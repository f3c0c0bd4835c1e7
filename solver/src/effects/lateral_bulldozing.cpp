// Lateral bulldozing: the sunken side of a wheel that drifts sideways pushes soil:
//   F_y grows by  efficiency Int R_b(h(theta)) r cos theta dtheta  over the contact,  h = r (cos theta - cos theta_f)
//   R_b = D_1 (c h + D_2 gamma h^2 / 2),  D_1 = cot X + tan(X + phi),  D_2 = cot X + cot^2 X / cot phi,  X = 45 deg - phi/2
// mobilised with the mean lateral shear displacement, 1 - exp(-j_y/k_y), so that it vanishes without drift.
// Source: E. Hegedus (1960); G. Ishigami et al., "Terramechanics-based model for steering maneuver of planetary exploration rovers on loose soil",
// J. Field Robotics 24 (2007), eqs 12-15.
#include <algorithm>
#include <array>
#include <cmath>

#include "effects/effect.hpp"

namespace rille::effects {
namespace {

constexpr std::array<double, 4> kNode = {0.06943184420297371, 0.33000947820757187, 0.66999052179242813, 0.93056815579702629};
constexpr std::array<double, 4> kWeight = {0.17392742256872693, 0.32607257743127307, 0.32607257743127307, 0.17392742256872693};

class LateralBulldozing final : public WheelEffect {
 public:
  explicit LateralBulldozing(double efficiency) : efficiency_(efficiency) {}
  void after(const WheelSite& site, SoilReaction& reaction) const override {
    const Soil& soil = site.soil;
    const double radius = site.wheel->radius;
    const double entry = reaction.entry_angle, exit = reaction.exit_angle;
    if (entry <= exit) return;
    const double wedge = M_PI / 4 - soil.friction_angle / 2;
    const double cot = 1 / std::tan(wedge);
    const double d_1 = cot + std::tan(wedge + soil.friction_angle);
    const double d_2 = cot + cot * cot * std::tan(soil.friction_angle);
    double force = 0;
    for (std::size_t i = 0; i < kNode.size(); ++i) {  // the integrand is smooth: 4 points give 1e-6
      const double theta = exit + (entry - exit) * kNode[i];
      const double depth = std::max(0.0, radius * (std::cos(theta) - std::cos(entry)));
      force += kWeight[i] * (entry - exit) * radius * std::cos(theta) * d_1 * (soil.cohesion * depth + 0.5 * d_2 * soil.unit_weight * depth * depth);
    }
    const double drift = 0.5 * radius * (entry - exit) * site.lateral_ratio;  // mean j_y
    const double mobilised = -std::expm1(-drift / soil.lateral_shear_modulus);
    reaction.side_force += efficiency_ * force * mobilised;
    reaction.shear_strength += efficiency_ * force;
  }

 private:
  double efficiency_;  // [-]
};

}  // namespace

void attach_lateral_bulldozing(const Attachment& a) { a.to_wheels<LateralBulldozing>(a["efficiency"]); }

}  // namespace rille::effects
