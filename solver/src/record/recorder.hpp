// Writes states and events of a run into the database, a transaction per chunk, so that whatever was committed stays readable
// when the program ends early.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "model/model.hpp"
#include "model/result.hpp"
#include "world/ruts.hpp"

namespace rille {

// Something that was asked of a run, and what became of it.
struct LogLine {
  std::string received;  // UTC, ISO 8601
  std::string sender;
  std::optional<std::int64_t> sequence;
  std::string request;   // JSON
  std::string refused;   // empty: it was done
};

class Recorder {
 public:
  // Opens a row in table `run` and commits it, with status running, of a run that is to take `duration` [s], or until it is ended.
  // resume: the run that goes on instead; what it holds beyond `time` [s] (and at `time`, unless keep_time) was written after its
  // checkpoint and is removed. clocks: [s] of each sensor at that time, by which its samples are stamped.
  Recorder(SQLite::Database& database, const Model& model, std::optional<double> duration, const std::string& solver);
  Recorder(SQLite::Database& database, const Model& model, std::optional<double> duration, std::int64_t resume, double time, bool keep_time,
           const std::vector<double>& clocks);

  void add(const Snapshot& snapshot);
  void add(const std::vector<Event>& events);
  void add(const std::vector<SensorSample>& samples);
  void add(const Ruts& ruts);
  // What was steered, into the scenario; the same drive and time, or number, in place of what was there.
  void add(const Command& command);
  void add(std::size_t number, const StateChange& change);
  // A line of table `command_log`: request and why it was refused, as of a time [s].
  void add(double time, const LogLine& line);
  void set_duration(double duration);  // [s] of the scenario
  // Keeps a state under a name, in place of what had it.
  void add_saved(const std::string& name, long long step, double time, const std::string& world_digest, const std::string& state);
  // What another run had recorded until `time` [s], its sensors by their clocks until `clocks` [s], as if this one had.
  void copy(std::int64_t run, double time, double step, const std::vector<double>& clocks);
  // State of the solver after so many steps, in place of the run's last one.
  void add_checkpoint(long long step, const std::string& model_digest, const std::string& state);
  void drop_checkpoint();
  // Opens a transaction unless one is open: from now on nobody else can write.
  void begin();
  bool is_open() const { return open_; }
  // Commits what is pending and the time reached; called by itself every `kChunk` snapshots.
  void commit(Outcome outcome, const std::string& message);

  std::int64_t run_id() const { return run_id_; }

 private:
  static constexpr int kChunk = 200;  // snapshots per transaction

  Recorder(SQLite::Database& database, const Model& model);

  SQLite::Database& database_;
  const Model& model_;
  std::int64_t run_id_ = 0;
  double time_reached_ = 0;
  int pending_ = 0;
  std::int64_t logged_ = 0;  // lines of the log
  bool open_ = false;
  SQLite::Statement body_;
  SQLite::Statement joint_;
  SQLite::Statement wheel_;
  SQLite::Statement event_;
  SQLite::Statement reaction_;
  SQLite::Statement energy_;
  SQLite::Statement sample_;
};

}  // namespace rille
