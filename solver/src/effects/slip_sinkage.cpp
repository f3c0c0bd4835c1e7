// Slip sinkage: a slipping wheel digs, because shear carries soil out from under it. The sinkage exponent grows with slip:
//   n = n_0 + n_1 |s|,   n_1: slip_gain,   |s|: mean over the last contact length
// Source: L. Ding et al., "Interaction mechanics model for rigid driving wheels of planetary rovers moving on sandy terrain with consideration of
// multiple physical effects", J. Field Robotics 32 (2015), eq. 9.
#include <cmath>

#include "effects/path_mean.hpp"

namespace rille::effects {
namespace {

class SlipSinkage final : public WheelEffect {
 public:
  explicit SlipSinkage(double slip_gain) : slip_gain_(slip_gain) {}
  void before(WheelSite& site) const override { site.soil.sinkage_exponent += slip_gain_ * slip_(); }
  void advance(const WheelSite& site, double h) override { slip_.advance(std::abs(site.slip.ratio), site, h); }
  void settle(const WheelSite& site) override { slip_.set(std::abs(site.slip.ratio)); }
  void visit(Archive& archive) override { slip_.visit(archive); }

 private:
  double slip_gain_;  // [-]
  PathMean slip_;     // [-] |s|
};

}  // namespace

void attach_slip_sinkage(const Attachment& a) { a.to_wheels<SlipSinkage>(a["slip_gain"]); }

}  // namespace rille::effects
