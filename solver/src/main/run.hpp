// `rille-solver run`: one scenario from a database, results into the same database.
#pragma once

#include <optional>
#include <string>

namespace rille {

struct RunOptions {
  std::string database;
  std::optional<std::string> scenario;
  std::optional<double> step;      // [s]
  std::optional<double> duration;  // [s]
  double checkpoint = 5;           // [s] of real time between checkpoints; 0: only when interrupted
  bool resume = false;
  bool progress = false;
};

// Returns the exit code; interrupted() is asked after every step.
int run(const RunOptions& options, bool (*interrupted)());

}  // namespace rille
