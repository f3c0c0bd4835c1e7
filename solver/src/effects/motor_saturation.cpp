// Torque-speed line of a DC motor: the available torque falls with speed,
//   -max_torque (1 + w/w_0) <= tau <= max_torque (1 - w/w_0),   1/w_0: inverse_no_load_speed
// Back-EMF therefore helps to brake. Source: any text on DC motors, e.g. K. M. Lynch & F. C. Park, "Modern Robotics" (2017), ch. 8.9.1.
#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class MotorSaturation final : public JointEffect {
 public:
  explicit MotorSaturation(double inverse_no_load_speed) : inverse_no_load_speed_(inverse_no_load_speed) {}
  void shape(DriveLine& line) const override { line.inverse_no_load_speed += inverse_no_load_speed_; }

 private:
  double inverse_no_load_speed_;  // [s/rad or s/m]
};

}  // namespace

void attach_motor_saturation(const Attachment& a) { a.to_joints<MotorSaturation>(a["inverse_no_load_speed"]); }

}  // namespace rille::effects
