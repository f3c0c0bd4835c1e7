#include "main/run.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "main/exit_code.hpp"
#include "model/error.hpp"

namespace rille {
namespace {

constexpr long long kBetweenLooks = 64;  // steps between looks at the clock

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

int run(const RunOptions& options, bool progress, bool (*interrupted)()) {
  require_double_precision();
  RecordedRun run(options);
  const Simulation& simulation = run.simulation();
  const auto start = std::chrono::steady_clock::now();
  auto last_progress = start;
  const auto talk = [&](bool now) {
    if (!progress || (!now && seconds_since(last_progress) < 0.1)) return;
    last_progress = std::chrono::steady_clock::now();
    fmt::print(stderr, "progress {:.3f} {:g}\n", simulation.time(), run.duration());
    std::fflush(stderr);
  };

  talk(true);
  Outcome outcome = Outcome::running;
  try {
    outcome = run.begin(interrupted);
    while (outcome == Outcome::running) {
      outcome = run.advance(kBetweenLooks, interrupted);
      talk(false);
    }
  } catch (const InputRefused& refusal) {  // a change of state that cannot be made as things stand then
    run.finish(Outcome::stopped, refusal.what());
    throw;
  }
  const double wall = seconds_since(start);
  run.finish(outcome);
  talk(true);

  const nlohmann::json summary = {{"run_id", run.id()},
                                  {"scenario", simulation.model().scenario.name},
                                  {"status", word(outcome)},
                                  {"time_reached", simulation.time()},
                                  {"steps", simulation.steps()},
                                  {"wall_s", wall},
                                  {"real_time_factor", static_cast<double>(run.steps_taken()) * simulation.model().scenario.step / wall},
                                  {"message", run.message()}};
  fmt::print("{}\n", summary.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  if (outcome == Outcome::done) return kDone;
  fmt::print(stderr, "{}\n", run.message());
  if (outcome == Outcome::stopped) return kDone;
  return outcome == Outcome::interrupted ? kInterrupted : kPhysics;
}

}  // namespace rille
