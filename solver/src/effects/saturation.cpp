// Saturation: the sensor cannot say more than its range, |value| <= 1/inverse_range.
#include <algorithm>

#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class Saturation final : public SensorEffect {
 public:
  explicit Saturation(double inverse_range) : inverse_range_(inverse_range) {}
  void distort(Reading& reading, long long) const override {
    for (double& value : reading.values) value = std::clamp(value, -1 / inverse_range_, 1 / inverse_range_);
  }

 private:
  double inverse_range_;  // [1/SI]
};

}  // namespace

void attach_saturation(const Attachment& a) { a.to_sensors<Saturation>(a["inverse_range"]); }

}  // namespace rille::effects
