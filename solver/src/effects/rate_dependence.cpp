// Rate dependence: soil that is loaded faster is stiffer (or softer, gain < 0):
//   both pressure-sinkage moduli are multiplied by 1 + gain (v / reference_speed)^exponent,  v: speed of the rim, mean over the
//   last contact length
// Source: M. Grahn, "Prediction of sinkage and rolling resistance for off-the-road vehicles considering penetration velocity",
// J. Terramechanics 28 (1991), eq. 3, with the speed of the rim for that of penetration.
#include <algorithm>
#include <cmath>

#include "effects/path_mean.hpp"

namespace rille::effects {
namespace {

class RateDependence final : public WheelEffect {
 public:
  RateDependence(double gain, double reference_speed, double exponent)
      : gain_(gain), reference_speed_(reference_speed), exponent_(exponent) {}
  void before(WheelSite& site) const override {
    const double factor = std::max(1 + gain_ * std::pow(speed_() / reference_speed_, exponent_), 0.05);
    scale_pressure(site.soil, factor);
  }
  void advance(const WheelSite& site, double h) override { speed_.advance(std::abs(site.rim_speed), site, h); }
  void settle(const WheelSite& site) override { speed_.set(std::abs(site.rim_speed)); }
  void visit(Archive& archive) override { speed_.visit(archive); }

 private:
  double gain_;             // [-]
  double reference_speed_;  // [m/s]
  double exponent_;         // [-]
  PathMean speed_;          // [m/s] of the rim
};

}  // namespace

void attach_rate_dependence(const Attachment& a) {
  a.to_wheels<RateDependence>(a["gain"], a["reference_speed"], a["exponent"]);
}

}  // namespace rille::effects
