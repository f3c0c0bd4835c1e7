#include "simulate/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/error.hpp"
#include "simulate/placement.hpp"

namespace rille {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

// Weight of rows that are meant to be rigid (drives, limits), as a multiple of the joint's own inertia: the speed error of a
// drive is effort h / weight, about 1e-8 rad/s, while the matrix stays well conditioned.
constexpr double kRigidity = 1e7;
constexpr double kLimitReturnSpeed = 1.0;  // [rad/s or m/s] largest speed at which a violated limit is restored
constexpr double kSaturationTime = 0.5;    // [s] a drive at its limit for so long is worth an event; starting up is not
constexpr double kWatchInterval = 0.1;     // [s] between looks at bodies that reach into the ground
constexpr double kRestSpeed = 1e-4;        // [m/s, rad/s] slower than this everywhere counts as settled
constexpr double kLargestSpeed = 1e6;      // [m/s, rad/s] beyond this a state counts as diverged

}  // namespace

Simulation::Simulation(Model model)
    : model_(std::make_unique<Model>(std::move(model))), mechanism_(model_->rover, model_->scenario.gravity) {
  const Rover& rover = model_->rover;
  for (const Differential& differential : rover.differentials) {
    const Joint& a = rover.joints[differential.joint_a];
    const Joint& b = rover.joints[differential.joint_b];
    for (const Joint* joint : {&a, &b})
      if (joint->kind != JointKind::hinge || joint->parent != differential.carrier)
        throw InputRefused(fmt::format("differential '{}' needs joint '{}' to be a hinge on its carrier; correct joint or carrier",
                                       differential.name, joint->name));
    const double cosine = a.axis.dot(b.axis);
    if (std::abs(cosine) < 0.999)
      throw InputRefused(fmt::format("differential '{}' needs parallel hinges, but '{}' and '{}' stand at {:.2f} deg; correct an axis",
                                     differential.name, a.name, b.name, std::acos(cosine) * 180 / M_PI));
    position_sign_.push_back(cosine > 0 ? 1 : -1);
  }
  for (std::size_t j = 0; j < rover.joints.size(); ++j) {
    if (!rover.joints[j].limit) continue;
    limits_.push_back({.joint = static_cast<int>(j), .at_upper = false});
    limits_.push_back({.joint = static_cast<int>(j), .at_upper = true});
  }
  in_ground_.assign(rover.outlines.size(), false);
  drives_.resize(rover.drives.size());
  effort_.setZero(mechanism_.dofs());
  place();
  if (model_->terrain)
    for (std::size_t w = 0; w < rover.wheels.size(); ++w)
      contacts_.emplace_back(rover, *model_->terrain, static_cast<int>(w));
  // A position drive that was not commanded yet holds where it stands.
  for (std::size_t d = 0; d < drives_.size(); ++d)
    if (rover.drives[d].mode == DriveMode::position) drives_[d].set_value = mechanism_.joint_position(rover.drives[d].joint);
  read_commands();
  mechanism_.update_kinematics();
  // Contacts are read once, so that a snapshot at t = 0 shows the wheels where they are.
  rows_.clear();
  for (WheelContact& contact : contacts_) contact.open_rows(mechanism_, model_->scenario.step, rows_);
}

void Simulation::place() {
  const Scenario& scenario = model_->scenario;
  for (const InitialJointState& initial : scenario.initial_states)
    mechanism_.set_joint(initial.joint, initial.position, initial.velocity);
  if (scenario.placement == Placement::on_terrain) {
    mechanism_.set_root(pose_on_terrain(*model_, mechanism_));
    return;
  }
  mechanism_.set_root(BodyState{.position = scenario.start_position,
                                .rotation = scenario.start_rotation,
                                .velocity = scenario.start_velocity,
                                .angular_velocity = scenario.start_angular_velocity});
}

void Simulation::read_commands() {
  const auto& commands = model_->scenario.commands;
  // Half a step of tolerance, so that a command at k h acts in step k whatever the rounding of k h.
  const double now = time() + 0.5 * model_->scenario.step;
  for (; next_command_ < commands.size() && commands[next_command_].time <= now; ++next_command_)
    drives_[static_cast<std::size_t>(commands[next_command_].drive)].set_value = commands[next_command_].value;
}

bool Simulation::open_drive_rows(double h) {
  const Rover& rover = model_->rover;
  const auto& mass = mechanism_.mass_matrix();
  bool any = false;
  for (std::size_t d = 0; d < drives_.size(); ++d) {
    DriveState& state = drives_[d];
    const Drive& drive = rover.drives[d];
    const int dof = mechanism_.dof_of(drive.joint);
    state.row = -1;
    if (drive.mode == DriveMode::torque && !holding_) {
      state.effort = std::clamp(state.set_value, -drive.max_torque, drive.max_torque);
      effort_[dof] = state.effort;
      continue;
    }
    double speed = 0;
    if (drive.mode == DriveMode::speed && !holding_) speed = state.set_value;
    if (drive.mode == DriveMode::position)
      speed = std::min(drive.position_gain, 1 / h) * (state.set_value - mechanism_.joint_position(drive.joint));
    if (drive.max_speed) speed = std::clamp(speed, -*drive.max_speed, *drive.max_speed);
    state.row = rows_.open();
    rows_.add(dof, 1);
    Row& row = rows_[state.row];
    row.weight = kRigidity * mass(dof, dof);
    row.target = speed;
    row.lower = -h * drive.max_torque;
    row.upper = h * drive.max_torque;
    row.side = state.side;
    any = true;
  }
  return any;
}

bool Simulation::open_limit_rows(double h) {
  const auto& mass = mechanism_.mass_matrix();
  bool any = false;
  for (LimitState& state : limits_) {
    const Limit& limit = *model_->rover.joints[state.joint].limit;
    const int dof = mechanism_.dof_of(state.joint);
    const double position = mechanism_.joint_position(state.joint);
    const double gap = state.at_upper ? limit.upper - position : position - limit.lower;
    const double closing = (state.at_upper ? 1 : -1) * mechanism_.joint_velocity(state.joint);
    state.row = -1;
    if (gap > 2 * h * std::abs(closing) + 1e-3) {
      state.touching = false;
      state.side = RowSide::at_lower;
      continue;
    }
    state.row = rows_.open();
    rows_.add(dof, state.at_upper ? -1 : 1);
    Row& row = rows_[state.row];
    row.weight = kRigidity * mass(dof, dof);
    row.target = std::min(-gap / h, kLimitReturnSpeed);  // arrives at the limit, not beyond
    row.lower = 0;
    row.side = state.side;
    any = true;
  }
  return any;
}

void Simulation::open_coupling_rows(double h) {
  const Rover& rover = model_->rover;
  const auto couple = [&](int joint_a, double factor_a, int joint_b, double factor_b) {
    const int dof_a = mechanism_.dof_of(joint_a);
    const int dof_b = mechanism_.dof_of(joint_b);
    const int row = rows_.open();
    if (dof_a < dof_b) {
      rows_.add(dof_a, factor_a);
      rows_.add(dof_b, factor_b);
    } else {
      rows_.add(dof_b, factor_b);
      rows_.add(dof_a, factor_a);
    }
    // Linear in the positions: correcting the whole error in one step is exact and stable.
    const double error = factor_a * mechanism_.joint_position(joint_a) + factor_b * mechanism_.joint_position(joint_b);
    rows_[row].target = -error / h;
  };
  for (std::size_t k = 0; k < rover.differentials.size(); ++k)
    couple(rover.differentials[k].joint_a, 1, rover.differentials[k].joint_b, position_sign_[k]);
  for (const Gear& gear : rover.gears) couple(gear.joint_a, -gear.ratio, gear.joint_b, 1);
}

Outcome Simulation::fail(Outcome outcome, std::string message) {
  outcome_ = outcome;
  message_ = std::move(message);
  events_.push_back({time(), word(outcome), "", message_});
  return outcome_;
}

void Simulation::note(const char* kind, const std::string& subject, std::string message) {
  if (!holding_) events_.push_back({time(), kind, subject, std::move(message)});
}

Outcome Simulation::advance(bool hold) {
  const Scenario& scenario = model_->scenario;
  const double h = scenario.step;
  holding_ = hold;
  mechanism_.update_kinematics();
  watch_outlines();

  rows_.clear();
  effort_.setZero();
  mechanism_.update_mass_matrix();
  const bool driven = open_drive_rows(h);
  const bool limited = open_limit_rows(h);
  open_coupling_rows(h);
  bool on_soil = false;
  for (WheelContact& contact : contacts_) {
    const ContactStatus status = contact.open_rows(mechanism_, h, rows_);
    const Vector3d& center = contact.state().center;
    if (status == ContactStatus::off_terrain)
      return fail(Outcome::left_terrain,
                  fmt::format("at t = {:.3f} s wheel '{}' left terrain '{}' or came to a missing height at x = {:.2f} m, "
                              "y = {:.2f} m; take a larger terrain or a shorter drive",
                              time(), model_->rover.wheels[&contact - contacts_.data()].name, model_->terrain->name,
                              center.x(), center.y()));
    if (status == ContactStatus::buried)
      return fail(Outcome::wheel_buried,
                  fmt::format("at t = {:.3f} s wheel '{}' sank past its axle at x = {:.2f} m, y = {:.2f} m; the soil is too "
                              "soft for its load, or the step of {:g} s too large",
                              time(), model_->rover.wheels[&contact - contacts_.data()].name, center.x(), center.y(), h));
    on_soil = on_soil || status == ContactStatus::on_soil;
  }

  const bool coupled = !model_->rover.differentials.empty() || !model_->rover.gears.empty();
  const bool free_of_rows = !driven && !limited && !coupled && !on_soil;
  const VectorXd before = mechanism_.velocity();
  if (free_of_rows && scenario.integrator != Integrator::semi_implicit_euler) {
    mechanism_.advance_rk4(h, effort_);
  } else {
    const VectorXd& v_free = mechanism_.free_velocity(h, effort_);
    if (!solver_.solve(mechanism_.mass_matrix(), v_free, rows_, velocity_))
      return fail(Outcome::diverged,
                  fmt::format("at t = {:.3f} s the constraint rows found no solution; try a smaller step than {:g} s",
                              time(), h));
    mechanism_.set_velocity(velocity_);
    mechanism_.advance_position(h);
  }
  account(h, before, mechanism_.velocity());
  ++steps_;

  const VectorXd& after = mechanism_.velocity();
  const double fastest = after.cwiseAbs().maxCoeff();
  if (!(fastest < kLargestSpeed) || !after.allFinite()) {
    Eigen::Index worst = 0;
    for (Eigen::Index i = 0; i < after.size(); ++i)
      if (!std::isfinite(after[i]) || std::abs(after[i]) > std::abs(after[worst])) worst = i;
    std::string where = "the root body";
    for (std::size_t j = 0; j < model_->rover.joints.size(); ++j)
      if (mechanism_.dof_of(static_cast<int>(j)) == worst) where = "joint '" + model_->rover.joints[j].name + "'";
    return fail(Outcome::diverged, fmt::format("at t = {:.3f} s the speed of {} grew to {:g}; try a smaller step than {:g} s",
                                               time(), where, after[worst], h));
  }
  return Outcome::running;
}

void Simulation::account(double h, const VectorXd& before, const VectorXd& after) {
  const Rover& rover = model_->rover;
  const auto& impulse = solver_.impulse();
  for (WheelContact& contact : contacts_) contact.close_rows(rows_, impulse, h);
  for (std::size_t d = 0; d < drives_.size(); ++d) {
    DriveState& state = drives_[d];
    const Drive& drive = rover.drives[d];
    const int dof = mechanism_.dof_of(drive.joint);
    if (state.row >= 0) {
      state.side = rows_[state.row].side;
      state.effort = impulse[state.row] / h;
      const double before_now = state.saturated_for;
      state.saturated_for = state.side == RowSide::free ? 0 : state.saturated_for + h;
      if (before_now < kSaturationTime && state.saturated_for >= kSaturationTime)
        note("drive_saturated", drive.name,
             fmt::format("drive '{}' was at its largest effort of {:g} for {:g} s until t = {:.3f} s", drive.name,
                         drive.max_torque, kSaturationTime, time()));
    }
    // Exact for an impulse: the kinetic energy changes by the impulse times the mean of the speeds before and after.
    if (!holding_) state.work += state.effort * h * 0.5 * (before[dof] + after[dof]);
  }
  for (LimitState& state : limits_) {
    if (state.row < 0) continue;
    state.side = rows_[state.row].side;
    const bool touching = state.side == RowSide::free;
    if (touching && !state.touching)
      note("limit_reached", rover.joints[state.joint].name,
           fmt::format("joint '{}' reached its {} limit of {:g} at t = {:.3f} s", rover.joints[state.joint].name,
                       state.at_upper ? "upper" : "lower",
                       state.at_upper ? rover.joints[state.joint].limit->upper : rover.joints[state.joint].limit->lower,
                       time()));
    state.touching = touching;
  }
}

// Bodies other than wheels do not touch the ground in this version; that they should have is at least said.
void Simulation::watch_outlines() {
  if (!model_->terrain || holding_) return;
  const auto stride = std::max(1LL, std::llround(kWatchInterval / model_->scenario.step));
  if (steps_ % stride != 0) return;
  const Ground ground(*model_->terrain);
  for (std::size_t k = 0; k < in_ground_.size(); ++k) {
    const Outline& outline = model_->rover.outlines[k];
    double deepest = 0;
    for (const Vector3d& corner : outline.corners) {
      const Vector3d p = mechanism_.to_world(outline.body, corner);
      const auto height = ground.height(p.x(), p.y());
      if (height) deepest = std::max(deepest, *height - p.z());
    }
    const std::string& name = model_->rover.bodies[outline.body].name;
    if (deepest > 0 && !in_ground_[k])
      note("body_in_ground", name,
           fmt::format("the collision shape of '{}' reaches {:.3f} m into the ground at t = {:.3f} s; only wheels touch it in this version, "
                       "so the drive goes on as if it did not",
                       name, deepest, time()));
    in_ground_[k] = deepest > 0;
  }
}

Outcome Simulation::settle() {
  const double h = model_->scenario.step;
  const auto most = static_cast<long long>(std::llround(model_->scenario.settle_time / h));
  const auto least = std::min(most, static_cast<long long>(std::ceil(0.2 / h)));
  long long taken = 0;
  bool at_rest = false;
  while (taken < most && outcome_ == Outcome::running && !at_rest) {
    advance(true);
    ++taken;
    at_rest = taken >= least && mechanism_.velocity().cwiseAbs().maxCoeff() < kRestSpeed;
  }
  steps_ = 0;
  holding_ = false;
  for (DriveState& drive : drives_) drive.work = 0;
  if (most > 0 && outcome_ == Outcome::running)
    note(at_rest ? "settled" : "not_settled", "",
         at_rest ? fmt::format("came to rest within {:.3f} s before t = 0", static_cast<double>(taken) * h)
                 : fmt::format("still moves at {:.2g} m/s or rad/s after {:g} s; a longer settle_time may help",
                               mechanism_.velocity().cwiseAbs().maxCoeff(), model_->scenario.settle_time));
  return outcome_;
}

Outcome Simulation::step() {
  if (outcome_ != Outcome::running) return outcome_;
  read_commands();
  return advance(false);
}

Snapshot Simulation::snapshot() const {
  const Rover& rover = model_->rover;
  Snapshot snapshot;
  snapshot.time = time();
  mechanism_.update_kinematics();
  for (std::size_t b = 0; b < rover.bodies.size(); ++b) snapshot.bodies.push_back(mechanism_.body_state(static_cast<int>(b)));
  snapshot.joints.resize(rover.joints.size());
  for (std::size_t j = 0; j < rover.joints.size(); ++j) {
    const JointKind kind = rover.joints[j].kind;
    if (kind != JointKind::hinge && kind != JointKind::prismatic) continue;
    snapshot.joints[j].position = mechanism_.joint_position(static_cast<int>(j));
    snapshot.joints[j].velocity = mechanism_.joint_velocity(static_cast<int>(j));
  }
  for (std::size_t d = 0; d < drives_.size(); ++d) {
    JointState& joint = snapshot.joints[static_cast<std::size_t>(rover.drives[d].joint)];
    joint.effort = drives_[d].effort;
    joint.work = drives_[d].work;
  }
  for (const WheelContact& contact : contacts_) snapshot.wheels.push_back(contact.state());
  return snapshot;
}

std::vector<Event> Simulation::take_events() { return std::exchange(events_, {}); }

double Simulation::largest_differential_error() const {
  double largest = 0;
  for (std::size_t k = 0; k < position_sign_.size(); ++k) {
    const Differential& differential = model_->rover.differentials[k];
    largest = std::max(largest, std::abs(mechanism_.joint_position(differential.joint_a) +
                                         position_sign_[k] * mechanism_.joint_position(differential.joint_b)));
  }
  return largest;
}

}  // namespace rille
