#include "simulate/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "effects/registry.hpp"
#include "model/error.hpp"
#include "model/track_width.hpp"
#include "simulate/elsewhere.hpp"
#include "simulate/placement.hpp"

namespace rille {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kLimitReturnSpeed = 1.0;  // [rad/s or m/s] largest speed at which a violated limit is restored
constexpr double kSaturationTime = 0.5;    // [s] a drive at its limit for so long is worth an event; starting up is not
constexpr double kSameInstant = 1e-6;       // [steps] commands that are nearer to the beginning of a step belong to it
constexpr double kRestSpeed = 1e-4;        // [m/s, rad/s] slower than this everywhere ...
constexpr double kRestTime = 0.1;          // [s] ... for so long counts as settled: where a bounce turns, all is slow for a moment
constexpr double kLargestSpeed = 1e6;      // [m/s, rad/s] beyond this a state counts as diverged
constexpr double kStartOverlap = 5e-3;     // [m] deeper inside a rock nothing may start
constexpr double kStuckLook = 0.01;        // [s] between looks for tip-over and the like

std::size_t at(int index) { return static_cast<std::size_t>(index); }

}  // namespace

Model& Simulation::prepared(Model& model, Effects& effects) {
  spread_wheels(model.rover);
  effects = attach_effects(model);
  return model;
}

Simulation::Simulation(Model model)
    : model_(std::make_unique<Model>(std::move(model))),
      effects_(std::make_unique<Effects>()),
      mechanism_(prepared(*model_, *effects_).rover, model_->scenario.gravity) {
  const Rover& rover = model_->rover;
  check_couplings();
  for (std::size_t j = 0; j < rover.joints.size(); ++j) {
    if (!rover.joints[j].limit) continue;
    limits_.push_back({.joint = static_cast<int>(j), .at_upper = false});
    limits_.push_back({.joint = static_cast<int>(j), .at_upper = true});
  }
  drive_of_joint_.assign(rover.joints.size(), -1);
  for (const Drive& drive : rover.drives) {
    drive_of_joint_[at(drive.joint)] = static_cast<int>(drives_.size());
    drives_.emplace_back(drive, mechanism_.dof_of(drive.joint), effects_->joints[at(drive.joint)]);
  }
  effort_.setZero(mechanism_.dofs());
  reactions_.resize(rover.joints.size());
  rigid_ = std::make_unique<RigidContacts>(*model_, mechanism_);
  sensors_ = std::make_unique<Sensors>(*model_, effects_->sensors);
  watcher_ = std::make_unique<Watcher>(*model_);
  watching_ = !sensors_->empty() || !watcher_->empty();
  for (const StateChange& change : model_->scenario.changes) require_change(rover, mechanism_.held_by_world(), change);
  place();
  if (model_->terrain && !rover.wheels.empty()) {
    double narrowest = rover.wheels[0].width;
    for (std::size_t w = 0; w < rover.wheels.size(); ++w) {
      narrowest = std::min(narrowest, rover.wheels[w].width);
      contacts_.emplace_back(rover, *model_->terrain, static_cast<int>(w), effects_->wheels[w]);
    }
    ruts_ = std::make_unique<Ruts>(*model_->terrain->grid, narrowest);
  }
  // A position drive that was not commanded yet holds where it stands.
  for (DriveUnit& drive : drives_) drive.start(mechanism_.joint_position(drive.drive().joint), mechanism_.joint_velocity(drive.drive().joint));
  read_commands(0);
  mechanism_.update_kinematics();
  for (std::size_t b = 0; b < rover.bodies.size(); ++b)
    for (auto& effect : effects_->bodies[b]) effect->start(motion_of(b));
  start_accounts();
  rigid_->find(mechanism_, model_->scenario.step);
  if (const auto [overlap, sentence] = rigid_->deepest_overlap(); overlap < -kStartOverlap)
    throw InputRefused(sentence + "; move the scenario's start or the obstacle");
  // Contacts are read once, so that a snapshot at t = 0 shows the wheels where they are.
  rows_.clear();
  for (WheelContact& contact : contacts_) contact.open_rows(mechanism_, 0, model_->scenario.step, rows_, *rigid_, nullptr);
}

void Simulation::check_couplings() {
  const Rover& rover = model_->rover;
  for (const Differential& differential : rover.differentials) {
    const Joint& a = rover.joints[at(differential.joint_a)];
    const Joint& b = rover.joints[at(differential.joint_b)];
    for (const Joint* joint : {&a, &b})
      if (joint->kind != JointKind::hinge || joint->parent != differential.carrier)
        throw InputRefused(fmt::format("differential '{}' needs joint '{}' to be a hinge on its carrier; correct joint or carrier",
                                       differential.name, joint->name));
    const double cosine = a.axis.dot(b.axis);
    if (std::abs(cosine) < 0.999)
      throw InputRefused(fmt::format("differential '{}' needs parallel hinges, but '{}' and '{}' stand at {:.2f} deg; correct an axis",
                                     differential.name, a.name, b.name, std::acos(cosine) * 180 / M_PI));
  }
}

void Simulation::place() {
  const Scenario& scenario = model_->scenario;
  start_joints(mechanism_, model_->rover, scenario);
  if (scenario.placement == Placement::on_terrain) {
    mechanism_.set_root(pose_on_terrain(*model_, mechanism_));
    return;
  }
  mechanism_.set_root(BodyState{.position = scenario.start_position,
                                .rotation = scenario.start_rotation,
                                .velocity = scenario.start_velocity,
                                .angular_velocity = scenario.start_angular_velocity});
}

void Simulation::read_commands(double h) {
  const auto& commands = model_->scenario.commands;
  const double rounding = kSameInstant * model_->scenario.step;  // a command at k h acts from step k on, whatever the rounding of k h
  for (DriveUnit& drive : drives_) drive.begin_step();
  for (; next_command_ < commands.size(); ++next_command_) {
    const Command& command = commands[next_command_];
    const double since = command.time - time();
    if (since > h - rounding && since > rounding) break;
    drives_[at(command.drive)].set(command.value, since > rounding ? 1 - since / h : 1);
  }
}

std::optional<Command> Simulation::command(int drive, double value) {
  if (!std::isfinite(value)) throw InputRefused(fmt::format("the set value of drive '{}' is not finite", drives_[at(drive)].drive().name));
  // At t = 0 the drives were read before the mechanism settled; what comes after that acts from the first step's end on.
  const long long step = std::max({steps_, first_free_step_, 1LL});
  const Command made{drive, static_cast<double>(step) * model_->scenario.step, value};
  Command late = made;
  late.time += effects_->command_delay[at(drive)];
  auto& commands = model_->scenario.commands;
  const auto first = commands.begin() + static_cast<std::ptrdiff_t>(next_command_);
  const auto of_drive = [&](const Command& c) { return c.drive == drive; };
  if (drives_[at(drive)].is_set_to(value) && std::none_of(first, commands.end(), of_drive)) return std::nullopt;
  const auto same = std::find_if(first, commands.end(), [&](const Command& c) { return of_drive(c) && c.time == late.time; });
  if (same != commands.end())
    same->value = value;
  else
    commands.insert(std::upper_bound(first, commands.end(), late.time, [](double time, const Command& c) { return time < c.time; }), late);
  return made;
}

std::vector<double> Simulation::set_values() const {
  std::vector<double> values;
  for (const DriveUnit& drive : drives_) values.push_back(drive.command());
  const auto& commands = model_->scenario.commands;
  const double soon = static_cast<double>(std::max({steps_, first_free_step_, 1LL})) * model_->scenario.step;
  for (std::size_t k = next_command_; k < commands.size() && commands[k].time <= soon; ++k) values[at(commands[k].drive)] = commands[k].value;
  return values;
}

StateChange Simulation::change(StateChange change) {
  require_change(model_->rover, mechanism_.held_by_world(), change);
  const long long step = std::max(steps_, first_free_step_);
  change.time = static_cast<double>(step) * model_->scenario.step;
  auto& changes = model_->scenario.changes;
  if (next_change_ < changes.size() && changes[next_change_].time <= change.time)
    throw InputRefused(fmt::format("the scenario itself changes the state at {:g} s; go beyond that first", changes[next_change_].time));
  changes.insert(changes.begin() + static_cast<std::ptrdiff_t>(next_change_), change);
  try {
    make_changes();
  } catch (const InputRefused&) {  // nothing has happened
    changes.erase(changes.begin() + static_cast<std::ptrdiff_t>(next_change_));
    throw;
  }
  return change;
}

void Simulation::make_changes() {
  const auto& changes = model_->scenario.changes;
  const double now = time() + kSameInstant * model_->scenario.step;
  for (; next_change_ < changes.size() && changes[next_change_].time <= now; ++next_change_) {
    const MechanismState before = mechanism_.state();
    const auto back = [&] {
      mechanism_.set_state(before);
      mechanism_.update_kinematics();
    };
    try {
      put_elsewhere(mechanism_, model_->rover, changes[next_change_]);
    } catch (const InputRefused&) {  // half of it is done by then
      back();
      throw;
    }
    const MechanismState after = mechanism_.state();
    back();
    put(after);
  }
}

bool Simulation::open_drive_rows(double h) {
  bool any = false;
  for (DriveUnit& drive : drives_) any = drive.open_rows(mechanism_, h, holding_, rows_, effort_) || any;
  return any;
}

void Simulation::open_joint_effects(double h) {
  const auto& mass = mechanism_.mass_matrix();
  for (std::size_t j = 0; j < effects_->joints.size(); ++j) {
    if (effects_->joints[j].empty()) continue;
    const int joint = static_cast<int>(j);
    const int dof = mechanism_.dof_of(joint);
    JointMotion motion{.time = time_of_effects(), .step = h, .position = mechanism_.joint_position(joint),
                       .velocity = mechanism_.joint_velocity(joint)};
    if (drive_of_joint_[j] >= 0) motion.drive_effort = drives_[at(drive_of_joint_[j])].effort();
    JointFriction friction;
    const auto open = [&](double weight) -> Row& {
      const int row = rows_.open(RowKind::joint);
      rows_.add(dof, 1);
      rows_[row].weight = weight;
      return rows_[row];
    };
    for (const auto& effect : effects_->joints[j]) {
      effect->rub(motion, friction);
      const double effort = effect->effort(motion);
      double slope = 0;
      if (effect->depends_on_velocity()) {  // where it damps, its slope is taken implicitly
        constexpr double kNudge = 1e-6;
        JointMotion nudged = motion;
        nudged.velocity += kNudge;
        slope = (effect->effort(nudged) - effort) / kNudge;
      }
      if (slope < 0)
        open(-h * slope).target = motion.velocity - effort / slope;
      else
        effort_[dof] += effort;
    }
    if (friction.viscous > 0) open(h * friction.viscous);
    if (friction.dry > 0) {
      Row& row = open(kRigidity * mass(dof, dof));
      row.lower = -h * friction.dry;
      row.upper = h * friction.dry;
      const double wanted = -row.weight * motion.velocity;  // a first guess of the side: as the joint moves now
      if (wanted < row.lower) row.side = RowSide::at_lower;
      if (wanted > row.upper) row.side = RowSide::at_upper;
    }
  }
}

bool Simulation::open_limit_rows(double h) {
  const auto& mass = mechanism_.mass_matrix();
  bool any = false;
  for (LimitState& state : limits_) {
    const Limit& limit = *model_->rover.joints[at(state.joint)].limit;
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
    state.row = rows_.open(RowKind::joint);
    rows_.add(dof, state.at_upper ? -1 : 1);
    Row& row = rows_[state.row];
    if (limit.stiffness > 0) {  // F = k (depth at the end of the step) + c (speed of pressing), implicit
      const double slope = h * limit.stiffness + (gap < 0 ? limit.damping : 0);
      row.weight = h * slope;
      row.target = -limit.stiffness * gap / slope;
    } else {
      row.weight = kRigidity * mass(dof, dof);
      row.target = std::min(-gap / h, kLimitReturnSpeed);  // arrives at the limit, not beyond
    }
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
    const int row = rows_.open(RowKind::coupling);
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
  for (const Differential& differential : rover.differentials)
    couple(differential.joint_a, 1, differential.joint_b, position_sign(rover, differential));
  for (const Gear& gear : rover.gears) couple(gear.joint_a, -gear.ratio, gear.joint_b, 1);
}

// Stiff rather than hard rows: closures of flat loops repeat what the hinges say already, and hard rows that repeat have no solution.
void Simulation::open_closure_rows(double h) {
  for (const LoopClosure& closure : model_->rover.loop_closures) {
    const auto [a, b] = ends_of(mechanism_, closure);
    double mass = model_->rover.bodies[at(closure.body_a)].mass;
    if (closure.body_b >= 0) mass = std::min(mass, model_->rover.bodies[at(closure.body_b)].mass);
    for (int axis = 0; axis < 3; ++axis) {
      const int row = rows_.open(RowKind::coupling);
      mechanism_.add_relative_jacobian(closure.body_a, closure.body_b, a, b, Vector3d::Unit(axis), rows_);
      rows_[row].weight = kRigidity * mass;
      rows_[row].target = -0.2 * (a - b)[axis] / h;
    }
  }
}

BodyMotion Simulation::motion_of(std::size_t body) const {
  const int b = static_cast<int>(body);
  return {.time = time_of_effects(), .mass = model_->rover.bodies[body].mass, .gravity = model_->scenario.gravity, .com = mechanism_.com(b),
          .velocity = mechanism_.com_velocity(b), .angular_velocity = mechanism_.angular_velocity(b)};
}

void Simulation::open_body_effects(double h) {
  for (std::size_t b = 0; b < effects_->bodies.size(); ++b) {
    if (effects_->bodies[b].empty()) continue;
    const BodyMotion motion = motion_of(b);
    forces_.clear();
    for (const auto& effect : effects_->bodies[b]) effect->push(motion, h, forces_);
    for (const BodyForce& force : forces_) {
      const int row = rows_.open(RowKind::external);
      const Vector3d none = Vector3d::Zero();
      mechanism_.add_jacobian(static_cast<int>(b), motion.com, force.angular ? none : force.direction, force.angular ? force.direction : none, rows_);
      rows_[row].weight = std::max(force.weight, 1e-30);
      rows_[row].target = force.target;
      rows_[row].lower = force.lower;
      rows_[row].upper = force.upper;
    }
  }
}

std::string Simulation::when() const {
  return holding_ ? fmt::format("{:.3f} s into settling", time()) : fmt::format("at t = {:.3f} s", time());
}

Outcome Simulation::fail(Outcome outcome, std::string message) {
  outcome_ = outcome;
  message_ = std::move(message);
  events_.push_back({event_time(), word(outcome), "", message_});
  return outcome_;
}

void Simulation::note(const char* kind, const std::string& subject, std::string message) {
  events_.push_back({event_time(), kind, subject, std::move(message)});
}

bool Simulation::solve_rows(const VectorXd& v_free) {
  do {
    if (!solver_.solve(mechanism_.mass_matrix(), v_free, rows_, velocity_)) return false;
  } while (rigid_->tighten(rows_, solver_.impulse(), velocity_));
  return true;
}

bool Simulation::sticks() const {
  for (int i = 0; i < rows_.size(); ++i)
    if (rows_[i].kind == RowKind::joint && rows_[i].side == RowSide::free && rows_[i].upper > rows_[i].lower && std::isfinite(rows_[i].upper)) return true;
  return false;
}

// Runge-Kutta under the forces of the rows, which are constant over the step: those of the semi-implicit step. Where they vanish it is the free
// motion. Forces on the root come as impulses after the free motion, half of them on the way (Strang 1968). Impulses that hold a joint at rest
// are left to the semi-implicit step, where rest is exact.
bool Simulation::split_step(double h) {
  if (!solve_rows(mechanism_.free_velocity(h, effort_))) return false;
  if (sticks()) {
    mechanism_.set_velocity(velocity_);
    mechanism_.advance_position(h);
    return true;
  }
  force_ = effort_;
  for (int i = 0; i < rows_.size(); ++i) rows_.add_scaled(rows_[i], solver_.impulse()[i] / h, force_);
  if (mechanism_.held_by_world() || force_.head<6>().isZero(0)) {
    mechanism_.advance_rk4(h, force_);
    return true;
  }
  mechanism_.advance_rk4(h, effort_);
  const VectorXd free = mechanism_.velocity();
  if (!solve_rows(free)) return false;
  mechanism_.set_velocity(0.5 * (velocity_ - free));
  mechanism_.advance_position(h);
  mechanism_.set_velocity(velocity_);
  return true;
}

bool Simulation::semi_implicit_step(double h) {
  if (!solve_rows(mechanism_.free_velocity(h, effort_))) return false;
  mechanism_.set_velocity(velocity_);
  mechanism_.advance_position(h);
  return true;
}

Outcome Simulation::advance(bool hold, bool report) {
  const Scenario& scenario = model_->scenario;
  const Rover& rover = model_->rover;
  const double h = scenario.step;
  holding_ = hold;
  mechanism_.update_kinematics();
  mechanism_.update_mass_matrix();
  rows_.clear();
  effort_.setZero();
  const bool driven = open_drive_rows(h);
  open_joint_effects(h);
  const bool limited = open_limit_rows(h);
  open_coupling_rows(h);
  open_closure_rows(h);
  open_body_effects(h);
  rigid_->find(mechanism_, h);
  bool on_soil = false;
  for (std::size_t w = 0; w < contacts_.size(); ++w) {
    const ContactStatus status = contacts_[w].open_rows(mechanism_, time_of_effects(), h, rows_, *rigid_, ruts_.get());
    const WheelState& state = contacts_[w].state();
    if (status == ContactStatus::off_terrain)
      return fail(Outcome::left_terrain,
                  fmt::format("{} wheel '{}' left terrain '{}' or reached a missing height at x = {:.2f} m, y = {:.2f} m; use a larger "
                              "terrain or a shorter drive",
                              when(), rover.wheels[w].name, model_->terrain->name, state.center.x(), state.center.y()));
    if (status == ContactStatus::buried) {
      const bool began_so = steps_ == 0 && scenario.placement == Placement::as_given;
      return fail(Outcome::wheel_buried,
                  fmt::format("{} wheel '{}' {} at x = {:.2f} m, y = {:.2f} m; {}", when(), rover.wheels[w].name,
                              began_so ? "stands deeper than its axle" : "sank past its axle", state.center.x(), state.center.y(),
                              began_so ? fmt::format("the start puts it there: raise z of the start of scenario '{}', or leave it out", scenario.name)
                                       : fmt::format("the soil is too soft for its load, or the step of {:g} s too large", h)));
    }
    on_soil = on_soil || status == ContactStatus::on_soil;
  }
  const bool touching = rigid_->open_rows(mechanism_, h, rows_);

  const bool coupled = !rover.differentials.empty() || !rover.gears.empty() || !rover.loop_closures.empty();
  const bool only_effects = !driven && !limited && !coupled && !on_soil && !touching;  // rows that come and go with effects
  const bool free_of_rows = only_effects && rows_.size() == 0;
  const VectorXd before = mechanism_.velocity();
  if (free_of_rows && scenario.integrator != Integrator::semi_implicit_euler) {
    mechanism_.advance_rk4(h, effort_);
  } else if (!(only_effects && scenario.integrator != Integrator::semi_implicit_euler ? split_step(h) : semi_implicit_step(h))) {
    return fail(Outcome::diverged,
                fmt::format("{} the constraint rows found no solution; try a smaller step than {:g} s", when(), h));
  }
  const VectorXd& after = mechanism_.velocity();
  if (report && after.allFinite()) reactions_ = mechanism_.reactions(before, (after - before) / h, rows_, solver_.impulse(), h);
  for (std::size_t b = 0; b < effects_->bodies.size(); ++b) {
    if (effects_->bodies[b].empty()) continue;
    BodyMotion motion = motion_of(b);  // kinematics are those of the beginning; the velocity of the centre of mass is not
    motion.velocity = mechanism_.com_velocity_with(static_cast<int>(b), after);
    for (auto& effect : effects_->bodies[b]) effect->advance(motion, h);
  }
  ++steps_;
  account(h, before, after);

  const double fastest = after.cwiseAbs().maxCoeff();
  if (!(fastest < kLargestSpeed) || !after.allFinite()) {
    Eigen::Index worst = 0;
    for (Eigen::Index i = 0; i < after.size(); ++i)
      if (!std::isfinite(after[i]) || std::abs(after[i]) > std::abs(after[worst])) worst = i;
    std::string where = "the root body";
    for (std::size_t j = 0; j < rover.joints.size(); ++j)
      if (mechanism_.dof_of(static_cast<int>(j)) == worst) where = "joint '" + rover.joints[j].name + "'";
    return fail(Outcome::diverged, fmt::format("{} the speed of {} grew to {:g}; try a smaller step than {:g} s",
                                               when(), where, after[worst], h));
  }
  if (!hold) look(h);
  return outcome_;
}

double Simulation::energy() {
  mechanism_.update_kinematics();
  mechanism_.update_mass_matrix();
  return mechanism_.kinetic_energy() + mechanism_.potential_energy();
}

void Simulation::start_accounts() {
  work_ = {};
  for (DriveUnit& drive : drives_) drive.clear_work();
  mechanism_.update_kinematics();
  mechanism_.update_mass_matrix();
  potential_at_start_ = mechanism_.potential_energy();
  energy_at_start_ = mechanism_.kinetic_energy();
}

void Simulation::account(double h, const VectorXd& before, const VectorXd& after) {
  const Rover& rover = model_->rover;
  const auto& impulse = solver_.impulse();
  const double now = event_time();
  if (!holding_) {
    // Exact for an impulse: the kinetic energy changes by the impulse times the mean of the speeds before and after.
    for (int i = 0; i < rows_.size(); ++i)
      work_.of_kind[static_cast<std::size_t>(rows_[i].kind)] += impulse[i] * 0.5 * (rows_.dot(rows_[i], before) + rows_.dot(rows_[i], after));
    work_.given += 0.5 * h * effort_.dot(before + after);
  }
  for (std::size_t w = 0; w < contacts_.size(); ++w) contacts_[w].close_rows(rows_, impulse, h);
  std::vector<Event> unwanted;
  rigid_->close_rows(impulse, h, now, holding_ ? unwanted : events_);
  for (std::size_t w = 0; w < contacts_.size(); ++w) contacts_[w].add_rigid(rigid_->wheel_force(static_cast<int>(w)));
  for (DriveUnit& drive : drives_) {
    const int dof = mechanism_.dof_of(drive.drive().joint);
    const double saturated_for = drive.saturated_for();
    drive.close_rows(rows_, impulse, h, before[dof], after[dof], !holding_);
    if (saturated_for < kSaturationTime && drive.saturated_for() >= kSaturationTime)
      note("drive_saturated", drive.drive().name,
           fmt::format("{} drive '{}' had been at its largest effort of {:g} for {:g} s", when(), drive.drive().name,
                       drive.drive().max_torque, kSaturationTime));
  }
  for (LimitState& state : limits_) {
    if (state.row < 0) continue;
    state.side = rows_[state.row].side;
    const bool touching = state.side == RowSide::free;
    const Joint& joint = rover.joints[at(state.joint)];
    if (touching && !state.touching)
      note("limit_reached", joint.name,
           fmt::format("joint '{}' reached its {} limit of {:g} {}", joint.name, state.at_upper ? "upper" : "lower",
                       state.at_upper ? joint.limit->upper : joint.limit->lower, when()));
    state.touching = touching;
  }
}

void Simulation::look(double h) {
  const auto stride = std::max(1LL, std::llround(kStuckLook / h));
  const bool due = steps_ % stride == 0;
  if (!watching_ && !due) return;
  with_readable([&](const Readable& from) {
    sensors_->sense(time(), from);
    const bool every_step = !watcher_->empty();
    if (!every_step && !due) return;
    for (const Watch* watch : watcher_->look(time(), every_step ? h : h * static_cast<double>(stride), from, events_)) {
      if (watch->action == WatchAction::command) drives_[at(watch->drive)].set(watch->value);
      if (watch->action == WatchAction::stop && outcome_ == Outcome::running)
        fail(Outcome::stopped, events_.back().message + ", and stops the run");
    }
  });
}

Outcome Simulation::settle(const std::function<bool()>& keep_going) {
  const double h = model_->scenario.step;
  const auto most = static_cast<long long>(std::llround(model_->scenario.settle_time / h));
  const auto rest_steps = std::min(most, static_cast<long long>(std::ceil(kRestTime / h)));
  long long taken = 0, slow = 0;
  bool at_rest = false;
  while (taken < most && outcome_ == Outcome::running && !at_rest) {
    if (keep_going && !keep_going())
      return fail(Outcome::interrupted, fmt::format("interrupted after {:.3f} s of settling, before t = 0", static_cast<double>(taken) * h));
    advance(true, false);
    ++taken;
    slow = mechanism_.velocity().cwiseAbs().maxCoeff() < kRestSpeed ? slow + 1 : 0;
    at_rest = slow >= rest_steps;
  }
  steps_ = 0;
  holding_ = false;
  rigid_->forget_touches();
  if (ruts_) {  // the drop from where it was placed left no rut; the next step marks where each wheel stands
    ruts_->clear();
    for (WheelContact& contact : contacts_) contact.forget_mark();
  }
  if (most > 0 && outcome_ == Outcome::running)
    note(at_rest ? "settled" : "not_settled", "",
         at_rest ? fmt::format("came to rest within {:.3f} s before t = 0", static_cast<double>(taken) * h)
                 : fmt::format("still moves at {:.2g} m/s or rad/s after {:g} s; a longer settle_time may help",
                               mechanism_.velocity().cwiseAbs().maxCoeff(), model_->scenario.settle_time));
  start_accounts();
  if (!sensors_->empty() && outcome_ == Outcome::running) with_readable([&](const Readable& from) { sensors_->sense(0, from); });
  return outcome_;
}

Outcome Simulation::step(bool report) {
  if (outcome_ != Outcome::running) return outcome_;
  make_changes();
  read_commands(model_->scenario.step);
  return advance(false, report);
}

std::vector<JointState> Simulation::joint_states() const {
  const Rover& rover = model_->rover;
  std::vector<JointState> joints(rover.joints.size());
  for (std::size_t j = 0; j < rover.joints.size(); ++j) {
    if (!rover.joints[j].has_one_freedom()) continue;
    joints[j].position = mechanism_.joint_position(static_cast<int>(j));
    joints[j].velocity = mechanism_.joint_velocity(static_cast<int>(j));
  }
  for (const DriveUnit& drive : drives_) {
    JointState& joint = joints[at(drive.drive().joint)];
    joint.effort = drive.effort();
    joint.work = drive.work();
  }
  return joints;
}

std::vector<WheelState> Simulation::wheel_states() const {
  std::vector<WheelState> wheels;
  for (const WheelContact& contact : contacts_) wheels.push_back(contact.state());
  return wheels;
}

Snapshot Simulation::snapshot() const {
  const Rover& rover = model_->rover;
  Snapshot snapshot;
  snapshot.time = time();
  mechanism_.update_kinematics();
  mechanism_.update_mass_matrix();
  for (std::size_t b = 0; b < rover.bodies.size(); ++b) snapshot.bodies.push_back(mechanism_.body_state(static_cast<int>(b)));
  snapshot.joints = joint_states();
  snapshot.wheels = wheel_states();
  snapshot.reactions = reactions_;
  const auto work = [&](RowKind kind) { return work_.of_kind[static_cast<std::size_t>(kind)]; };
  EnergyState& energy = snapshot.energy;
  energy.kinetic = mechanism_.kinetic_energy();
  energy.potential = mechanism_.potential_energy() - potential_at_start_;
  for (const DriveUnit& drive : drives_) energy.drive_work += drive.work();
  energy.soil_loss = -work(RowKind::soil);
  energy.contact_loss = -work(RowKind::contact);
  energy.external_work = work(RowKind::external);
  // Everything else that acts in joints: friction, limits, couplings, and efforts of effects, which are in `given` with those of drives.
  energy.joint_loss = energy.drive_work - (work(RowKind::drive) + work_.given) - work(RowKind::joint) - work(RowKind::coupling);
  energy.residual = energy.kinetic + energy.potential - energy_at_start_ -
                    (energy.drive_work + energy.external_work - energy.soil_loss - energy.joint_loss - energy.contact_loss);
  return snapshot;
}

std::vector<Event> Simulation::take_events() {
  watcher_->forget_events();
  return std::exchange(events_, {});
}

void Simulation::visit(Archive& archive) {
  MechanismState state = mechanism_.state();
  archive(state);
  if (archive.reading()) mechanism_.set_state(state);
  archive(steps_, next_command_, next_change_, work_, energy_at_start_, potential_at_start_, *rigid_, *sensors_, *watcher_);
  for (DriveUnit& drive : drives_) archive(drive);
  for (LimitState& limit : limits_) archive(limit);
  for (WheelContact& contact : contacts_) archive(contact);
  for (auto& effects : effects_->bodies)
    for (auto& effect : effects) effect->visit(archive);
  if (ruts_) archive(*ruts_);
}

std::string Simulation::save() {
  Archive archive;
  visit(archive);
  return archive.bytes();
}

void Simulation::restore(const std::string& bytes) {
  load(bytes);
  next_command_ = std::min(next_command_, model_->scenario.commands.size());
  next_change_ = std::min(next_change_, model_->scenario.changes.size());
  first_free_step_ = 0;
  outcome_ = Outcome::running;
  message_.clear();
  events_.clear();
  holding_ = false;
}

void Simulation::restore_or_stay(const std::string& bytes) {
  const std::string before = save();
  try {
    restore(bytes);
  } catch (const InputRefused&) {
    load(before);
    throw;
  }
}

void Simulation::load(const std::string& bytes) {
  Archive archive(bytes);
  visit(archive);
  archive.finish();
  const MechanismState state = mechanism_.state();
  const bool whole = state.velocity.allFinite() && state.joint_position.allFinite() && state.base_position.allFinite() &&
                     std::abs(state.base_rotation.norm() - 1) < 1e-6 && steps_ >= 0 && steps_ < 1'000'000'000'000'000;
  if (!whole) throw InputRefused("the checkpoint holds values that no state has; start the run again without --resume");
  mechanism_.update_kinematics();
}

void Simulation::start_at(double time, const MechanismState& motion) {
  mechanism_.set_state(motion);
  mechanism_.update_kinematics();
  steps_ = std::llround(time / model_->scenario.step);
  next_command_ = 0;
  const auto& changes = model_->scenario.changes;
  next_change_ = static_cast<std::size_t>(std::count_if(changes.begin(), changes.end(), [&](const StateChange& c) { return c.time < time; }));
  for (DriveUnit& drive : drives_) drive.start(mechanism_.joint_position(drive.drive().joint), mechanism_.joint_velocity(drive.drive().joint));
  read_commands(0);
  for (std::size_t b = 0; b < effects_->bodies.size(); ++b)
    for (auto& effect : effects_->bodies[b]) effect->start(motion_of(b));
  for (WheelContact& contact : contacts_) contact.assume_steady();
  start_accounts();
  outcome_ = Outcome::running;
  message_.clear();
  events_.clear();
  holding_ = false;
}

void Simulation::put(const MechanismState& motion) {
  const double had = energy();
  std::vector<double> position(drives_.size()), velocity(drives_.size());
  for (std::size_t d = 0; d < drives_.size(); ++d) {
    position[d] = mechanism_.joint_position(drives_[d].drive().joint);
    velocity[d] = mechanism_.joint_velocity(drives_[d].drive().joint);
  }
  std::vector<Vector3d> speed(effects_->bodies.size(), Vector3d::Zero());
  for (std::size_t b = 0; b < speed.size(); ++b)
    if (!effects_->bodies[b].empty()) speed[b] = motion_of(b).velocity;
  mechanism_.set_state(motion);
  mechanism_.update_kinematics();
  for (std::size_t d = 0; d < drives_.size(); ++d) {
    const int joint = drives_[d].drive().joint;
    drives_[d].carry(mechanism_.joint_position(joint) - position[d], mechanism_.joint_velocity(joint) - velocity[d]);
  }
  for (std::size_t b = 0; b < speed.size(); ++b) {
    if (effects_->bodies[b].empty()) continue;
    const Vector3d change = motion_of(b).velocity - speed[b];
    for (auto& effect : effects_->bodies[b]) effect->carry(change);
  }
  // Those before the present step have been given, whatever list they came from.
  const auto& commands = model_->scenario.commands;
  const double given = time() - kSameInstant * model_->scenario.step;
  next_command_ = static_cast<std::size_t>(
      std::upper_bound(commands.begin(), commands.end(), given, [](double now, const Command& command) { return now < command.time; }) -
      commands.begin());
  energy_at_start_ += energy() - had;  // given or taken by whoever moved it: neither work nor loss
}

std::vector<double> Simulation::read(Quantity& quantity) const {
  return with_readable([&](const Readable& from) { return quantity.read(from); });
}

void Simulation::read(std::vector<std::pair<Quantity, int>>& quantities, double* values) const {
  with_readable([&](const Readable& from) {
    for (std::size_t k = 0; k < quantities.size(); ++k) {
      const std::vector<double> all = quantities[k].first.read(from);
      if (values != nullptr) values[k] = all[at(quantities[k].second)];
    }
    return 0;
  });
}

Eigen::VectorXd Simulation::inverse_dynamics(const VectorXd& acceleration) {
  if (acceleration.size() != mechanism_.dofs())
    throw InputRefused(fmt::format("the accelerations have {} numbers; the model has {} degrees of freedom", acceleration.size(), mechanism_.dofs()));
  const double h = model_->scenario.step;
  mechanism_.update_kinematics();
  mechanism_.update_mass_matrix();
  // M a + bias - contact forces, with the bias from the free motion: v_free = v + h M^-1 (-bias).
  effort_.setZero();
  const VectorXd drift = (mechanism_.free_velocity(h, effort_) - mechanism_.velocity()) / h;
  VectorXd result = mechanism_.mass_matrix().selfadjointView<Eigen::Lower>() * (acceleration - drift);
  for (int i = 0; i < rows_.size() && i < solver_.impulse().size(); ++i)
    if (rows_[i].kind == RowKind::soil || rows_[i].kind == RowKind::contact) rows_.add_scaled(rows_[i], -solver_.impulse()[i] / h, result);
  return result;
}

double Simulation::largest_differential_error() const {
  double largest = 0;
  for (const Differential& differential : model_->rover.differentials)
    largest = std::max(largest, std::abs(mechanism_.joint_position(differential.joint_a) +
                                         position_sign(model_->rover, differential) * mechanism_.joint_position(differential.joint_b)));
  return largest;
}

double Simulation::largest_closure_error() const {
  mechanism_.update_kinematics();
  double largest = 0;
  for (const LoopClosure& closure : model_->rover.loop_closures) {
    const auto [a, b] = ends_of(mechanism_, closure);
    largest = std::max(largest, (a - b).norm());
  }
  return largest;
}

}  // namespace rille
