#include "record/recorder.hpp"

#include <initializer_list>

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

}  // namespace

Recorder::Recorder(SQLite::Database& database, const Model& model, const std::string& solver)
    : database_(database),
      model_(model),
      body_(database, "INSERT INTO body_state VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"),
      joint_(database, "INSERT INTO joint_state VALUES (?, ?, ?, ?, ?, ?, ?)"),
      wheel_(database, "INSERT INTO wheel_state VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"),
      event_(database, "INSERT INTO event (run_id, time, kind, subject, message) VALUES (?, ?, ?, ?, ?)") {
  SQLite::Statement run(database, "INSERT INTO run (scenario_id, solver, step, status) VALUES (?, ?, ?, 'running')");
  run.bind(1, model.scenario.id);
  run.bind(2, solver);
  run.bind(3, model.scenario.step);
  run.exec();
  run_id_ = database.getLastInsertRowid();
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
    if (rover.joints[j].kind != JointKind::hinge && rover.joints[j].kind != JointKind::prismatic) continue;
    const JointState& s = snapshot.joints[j];
    insert(joint_, run_id_, snapshot.time, rover.joints[j].id, {s.position, s.velocity, s.effort, s.work});
  }
  for (std::size_t w = 0; w < snapshot.wheels.size(); ++w) {
    const WheelState& s = snapshot.wheels[w];
    insert(wheel_, run_id_, snapshot.time, rover.wheels[w].id,
           {s.center.x(), s.center.y(), s.center.z(), s.ground_height, s.slip_ratio, s.slip_angle, s.sinkage, s.normal_load,
            s.drawbar_pull, s.side_force, s.drive_torque});
  }
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
