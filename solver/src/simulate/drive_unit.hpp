// A drive between its command and its joint: lag and supply of the motor, its torque-speed line, servo, transmission.
//
//   speed, position   the servo holds its set speed with any effort up to max_torque (a stiff implicit row); with speed_gain it is a
//                     PI controller, effort = speed_gain e + integral_gain Int e dt, taken implicitly, its integral frozen while saturated
//   torque            a given effort
// With an elastic transmission or play (effects joint_elasticity, backlash) the motor angle is a state of its own; spring and damper are
// implicit rows, and the rotor of a torque drive, or what a servo yields, is eliminated by hand from the same step.
#pragma once

#include <array>
#include <cmath>
#include <string>

#include "effects/effect.hpp"
#include "model/model.hpp"
#include "physics/rows.hpp"
#include "world/mechanism.hpp"

namespace rille {

class DriveUnit {
 public:
  // joint_effects: of the joint that it moves.
  DriveUnit(const Drive& drive, int dof, const JointEffects& joint_effects);

  // A step begins: what was commanded before holds on.
  void begin_step() { mean_set_value_ = set_value_; }
  // A command that acts for this share of the step, from some instant to the end of it.
  void set(double command, double share = 1) {
    const double value = line_.gain * command;
    mean_set_value_ += share * (value - set_value_);
    set_value_ = value;
  }
  double command() const { return line_.gain != 0 ? set_value_ / line_.gain : 0; }
  bool is_set_to(double command) const { return line_.gain * command == set_value_; }
  // The motor starts where the joint stands, and turns with it.
  void start(double position, double velocity);

  // The joint was put elsewhere; a motor behind a transmission goes along, so that the twist stays.
  void carry(double position, double velocity) {
    motor_angle_ += position;
    motor_speed_ += velocity;
  }

  // Appends its rows, or adds its effort to `effort`. hold: stand still instead.
  // Returns whether there are rows of a servo; a transmission behind a given effort has rows that come with effects.
  bool open_rows(const Mechanism& mechanism, double h, bool hold, RowSet& rows, Eigen::VectorXd& effort);
  // Reads the effort back; before, after: speed of the joint at both ends of the step. count: whether work counts.
  void close_rows(const RowSet& rows, const Eigen::VectorXd& impulse, double h, double before, double after, bool count);

  double effort() const { return effort_; }                // [N m or N] of the last step
  double work() const { return work_; }                    // [J] since t = 0
  double saturated_for() const { return saturated_for_; }  // [s]
  const Drive& drive() const { return *drive_; }
  void clear_work() { work_ = 0; }
  void visit(Archive& archive) {
    archive(set_value_, mean_set_value_, lagged_, integral_, motor_angle_, motor_speed_, effort_, work_, saturated_for_, sides_, lag_started_);
  }

 private:
  double set_speed(double value, double position, double h) const;
  double largest_effort() const { return drive_->max_torque / (1 + line_.sag); }  // tau = max_torque (1 - sag tau/max_torque)
  double emf_constant() const { return drive_->max_torque * line_.inverse_no_load_speed; } // [N m s/rad] what the torque-speed line falls by
  double sagging(double torque) const { return torque / (1 + line_.sag * std::abs(torque) / drive_->max_torque); }  // of a torque drive

  // A motor behind a transmission in one step: its speed falls with the effort that goes through. at_line: its torque-speed line says so.
  struct Motor {
    double led = 0, yield = 0;  // [rad/s], [rad/s per N m]
    bool at_line = false;
    double speed_under(double effort) const { return led - yield * effort; }
  };
  Motor motor_within(double h) const;                // as long as its torque-speed line does not matter
  Motor motor_under(double effort, double h) const;  // by what limits it under this effort
  void open_transmission(const Mechanism& mechanism, double h, bool hold, double value, RowSet& rows);
  void open_servo(const Mechanism& mechanism, double h, double speed, RowSet& rows);
  void integrate(double h, double speed, bool saturated, bool count);  // the speed error

  const Drive* drive_;
  int dof_;
  DriveLine line_;
  double set_value_ = 0;      // [rad/s, rad or N m] of the last command
  double mean_set_value_ = 0; // over the step: the motion is continuous in the time of a command
  double lagged_ = 0;         // the same behind the motor's lag
  bool lag_started_ = false;
  double integral_ = 0;       // [rad or m] integrated speed error
  double motor_angle_ = 0;    // [rad] at the joint, behind a transmission
  double motor_speed_ = 0;    // [rad/s]
  double effort_ = 0;
  double work_ = 0;
  double saturated_for_ = 0;
  std::array<RowSide, 3> sides_ = {};
  int first_row_ = -1;        // -1: none in this step
  int n_rows_ = 0;
  double given_effort_ = 0;   // without rows
  bool free_rotor_ = false;   // behind a transmission: accelerated by a given effort, not led by a servo
  Motor servo_;               // behind a transmission
  double asked_ = 0;          // [N m or N] of a torque drive behind a transmission, as its supply lets it
  double target_speed_ = 0;   // [rad/s] of the PI controller
};

}  // namespace rille
