// Writes states and events of a run into the database, a transaction per chunk, so that whatever was committed stays readable
// when the program ends early.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <cstdint>
#include <string>
#include <vector>

#include "model/model.hpp"
#include "model/result.hpp"

namespace rille {

class Recorder {
 public:
  // Opens a row in table `run` and commits it, with status running.
  Recorder(SQLite::Database& database, const Model& model, const std::string& solver);

  void add(const Snapshot& snapshot);
  void add(const std::vector<Event>& events);
  // Commits what is pending and the time reached; called by itself every `kChunk` snapshots.
  void commit(Outcome outcome, const std::string& message);

  std::int64_t run_id() const { return run_id_; }

 private:
  static constexpr int kChunk = 200;  // snapshots per transaction

  void begin();

  SQLite::Database& database_;
  const Model& model_;
  std::int64_t run_id_ = 0;
  double time_reached_ = 0;
  int pending_ = 0;
  bool open_ = false;
  SQLite::Statement body_;
  SQLite::Statement joint_;
  SQLite::Statement wheel_;
  SQLite::Statement event_;
};

}  // namespace rille
