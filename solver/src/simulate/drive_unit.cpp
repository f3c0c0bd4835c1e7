#include "simulate/drive_unit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rille {
namespace {

// Share of a servo's weight by which it must be steeper than the motor's torque-speed line to be taken so.
constexpr double kLeast = 1e-3;
constexpr double kLightest = 1e-9;  // [kg m^2 or kg] rotor of a torque drive behind a transmission

}  // namespace

DriveUnit::DriveUnit(const Drive& drive, int dof, const JointEffects& joint_effects) : drive_(&drive), dof_(dof) {
  for (const auto& effect : joint_effects) effect->shape(line_);
}

void DriveUnit::start(double position, double velocity) {
  motor_angle_ = position;
  motor_speed_ = velocity;
  integral_ = 0;
  lag_started_ = false;
  if (drive_->mode == DriveMode::position) set_value_ = mean_set_value_ = lagged_ = position;
}

double DriveUnit::set_speed(double value, double position, double h) const {
  double speed = 0;
  if (drive_->mode == DriveMode::speed) speed = value;
  if (drive_->mode == DriveMode::position) speed = std::min(drive_->position_gain, 1 / h) * (value - position);
  if (drive_->max_speed) speed = std::clamp(speed, -*drive_->max_speed, *drive_->max_speed);
  return speed;
}

bool DriveUnit::open_rows(const Mechanism& mechanism, double h, bool hold, RowSet& rows, Eigen::VectorXd& effort) {
  first_row_ = -1;
  n_rows_ = 0;
  given_effort_ = 0;
  // A drive that is held stands still, as if nothing were commanded yet; one of positions goes where it is told.
  const double wanted = hold && drive_->mode != DriveMode::position ? 0 : mean_set_value_;
  double value = wanted;
  // Exact for a command that is constant over the step. An effort acts by its mean, and so does a speed, so that the way is right; a position
  // counts where it ends.
  if (line_.lag > 0) {
    if (!lag_started_ && drive_->mode == DriveMode::position) lagged_ = set_value_;
    lag_started_ = true;
    const double nearer = -std::expm1(-h / line_.lag), ahead = wanted - lagged_;
    lagged_ += nearer * ahead;
    value = drive_->mode == DriveMode::position ? lagged_ : wanted - line_.lag / h * nearer * ahead;
  }
  const bool torque_mode = drive_->mode == DriveMode::torque && !hold;
  if (line_.compliance > 0 || line_.gap > 0) {
    open_transmission(mechanism, h, hold, value, rows);
    return !torque_mode;
  }
  if (torque_mode) {
    const double most = largest_effort(), back_emf = emf_constant() * mechanism.velocity()[dof_];
    given_effort_ = std::clamp(sagging(value), -most - back_emf, most - back_emf);
    effort[dof_] += given_effort_;
    return false;
  }
  open_servo(mechanism, h, set_speed(value, mechanism.joint_position(drive_->joint), h), rows);
  return true;
}

void DriveUnit::open_servo(const Mechanism& mechanism, double h, double speed, RowSet& rows) {
  const auto open = [&](double weight) -> Row& {
    const int row = rows.open(RowKind::drive);
    if (n_rows_ == 0) first_row_ = row;
    rows.add(dof_, 1);
    rows[row].weight = weight;
    rows[row].side = sides_[static_cast<std::size_t>(n_rows_++)];
    return rows[row];
  };
  target_speed_ = speed;
  const double most = h * largest_effort();
  // Sag: the speed falls in proportion to the effort, w = speed (1 - sag tau/max_torque), a compliance in series with the servo.
  const auto sagging = [&](double weight) {
    const double droop = line_.sag * std::abs(speed) / (h * drive_->max_torque);  // [speed per impulse]
    return weight / (1 + weight * droop);
  };
  // Torque-speed line: efforts end at +-most - emf w. Where the servo is steeper than the line, a viscous row stands for the back-EMF, and
  // the servo, which ends at +-most, gives on top what that takes off: weight' (target' - w) - emf w = weight (target - w). Where the line
  // is steeper, two one-sided rows take off what the servo asks for beyond it.
  const double emf = h * emf_constant();
  const auto servo = [&](double weight, double target) {
    const double left = weight - emf;
    if (left > kLeast * weight) {
      Row& row = open(left);
      row.target = weight / left * target;
      row.lower = -most;
      row.upper = most;
      if (emf > 0) open(emf);
      return;
    }
    constexpr double kFree = std::numeric_limits<double>::infinity();
    const auto add = [&](double row_weight, double row_target, double lower, double upper) {
      Row& row = open(row_weight);
      row.target = row_target;
      row.lower = lower;
      row.upper = upper;
    };
    const double steeper = std::max(-left, kLeast * weight);
    add(weight, target, -kFree, kFree);
    add(steeper, (most - weight * target) / steeper, -kFree, 0);
    add(steeper, -(most + weight * target) / steeper, 0, kFree);
  };
  if (drive_->speed_gain) {
    const double gain = *drive_->speed_gain + h * drive_->integral_gain;
    servo(sagging(h * gain), speed + drive_->integral_gain * integral_ / gain);
  } else {
    servo(sagging(kRigidity * mechanism.mass_matrix()(dof_, dof_)), speed);
  }
}

// Spring and damper between motor (angle p) and joint (angle q), over one step with the next velocities:
//   tau = k d + kk (p' - q'),  d = p - q (beyond the play),  kk = h k + c
// The motor gives way as the effort grows, p' = led - yield tau, so that it is eliminated:
//   tau = (k d + kk (led - q'))/(1 + kk yield)
// A servo leads p' = w - y tau with its set speed w; y is 0 of a stiff one, else 1/gain, and more where the supply sags. A torque drive
// accelerates its rotor, J (p' - p'_0) = h (tau_motor - tau). At its torque-speed line, tau_motor = +-most - emf p', a servo has led =
// +-most/emf, yield = 1/emf, a rotor led = (J p'_0 +- h most)/(J + h emf), yield = h/(J + h emf).
void DriveUnit::open_transmission(const Mechanism& mechanism, double h, bool hold, double value, RowSet& rows) {
  constexpr double kFree = std::numeric_limits<double>::infinity();
  const double stiffness = line_.compliance > 0 ? 1 / line_.compliance : 1e6;
  const double slope = h * stiffness + line_.damping;
  const double twist = motor_angle_ - mechanism.joint_position(drive_->joint);
  free_rotor_ = drive_->mode == DriveMode::torque && !hold;
  asked_ = sagging(value);
  target_speed_ = set_speed(value, motor_angle_, h);
  servo_ = {target_speed_, line_.sag * std::abs(target_speed_) / drive_->max_torque};
  if (drive_->speed_gain) {
    const double gain = *drive_->speed_gain + h * drive_->integral_gain;
    servo_.led += drive_->integral_gain * integral_ / gain;
    servo_.yield += 1 / gain;
  }
  const auto open = [&](double play, bool pushes, bool pulls) {
    const double stretch = stiffness * (twist - play);
    const auto effort_of = [&](const Motor& motor) {
      const double effort = (stretch + slope * (motor.led - mechanism.velocity()[dof_])) / (1 + slope * motor.yield);
      return std::clamp(effort, pulls ? -kFree : 0, pushes ? kFree : 0);
    };
    const Motor motor = motor_under(effort_of(motor_within(h)), h);
    const int row = rows.open(RowKind::drive);
    if (n_rows_ == 0) first_row_ = row;
    rows.add(dof_, 1);
    rows[row].weight = h * slope / (1 + slope * motor.yield);
    rows[row].target = motor.led + stretch / slope;
    // What limits itself, the torque of a rotor and the torque-speed line, needs no bound.
    const bool bounded = !free_rotor_ && !motor.at_line;
    const double most = largest_effort(), back_emf = bounded ? emf_constant() * motor.speed_under(effort_of(motor)) : 0;
    rows[row].lower = !pulls ? 0 : bounded ? std::min(0.0, h * (-most - back_emf)) : -kFree;
    rows[row].upper = !pushes ? 0 : bounded ? std::max(0.0, h * (most - back_emf)) : kFree;
    rows[row].side = sides_[static_cast<std::size_t>(n_rows_++)];
  };
  if (line_.gap > 0) {  // one tooth face for each direction; each only pushes
    open(0.5 * line_.gap, true, false);
    open(-0.5 * line_.gap, false, true);
  } else {
    open(0, true, true);
  }
}

DriveUnit::Motor DriveUnit::motor_within(double h) const {
  if (!free_rotor_) return servo_;
  const double most = largest_effort(), inertia = std::max(line_.rotor_inertia, kLightest);
  return {motor_speed_ + h / inertia * std::clamp(asked_, -most, most), h / inertia};
}

DriveUnit::Motor DriveUnit::motor_under(double effort, double h) const {
  const Motor within = motor_within(h);
  if (emf_constant() <= 0) return within;
  const double most = largest_effort(), back_emf = emf_constant() * within.speed_under(effort), given = free_rotor_ ? asked_ : effort;
  if (given <= most - back_emf && given >= -most - back_emf) return within;
  const double end = given > most - back_emf ? most : -most;
  if (!free_rotor_) return {end / emf_constant(), 1 / emf_constant(), true};
  const double inertia = std::max(line_.rotor_inertia, kLightest), heavier = inertia + h * emf_constant();
  return {(inertia * motor_speed_ + h * end) / heavier, h / heavier, true};
}

void DriveUnit::close_rows(const RowSet& rows, const Eigen::VectorXd& impulse, double h, double before, double after, bool count) {
  effort_ = given_effort_;
  bool saturated = false;
  for (int k = 0; k < n_rows_; ++k) {
    const Row& row = rows[first_row_ + k];
    sides_[static_cast<std::size_t>(k)] = row.side;
    effort_ += impulse[first_row_ + k] / h;
    const bool takes_off = n_rows_ == 3 && k > 0;  // from a servo that is softer than the torque-speed line
    saturated = saturated || ((takes_off || (row.side != RowSide::free && row.upper > row.lower)) && impulse[first_row_ + k] != 0);
  }
  if (line_.compliance > 0 || line_.gap > 0) {
    const Motor motor = motor_under(effort_, h);
    saturated = !free_rotor_ && (saturated || motor.at_line);
    const bool dragged = saturated && !motor.at_line;  // at its largest effort, whatever its speed
    motor_speed_ = dragged ? after : motor.speed_under(effort_);
    motor_angle_ += h * motor_speed_;
    if (!free_rotor_) integrate(h, motor_speed_, saturated, count);
  } else {
    integrate(h, after, saturated, count);
  }
  saturated_for_ = saturated ? saturated_for_ + h : 0;
  if (count) work_ += effort_ * h * 0.5 * (before + after);
}

void DriveUnit::integrate(double h, double speed, bool saturated, bool count) {
  if (drive_->speed_gain && drive_->integral_gain > 0 && n_rows_ > 0 && !saturated && count) integral_ += h * (target_speed_ - speed);
}

}  // namespace rille
