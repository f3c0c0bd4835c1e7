// Transient sinkage: a slipping wheel goes on digging for seconds after it starts, towards a depth that grows with slip:
//   z = z_s + z_k,   dz_k/dt = (depth |s| - z_k) / time_constant   while the wheel rolls
// z_s is the sinkage of the stress integrals. Source: K. Yoshida et al., "Terramechanics-based analysis and traction control of a lunar/planetary
// rover", FSR 2003, h = h_s + h_k (1 - exp(-t/T)).
#include <cmath>

#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class SinkageTransient final : public WheelEffect {
 public:
  SinkageTransient(double depth, double time_constant) : depth_(depth), time_constant_(time_constant) {}
  void before(WheelSite& site) const override { site.sinkage -= dug_; }
  void advance(const WheelSite& site, double h) override {
    if (std::abs(site.rim_speed) > kRollingSpeed) dug_ -= std::expm1(-h / time_constant_) * (depth_ * std::abs(site.slip.ratio) - dug_);
  }
  void settle(const WheelSite& site) override { dug_ = depth_ * std::abs(site.slip.ratio); }
  void visit(Archive& archive) override { archive(dug_); }

 private:
  double depth_;          // [m] at full slip
  double time_constant_;  // [s]
  double dug_ = 0;        // [m]
};

}  // namespace

void attach_sinkage_transient(const Attachment& a) { a.to_wheels<SinkageTransient>(a["depth"], a["time_constant"]); }

}  // namespace rille::effects
