// Backlash: the motor turns through a gap before it meets the joint again; beyond it, the teeth are a stiff spring-damper:
//   d = motor angle - joint angle;  tau = stiffness (d -+ gap/2) + damping d'  for |d| > gap/2, pushing only; 0 inside
// Source: M. Nordin & P.-O. Gutman, "Controlling mechanical systems with backlash - a survey", Automatica 38 (2002), eq. 4.
#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class Backlash final : public JointEffect {
 public:
  Backlash(double gap, double stiffness, double damping, double rotor_inertia) : gap_(gap), stiffness_(stiffness), damping_(damping), rotor_inertia_(rotor_inertia) {}
  void shape(DriveLine& line) const override {
    line.gap += gap_;
    line.compliance += 1 / stiffness_;
    line.damping += damping_;
    line.rotor_inertia += rotor_inertia_;
  }

 private:
  double gap_;  // [rad or m] full play
  double stiffness_;  // [N m/rad or N/m]
  double damping_;  // [N m s/rad or N s/m]
  double rotor_inertia_;  // [kg m^2] at the joint
};

}  // namespace

void attach_backlash(const Attachment& a) { a.to_joints<Backlash>(a["gap"], a["stiffness"], a["damping"], a["rotor_inertia"]); }

}  // namespace rille::effects
