// Exit angle: soil follows the wheel up behind it, more than the base model says:
//   theta_r = -acos(1 - (lambda + ratio_change) z/r)
// Source: G. Ishigami et al., J. Field Robotics 24 (2007), eq. 6; lambda 0.1-0.3 for smooth, 1.0-1.2 for paddled wheels.
#include <algorithm>

#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class ExitAngle final : public WheelEffect {
 public:
  explicit ExitAngle(double ratio_change) : ratio_change_(ratio_change) {}
  void before(WheelSite& site) const override {
    site.soil.exit_sinkage_ratio = std::clamp(site.soil.exit_sinkage_ratio + ratio_change_, 0.0, 2.0);
  }

 private:
  double ratio_change_;  // [-]
};

}  // namespace

void attach_exit_angle(const Attachment& a) { a.to_wheels<ExitAngle>(a["ratio_change"]); }

}  // namespace rille::effects
