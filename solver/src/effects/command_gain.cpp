// Command gain: a drive does more or less than it is told, set value = (1 + relative_error) command. A torque constant, the ratio of a gear or
// the scale of a command channel are off. Source: definition.
#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class CommandGain final : public JointEffect {
 public:
  explicit CommandGain(double relative_error) : factor_(1 + relative_error) {}
  void shape(DriveLine& line) const override { line.gain *= factor_; }

 private:
  double factor_;  // [-]
};

}  // namespace

void attach_command_gain(const Attachment& a) { a.to_joints<CommandGain>(a["relative_error"]); }

}  // namespace rille::effects
