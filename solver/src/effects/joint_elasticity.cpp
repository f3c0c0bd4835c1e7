// Elastic transmission between motor and joint: tau = d / compliance + damping d',  d = motor angle - joint angle.
// A speed drive leads the motor angle, as far as its gain goes; a torque drive accelerates rotor_inertia.
// Source: M. W. Spong, "Modeling and control of elastic joint robots", J. Dynamic Systems, Measurement and Control 109 (1987), eqs 6-7.
#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class JointElasticity final : public JointEffect {
 public:
  JointElasticity(double compliance, double damping, double rotor_inertia) : compliance_(compliance), damping_(damping), rotor_inertia_(rotor_inertia) {}
  void shape(DriveLine& line) const override {
    line.compliance += compliance_;
    line.damping += damping_;
    line.rotor_inertia += rotor_inertia_;
  }

 private:
  double compliance_;  // [rad/(N m) or m/N]
  double damping_;  // [N m s/rad or N s/m]
  double rotor_inertia_;  // [kg m^2 or kg] at the joint
};

}  // namespace

void attach_joint_elasticity(const Attachment& a) { a.to_joints<JointElasticity>(a["compliance"], a["damping"], a["rotor_inertia"]); }

}  // namespace rille::effects
