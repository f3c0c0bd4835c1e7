// Ripple of grousers: stresses rise and fall as grousers enter and leave the soil, N times a turn:
//   every stress is multiplied by 1 + relative_amplitude sin(N theta_wheel + phase)
// Source: R. A. Irani, R. J. Bauer & A. Warkentin, "A dynamic terramechanic model for small lightweight vehicles with rigid wheels and grousers
// operating in sandy soil", J. Terramechanics 48 (2011), eqs 16-18.
#include <cmath>

#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class GrouserRipple final : public WheelEffect {
 public:
  GrouserRipple(double relative_amplitude, double phase) : relative_amplitude_(relative_amplitude), phase_(phase) {}
  void settle(const WheelSite&) override { relative_amplitude_ = 0; }  // its mean over a turn
  void begin(const WheelSite&) override {}                             // it has no memory
  void after(const WheelSite& site, SoilReaction& reaction) const override {
    const double factor = 1 + relative_amplitude_ * std::sin(site.wheel->grouser_count * site.angle + phase_);
    for (double* value : {&reaction.normal_load, &reaction.drawbar_pull, &reaction.side_force, &reaction.torque, &reaction.rolling_torque,
                          &reaction.shear_strength, &reaction.scrub_torque, &reaction.peak_stress})
      *value *= factor;
  }

 private:
  double relative_amplitude_;  // [-]
  double phase_;               // [rad]
};

}  // namespace

void attach_grouser_ripple(const Attachment& a) {
  a.each(a.effects.wheels.size(), [&](std::size_t k) { require_grousers(a, k); });
  a.to_wheels<GrouserRipple>(a["relative_amplitude"], a["phase"]);
}

}  // namespace rille::effects
