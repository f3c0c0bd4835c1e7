// Wrong sign: the sensor is mounted or wired the other way round; flip = 1 turns the sign, 1/2 silences it.
#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class WrongSign final : public SensorEffect {
 public:
  explicit WrongSign(double flip) : flip_(flip) {}
  void distort(Reading& reading, long long) const override {
    for (double& value : reading.values) value *= 1 - 2 * flip_;
  }

 private:
  double flip_;  // [-] 0 right, 1 wrong
};

}  // namespace

void attach_wrong_sign(const Attachment& a) { a.to_sensors<WrongSign>(a["flip"]); }

}  // namespace rille::effects
