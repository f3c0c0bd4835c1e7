// Drift: the zero of the sensor moves at a constant rate.
#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class Drift final : public SensorEffect {
 public:
  explicit Drift(double rate) : rate_(rate) {}
  void distort(Reading& reading, long long) const override {
    for (double& value : reading.values) value += rate_ * reading.time;
  }

 private:
  double rate_;  // [SI/s]
};

}  // namespace

void attach_drift(const Attachment& a) { a.to_sensors<Drift>(a["rate"]); }

}  // namespace rille::effects
