// Bias: every component reads too much by a constant.
#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class Bias final : public SensorEffect {
 public:
  explicit Bias(double offset) : offset_(offset) {}
  void distort(Reading& reading, long long) const override {
    for (double& value : reading.values) value += offset_;
  }

 private:
  double offset_;  // [SI]
};

}  // namespace

void attach_bias(const Attachment& a) { a.to_sensors<Bias>(a["offset"]); }

}  // namespace rille::effects
