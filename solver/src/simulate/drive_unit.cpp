#include "simulate/drive_unit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rille {
namespace {

// Share of a servo's weight by which it must be steeper than the motor's torque-speed line to be taken so.
constexpr double kLeast = 1e-3;

}  // namespace

DriveUnit::DriveUnit(const Drive& drive, int dof, const JointEffects& joint_effects) : drive_(&drive), dof_(dof) {
  for (const auto& effect : joint_effects) effect->shape(line_);
}

void DriveUnit::start(double position) {
  motor_angle_ = position;
  motor_speed_ = integral_ = 0;
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
  value_ = wanted;
  // Exact for a command that is constant over the step. An effort acts by its mean, and so does a speed, so that the way is right; a position
  // counts where it ends.
  if (line_.lag > 0) {
    if (!lag_started_ && drive_->mode == DriveMode::position) lagged_ = set_value_;
    lag_started_ = true;
    const double nearer = -std::expm1(-h / line_.lag), ahead = wanted - lagged_;
    lagged_ += nearer * ahead;
    value_ = drive_->mode == DriveMode::position ? lagged_ : wanted - line_.lag / h * nearer * ahead;
  }
  double value = value_;
  const bool torque_mode = drive_->mode == DriveMode::torque && !hold;
  if (line_.compliance > 0 || line_.gap > 0) {
    open_transmission(mechanism, h, hold, value, rows);
    return !torque_mode;
  }
  if (torque_mode) {
    const double most = largest_effort();
    value /= 1 + line_.sag * std::abs(value) / drive_->max_torque;
    const double back_emf = drive_->max_torque * line_.inverse_no_load_speed * mechanism.velocity()[dof_];
    given_effort_ = std::clamp(value, -most - back_emf, most - back_emf);
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
  const double emf = h * drive_->max_torque * line_.inverse_no_load_speed;
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
// A torque drive accelerates its rotor, J (p' - p'_0) = h (tau_motor - tau), so that
//   p' = p'_free + share q',  p'_free = (J p'_0 + h tau_motor - h k d)/(J + h kk),  share = h kk/(J + h kk).
// A servo leads p' = w - y tau with its set speed w; what it yields, y, is 0 of a stiff one, else 1/gain, and more where the supply sags:
//   tau = (k d + kk (w - q'))/(1 + kk y), the servo itself as the spring becomes stiff.
void DriveUnit::open_transmission(const Mechanism& mechanism, double h, bool hold, double value, RowSet& rows) {
  const double stiffness = line_.compliance > 0 ? 1 / line_.compliance : 1e6;
  const double slope = h * stiffness + line_.damping;
  const double twist = motor_angle_ - mechanism.joint_position(drive_->joint);
  const double most = largest_effort();
  const double inertia = std::max(line_.rotor_inertia, 1e-9);
  free_rotor_ = drive_->mode == DriveMode::torque && !hold;
  target_speed_ = led_speed_ = set_speed(value, motor_angle_, h);
  yield_ = line_.sag * std::abs(target_speed_) / drive_->max_torque;
  if (drive_->speed_gain) {
    const double gain = *drive_->speed_gain + h * drive_->integral_gain;
    led_speed_ += drive_->integral_gain * integral_ / gain;
    yield_ += 1 / gain;
  }
  const auto open = [&](double play, double lower, double upper) {
    const double stretch = stiffness * (twist - play);
    double weight = h * slope, motor = 0;
    if (free_rotor_) {
      const double torque = std::clamp(value, -most, most);
      motor = (inertia * motor_speed_ + h * torque - h * stretch) / (inertia + h * slope);
      weight *= inertia / (inertia + h * slope);
    } else {
      motor = led_speed_ - yield_ * (stretch + slope * led_speed_) / (1 + slope * yield_);
      weight /= 1 + slope * yield_;
    }
    const int row = rows.open(RowKind::drive);
    if (n_rows_ == 0) first_row_ = row;
    rows.add(dof_, 1);
    rows[row].weight = weight;
    rows[row].target = h * (stretch + slope * motor) / weight;
    rows[row].lower = free_rotor_ ? (lower < 0 ? -std::numeric_limits<double>::infinity() : 0) : h * lower;
    rows[row].upper = free_rotor_ ? (upper > 0 ? std::numeric_limits<double>::infinity() : 0) : h * upper;
    rows[row].side = sides_[static_cast<std::size_t>(n_rows_++)];
  };
  if (line_.gap > 0) {  // one tooth face for each direction; each only pushes
    open(0.5 * line_.gap, 0, most);
    open(-0.5 * line_.gap, -most, 0);
  } else {
    open(0, -most, most);
  }
}

void DriveUnit::close_rows(const RowSet& rows, const Eigen::VectorXd& impulse, double h, double before, double after, bool count) {
  effort_ = given_effort_;
  bool saturated = false;
  for (int k = 0; k < n_rows_; ++k) {
    const Row& row = rows[first_row_ + k];
    sides_[static_cast<std::size_t>(k)] = row.side;
    effort_ += impulse[first_row_ + k] / h;
    saturated = saturated || (row.side != RowSide::free && row.upper > row.lower && impulse[first_row_ + k] != 0);
  }
  saturated_for_ = saturated ? saturated_for_ + h : 0;
  if (line_.compliance > 0 || line_.gap > 0) {
    if (free_rotor_) {
      // Momentum of the rotor with the torque that really went through.
      const double torque = std::clamp(value_, -largest_effort(), largest_effort());
      motor_speed_ += h / std::max(line_.rotor_inertia, 1e-9) * (torque - effort_);
      motor_angle_ += h * motor_speed_;
    } else {
      motor_speed_ = saturated ? after : led_speed_ - yield_ * effort_;  // a motor at its largest effort is dragged along
      motor_angle_ += h * motor_speed_;
      integrate(h, motor_speed_, saturated, count);
    }
  } else {
    integrate(h, after, saturated, count);
  }
  if (count) work_ += effort_ * h * 0.5 * (before + after);
}

void DriveUnit::integrate(double h, double speed, bool saturated, bool count) {
  if (drive_->speed_gain && drive_->integral_gain > 0 && n_rows_ > 0 && !saturated && count) integral_ += h * (target_speed_ - speed);
}

}  // namespace rille
