// A scenario of a database that is simulated step by step, its results written into the same database: by `rille-solver run` from beginning
// to end, by a steered session as far as it is told.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "record/recorder.hpp"
#include "simulate/simulation.hpp"

namespace rille {

struct RunOptions {
  std::string database;
  std::optional<std::string> scenario;
  std::optional<double> step;      // [s]
  std::optional<double> duration;  // [s]
  std::optional<std::string> from; // name of a saved state to go on from, instead of the beginning
  double checkpoint = 5;           // [s] of real time between checkpoints; 0: only when interrupted
  bool resume = false;
  bool endless = false;            // goes on until it is ended, whatever the duration
};

class RecordedRun {
 public:
  using Asked = std::function<bool()>;  // asked between steps; true: interrupted

  // Raises InputRefused.
  explicit RecordedRun(const RunOptions& options);

  // Comes to rest and records t = 0; a run that is resumed or goes on from a saved state has done that.
  Outcome begin(const Asked& interrupted);
  // At most so many steps, recorded when they are due. to_event: stops where something happened. Returns running, done (the end of the
  // scenario is reached), interrupted, or the outcome of physics.
  Outcome advance(long long most, const Asked& interrupted, bool to_event = false);
  // Writes what remains, ruts and outcome, and the checkpoint of a run that was interrupted. Nothing follows.
  void finish(Outcome outcome, const std::string& message = "");

  // What is steered is recorded with the run.
  void command(int drive, double value);
  void change(StateChange change);
  void log(const LogLine& line) { recorder_->add(simulation_->time(), line); }
  void save(const std::string& name);
  // Writes what is not written yet, so that others can write into the database, too, while nothing goes on.
  void flush();
  // Events that were not told yet.
  std::vector<Event> tell();

  Simulation& simulation() { return *simulation_; }
  const Simulation& simulation() const { return *simulation_; }
  std::int64_t id() const { return recorder_->run_id(); }
  const std::string& message() const { return message_; }
  double duration() const { return duration_; }                       // [s]
  long long steps_taken() const { return simulation_->steps() - first_step_; }  // by this object
  bool ended() const { return ended_; }

 private:
  void record(bool with_snapshot);
  void keep_state();
  void commit();
  void hear();  // of events, before they are written

  SQLite::Database database_;
  std::unique_ptr<Simulation> simulation_;
  std::unique_ptr<Recorder> recorder_;
  std::string digest_;  // of the model, scenario included
  std::string world_;   // of rover, effects and ground
  bool endless_ = false;
  bool steered_ = false;  // since the digest
  bool fresh_ = true;
  bool ended_ = false;
  double checkpoint_ = 5;  // [s]
  double duration_ = 0;    // [s]
  long long n_steps_ = 0, stride_ = 1, first_step_ = 0;
  std::chrono::steady_clock::time_point last_checkpoint_;
  std::vector<Event> heard_;
  std::size_t heard_of_these_ = 0;  // of the simulation's present events
  std::string message_;
};

}  // namespace rille
