// Delay: the sensor says what was true some time ago.
#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class Delay final : public SensorEffect {
 public:
  explicit Delay(double delay) : delay_(delay) {}
  double delay() const override { return delay_; }

 private:
  double delay_;  // [s]
};

}  // namespace

void attach_delay(const Attachment& a) { a.to_sensors<Delay>(a["delay"]); }

}  // namespace rille::effects
