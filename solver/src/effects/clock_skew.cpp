// Clock skew: the sensor's clock runs fast, its time stamps are t (1 + skew).
#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class ClockSkew final : public SensorEffect {
 public:
  explicit ClockSkew(double skew) : skew_(skew) {}
  void distort(Reading& reading, long long) const override { reading.time *= 1 + skew_; }

 private:
  double skew_;  // [-]
};

}  // namespace

void attach_clock_skew(const Attachment& a) { a.to_sensors<ClockSkew>(a["skew"]); }

}  // namespace rille::effects
