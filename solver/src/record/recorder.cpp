#include "record/recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <utility>

namespace rille {
namespace {

void insert(SQLite::Statement& statement, std::int64_t run, double time, std::int64_t key, std::initializer_list<double> values) {
  statement.reset();
  statement.bind(1, run);
  statement.bind(2, time);
  statement.bind(3, key);
  int column = 4;
  for (const double value : values) statement.bind(column++, value);
  statement.exec();
}

void bind(SQLite::Statement& statement, int column, std::optional<double> value) {
  if (value)
    statement.bind(column, *value);
  else
    statement.bind(column);  // NULL
}

}  // namespace

Recorder::Recorder(SQLite::Database& database, const Model& model)
    : database_(database),
      model_(model),
      body_(database, "INSERT INTO body_state VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"),
      joint_(database, "INSERT INTO joint_state VALUES (?, ?, ?, ?, ?, ?, ?)"),
      wheel_(database, "INSERT INTO wheel_state VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"),
      event_(database, "INSERT INTO event (run_id, time, kind, subject, message) VALUES (?, ?, ?, ?, ?)"),
      reaction_(database, "INSERT INTO joint_reaction VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)"),
      energy_(database, "INSERT INTO energy_state VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"),
      sample_(database, "INSERT OR REPLACE INTO sensor_sample VALUES (?, ?, ?, ?, ?)") {}

Recorder::Recorder(SQLite::Database& database, const Model& model, std::optional<double> duration, const std::string& solver)
    : Recorder(database, model) {
  SQLite::Statement run(database, "INSERT INTO run (scenario_id, solver, step, duration, status) VALUES (?, ?, ?, ?, 'running')");
  run.bind(1, model.scenario.id);
  run.bind(2, solver);
  run.bind(3, model.scenario.step);
  bind(run, 4, duration);
  run.exec();
  run_id_ = database.getLastInsertRowid();
}

Recorder::Recorder(SQLite::Database& database, const Model& model, std::optional<double> duration, std::int64_t resume, double time, bool keep_time,
                   const std::vector<double>& clocks)
    : Recorder(database, model) {
  run_id_ = resume;
  SQLite::Statement logged(database, "SELECT coalesce(max(number), 0) FROM command_log WHERE run_id = ?");
  logged.bind(1, resume);
  logged.executeStep();
  logged_ = logged.getColumn(0).getInt64();
  const double last = keep_time ? time + 0.25 * model.scenario.step : time - 0.25 * model.scenario.step;
  SQLite::Transaction transaction(database);
  for (const char* table : {"body_state", "joint_state", "wheel_state", "joint_reaction", "energy_state"}) {
    SQLite::Statement remove(database, std::string("DELETE FROM ") + table + " WHERE run_id = ? AND time > ?");
    remove.bind(1, resume);
    remove.bind(2, last);
    remove.exec();
  }
  // Events and samples of the very moment of the checkpoint were written before it.
  SQLite::Statement events(database, "DELETE FROM event WHERE run_id = ? AND time > ?");
  events.bind(1, resume);
  events.bind(2, time + 0.25 * model.scenario.step);
  events.exec();
  SQLite::Statement samples(database, "DELETE FROM sensor_sample WHERE run_id = ? AND sensor_id = ? AND time > ?");
  for (std::size_t s = 0; s < clocks.size(); ++s) {
    samples.reset();
    samples.bind(1, resume);
    samples.bind(2, model.rover.sensors[s].id);
    samples.bind(3, clocks[s] + 0.25 * model.scenario.step);
    samples.exec();
  }
  SQLite::Statement outcome(database, "DELETE FROM event WHERE run_id = ? AND kind = 'interrupted'");
  outcome.bind(1, resume);
  outcome.exec();
  SQLite::Statement run(database, "UPDATE run SET status = 'running', message = '', duration = ? WHERE id = ?");
  bind(run, 1, duration);
  run.bind(2, resume);
  run.exec();
  transaction.commit();
  time_reached_ = time;
}

void Recorder::begin() {
  if (open_) return;
  database_.exec("BEGIN IMMEDIATE");
  open_ = true;
}

void Recorder::add(const Snapshot& snapshot) {
  begin();
  const Rover& rover = model_.rover;
  for (std::size_t b = 0; b < snapshot.bodies.size(); ++b) {
    const BodyState& s = snapshot.bodies[b];
    insert(body_, run_id_, snapshot.time, rover.bodies[b].id,
           {s.position.x(), s.position.y(), s.position.z(), s.rotation.w(), s.rotation.x(), s.rotation.y(), s.rotation.z(),
            s.velocity.x(), s.velocity.y(), s.velocity.z(), s.angular_velocity.x(), s.angular_velocity.y(),
            s.angular_velocity.z()});
  }
  for (std::size_t j = 0; j < snapshot.joints.size(); ++j) {
    if (!rover.joints[j].has_one_freedom()) continue;
    const JointState& s = snapshot.joints[j];
    insert(joint_, run_id_, snapshot.time, rover.joints[j].id, {s.position, s.velocity, s.effort, s.work});
  }
  for (std::size_t w = 0; w < snapshot.wheels.size(); ++w) {
    const WheelState& s = snapshot.wheels[w];
    insert(wheel_, run_id_, snapshot.time, rover.wheels[w].id,
           {s.center.x(), s.center.y(), s.center.z(), s.ground_height, s.slip_ratio, s.slip_angle, s.sinkage, s.normal_load,
            s.drawbar_pull, s.side_force, s.drive_torque});
  }
  for (std::size_t j = 0; j < snapshot.reactions.size(); ++j) {
    const JointReaction& r = snapshot.reactions[j];
    insert(reaction_, run_id_, snapshot.time, rover.joints[j].id, {r.force.x(), r.force.y(), r.force.z(), r.torque.x(), r.torque.y(), r.torque.z()});
  }
  const EnergyState& e = snapshot.energy;
  energy_.reset();
  energy_.bind(1, run_id_);
  int column = 2;
  for (const double value : {snapshot.time, e.kinetic, e.potential, e.drive_work, e.soil_loss, e.joint_loss, e.contact_loss, e.external_work, e.residual})
    energy_.bind(column++, value);
  energy_.exec();
  time_reached_ = snapshot.time;
  if (++pending_ >= kChunk) commit(Outcome::running, "");
}

void Recorder::add(const std::vector<Event>& events) {
  if (events.empty()) return;
  begin();
  for (const Event& event : events) {
    event_.reset();
    event_.bind(1, run_id_);
    event_.bind(2, event.time);
    event_.bind(3, event.kind);
    event_.bind(4, event.subject);
    event_.bind(5, event.message);
    event_.exec();
  }
}

void Recorder::add(const std::vector<SensorSample>& samples) {
  if (samples.empty()) return;
  begin();
  for (const SensorSample& sample : samples) {
    sample_.reset();
    sample_.bind(1, run_id_);
    sample_.bind(2, model_.rover.sensors[static_cast<std::size_t>(sample.sensor)].id);
    sample_.bind(3, sample.time);
    sample_.bind(4, sample.component);
    sample_.bind(5, sample.value);
    sample_.exec();
  }
}

void Recorder::add(const Ruts& ruts) {
  begin();
  SQLite::Statement tile(database_, "INSERT OR REPLACE INTO rut_tile VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  for (const auto& [key, values] : ruts.tiles())
    for (const auto& [layer, data] : {std::pair{"sinkage", &values.sinkage}, std::pair{"pressure", &values.pressure}}) {
      tile.reset();
      tile.bind(1, run_id_);
      tile.bind(2, layer);
      tile.bind(3, key.first * Ruts::kTile);
      tile.bind(4, key.second * Ruts::kTile);
      tile.bind(5, Ruts::kTile);
      tile.bind(6, Ruts::kTile);
      tile.bind(7, ruts.posting());
      tile.bind(8, ruts.x_west());
      tile.bind(9, ruts.y_north());
      tile.bind(10, data->data(), static_cast<int>(sizeof(float) * data->size()));
      tile.exec();
    }
}

void Recorder::add(const Command& command) {
  begin();
  SQLite::Statement row(database_, "INSERT OR REPLACE INTO command VALUES (?, ?, ?, ?)");
  row.bind(1, model_.scenario.id);
  row.bind(2, model_.rover.drives[static_cast<std::size_t>(command.drive)].id);
  row.bind(3, command.time);
  row.bind(4, command.value);
  row.exec();
}

void Recorder::add(std::size_t number, const StateChange& change) {
  begin();
  SQLite::Statement before(database_, "DELETE FROM state_change WHERE scenario_id = ? AND number = ?");  // it may have more components
  before.bind(1, model_.scenario.id);
  before.bind(2, static_cast<std::int64_t>(number));
  before.exec();
  SQLite::Statement row(database_, "INSERT INTO state_change (scenario_id, number, component, time, quantity, target, value) "
                                   "VALUES (?, ?, ?, ?, ?, ?, ?)");
  for (std::size_t k = 0; k < change.values.size(); ++k) {
    row.reset();
    row.bind(1, model_.scenario.id);
    row.bind(2, static_cast<std::int64_t>(number));
    row.bind(3, static_cast<std::int64_t>(k));
    row.bind(4, change.time);
    row.bind(5, change.quantity);
    row.bind(6, change.target);
    row.bind(7, change.values[k]);
    row.exec();
  }
}

void Recorder::add(double time, const LogLine& line) {
  begin();
  SQLite::Statement row(database_, "INSERT INTO command_log VALUES (?, ?, ?, ?, ?, ?, ?, ?)");
  row.bind(1, run_id_);
  row.bind(2, ++logged_);
  row.bind(3, time);
  row.bind(4, line.received);
  row.bind(5, line.sender);
  if (line.sequence) row.bind(6, *line.sequence);
  row.bind(7, line.request);
  row.bind(8, line.refused);
  row.exec();
}

void Recorder::set_duration(double duration) {
  begin();
  SQLite::Statement row(database_, "UPDATE scenario SET duration = ? WHERE id = ?");
  row.bind(1, std::max(duration, model_.scenario.step));
  row.bind(2, model_.scenario.id);
  row.exec();
}

void Recorder::add_saved(const std::string& name, long long step, double time, const std::string& world_digest, const std::string& state) {
  begin();
  SQLite::Statement row(database_, "INSERT OR REPLACE INTO saved_state (name, run_id, step, time, data, model_hash) VALUES (?, ?, ?, ?, ?, ?)");
  row.bind(1, name);
  row.bind(2, run_id_);
  row.bind(3, static_cast<std::int64_t>(step));
  row.bind(4, time);
  row.bind(5, state.data(), static_cast<int>(state.size()));
  row.bind(6, world_digest);
  row.exec();
}

void Recorder::copy(std::int64_t run, double time, double step, const std::vector<double>& clocks) {
  begin();
  const std::pair<const char*, const char*> tables[] = {
      {"body_state", "time, body_id, x, y, z, qw, qx, qy, qz, vx, vy, vz, wx, wy, wz"},
      {"joint_state", "time, joint_id, position, velocity, effort, work"},
      {"wheel_state", "time, wheel_id, x, y, z, ground_height, slip_ratio, slip_angle, sinkage, normal_load, drawbar_pull, side_force, drive_torque"},
      {"joint_reaction", "time, joint_id, fx, fy, fz, tx, ty, tz"},
      {"energy_state", "time, kinetic, potential, drive_work, soil_loss, joint_loss, contact_loss, external_work, residual"},
      {"event", "time, kind, subject, message"}};
  for (const auto& [table, columns] : tables) {
    SQLite::Statement rows(database_, fmt::format("INSERT INTO {0} (run_id, {1}) SELECT ?, {1} FROM {0} WHERE run_id = ? AND time <= ?{2}", table,
                                                  columns, std::string(table) == "event" ? " AND kind <> 'stopped' ORDER BY id" : ""));
    rows.bind(1, run_id_);
    rows.bind(2, run);
    rows.bind(3, time + 0.25 * step);
    rows.exec();
  }
  SQLite::Statement samples(database_, "INSERT INTO sensor_sample (run_id, sensor_id, time, component, value) SELECT ?, sensor_id, time, component, "
                                       "value FROM sensor_sample WHERE run_id = ? AND sensor_id = ? AND time <= ?");
  for (std::size_t s = 0; s < clocks.size(); ++s) {
    samples.reset();
    samples.bind(1, run_id_);
    samples.bind(2, run);
    samples.bind(3, model_.rover.sensors[s].id);
    samples.bind(4, clocks[s] + 0.25 * step);
    samples.exec();
  }
  time_reached_ = time;
}

void Recorder::add_checkpoint(long long step, const std::string& model_digest, const std::string& state) {
  begin();
  SQLite::Statement row(database_, "INSERT OR REPLACE INTO checkpoint VALUES (?, ?, ?, ?)");
  row.bind(1, run_id_);
  row.bind(2, static_cast<std::int64_t>(step));
  row.bind(3, model_digest);
  row.bind(4, state.data(), static_cast<int>(state.size()));
  row.exec();
}

void Recorder::drop_checkpoint() {
  begin();
  SQLite::Statement row(database_, "DELETE FROM checkpoint WHERE run_id = ?");
  row.bind(1, run_id_);
  row.exec();
}

void Recorder::commit(Outcome outcome, const std::string& message) {
  begin();
  SQLite::Statement run(database_, "UPDATE run SET status = ?, time_reached = ?, message = ? WHERE id = ?");
  run.bind(1, word(outcome));
  run.bind(2, time_reached_);
  run.bind(3, message);
  run.bind(4, run_id_);
  run.exec();
  database_.exec("COMMIT");
  open_ = false;
  pending_ = 0;
}

}  // namespace rille
