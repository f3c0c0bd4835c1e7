// Joint pulse: an effort of constant size at a joint over a short time that no drive gave: a hand, a stone, a cable.
// The impulse is exact also where the pulse begins or ends inside a step.
#include <algorithm>

#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class JointPulse final : public JointEffect {
 public:
  JointPulse(double torque, double start, double duration) : torque_(torque), start_(start), end_(start + duration) {}
  double effort(const JointMotion& motion) const override {
    const double overlap = std::min(motion.time + motion.step, end_) - std::max(motion.time, start_);
    return overlap > 0 ? overlap / motion.step * torque_ : 0;
  }

 private:
  double torque_;       // [N m or N]
  double start_, end_;  // [s]
};

}  // namespace

void attach_joint_pulse(const Attachment& a) { a.to_joints<JointPulse>(a["torque"], a["start"], a["duration"]); }

}  // namespace rille::effects
