// Motor lag: the set value reaches the motor through a first-order lag, dx/dt = (set value - x) / time_constant.
// Source: K. J. Astrom & R. M. Murray, "Feedback Systems" (2008), ch. 2.
#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class MotorLag final : public JointEffect {
 public:
  explicit MotorLag(double time_constant) : time_constant_(time_constant) {}
  void shape(DriveLine& line) const override { line.lag += time_constant_; }

 private:
  double time_constant_;  // [s]
};

}  // namespace

void attach_motor_lag(const Attachment& a) { a.to_joints<MotorLag>(a["time_constant"]); }

}  // namespace rille::effects
