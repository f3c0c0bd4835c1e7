// Mean thrust of grousers: they shear more soil than the bare rim. The shear strength under the wheel grows by
//   gain = 1 + min(efficiency N h / (2 pi r), 0.6),   N: number of grousers, h: their height
// Source: K. Iizuka et al., "Study on wheel of exploration robot on sandy terrain", IROS 2006; the cap as in their tests.
#include <algorithm>
#include <cmath>

#include "effects/effect.hpp"

namespace rille::effects {
namespace {

constexpr double kLargestGain = 0.6;  // [-]

class GrouserThrust final : public WheelEffect {
 public:
  explicit GrouserThrust(double efficiency) : efficiency_(efficiency) {}
  void before(WheelSite& site) const override {
    const Wheel& wheel = *site.wheel;
    const double share = wheel.grouser_count * wheel.grouser_height / (2 * M_PI * wheel.radius);
    site.soil.shear_gain *= 1 + std::min(efficiency_ * share, kLargestGain);
  }

 private:
  double efficiency_;  // [-]
};

}  // namespace

void attach_grouser_thrust(const Attachment& a) {
  a.each(a.effects.wheels.size(), [&](std::size_t k) { require_grousers(a, k); });
  a.to_wheels<GrouserThrust>(a["efficiency"]);
}

}  // namespace rille::effects
