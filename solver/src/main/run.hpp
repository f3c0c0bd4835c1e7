// `rille-solver run`: one scenario from a database, results into the same database.
#pragma once

#include "run/recorded_run.hpp"

namespace rille {

// Returns the exit code; interrupted() is asked before every step. progress: lines on stderr.
int run(const RunOptions& options, bool progress, bool (*interrupted)());

}  // namespace rille
