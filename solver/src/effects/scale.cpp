// Scale error: the gain of the sensor is off, value (1 + relative_error).
#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class Scale final : public SensorEffect {
 public:
  explicit Scale(double relative_error) : relative_error_(relative_error) {}
  void distort(Reading& reading, long long) const override {
    for (double& value : reading.values) value *= 1 + relative_error_;
  }

 private:
  double relative_error_;  // [-]
};

}  // namespace

void attach_scale(const Attachment& a) { a.to_sensors<Scale>(a["relative_error"]); }

}  // namespace rille::effects
