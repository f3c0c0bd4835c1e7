// Rolling resistance of the wheel itself (hysteresis of a tyre, bearings that feel the load):
//   the torque that the axle needs grows by coefficient x load x radius, against the turning
// Source: J. Y. Wong, "Theory of Ground Vehicles" (2008), ch. 1.2, coefficient of rolling resistance.
#include <algorithm>

#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class RollingResistance final : public WheelEffect {
 public:
  explicit RollingResistance(double coefficient) : coefficient_(coefficient) {}
  bool acts_on_rigid() const override { return true; }
  void after(const WheelSite& site, SoilReaction& reaction) const override {
    const double torque = coefficient_ * std::max(reaction.normal_load, 0.0) * site.wheel->radius;
    reaction.torque += torque;
    reaction.rolling_torque += torque;
  }

 private:
  double coefficient_;  // [-]
};

}  // namespace

void attach_rolling_resistance(const Attachment& a) { a.to_wheels<RollingResistance>(a["coefficient"]); }

}  // namespace rille::effects
