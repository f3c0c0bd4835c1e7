// Command line of the solver. Data on stdout (one JSON object), talk on stderr.
// Exit codes: 0 done, 1 our bug, 2 usage, 3 input refused, 4 physics did not converge, 130 interrupted.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <nlohmann/json.hpp>

#include "model/error.hpp"
#include "record/recorder.hpp"
#include "simulate/simulation.hpp"
#include "store/contract.hpp"
#include "store/load.hpp"

namespace {

std::atomic<bool> interrupted = false;

enum ExitCode { kDone = 0, kBug = 1, kUsage = 2, kRefused = 3, kPhysics = 4, kInterrupted = 130 };

struct RunOptions {
  std::string database;
  std::optional<std::string> scenario;
  std::optional<double> step;
  std::optional<double> duration;
  bool progress = false;
};

// Whole number of steps in a time; a time that is no multiple of the step is rounded to the nearest one.
long long steps_in(double time, double step) { return std::max(1LL, std::llround(time / step)); }

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

int run(const RunOptions& options) {
  using namespace rille;
  require_double_precision();
  SQLite::Database database = open_database(options.database);
  Model model = load_model(database, options.scenario);
  if (options.step) model.scenario.step = *options.step;
  if (options.duration) model.scenario.duration = *options.duration;
  Scenario& scenario = model.scenario;
  if (!(scenario.step > 0 && scenario.step <= 0.1))
    throw InputRefused(fmt::format("step is {:g} s; it must be above 0 and at most 0.1 s", scenario.step));
  if (!(scenario.duration > 0 && std::isfinite(scenario.duration)))
    throw InputRefused(fmt::format("duration is {:g} s; it must be above 0", scenario.duration));
  scenario.output_interval = std::max(scenario.output_interval, scenario.step);

  Simulation simulation(std::move(model));
  const Scenario& experiment = simulation.model().scenario;
  Recorder recorder(database, simulation.model(), "rille-solver " RILLE_VERSION);
  const auto start = std::chrono::steady_clock::now();
  auto last_progress = start;
  const auto talk = [&](bool now) {
    if (!options.progress || (!now && seconds_since(last_progress) < 0.1)) return;
    last_progress = std::chrono::steady_clock::now();
    fmt::print(stderr, "progress {:.3f} {:g}\n", simulation.time(), experiment.duration);
    std::fflush(stderr);
  };

  talk(true);
  Outcome outcome = simulation.settle();
  recorder.add(simulation.snapshot());
  recorder.add(simulation.take_events());
  recorder.commit(Outcome::running, "");
  const long long n_steps = steps_in(experiment.duration, experiment.step);
  const long long stride = steps_in(experiment.output_interval, experiment.step);
  while (outcome == Outcome::running && simulation.steps() < n_steps) {
    if (interrupted) {
      outcome = Outcome::interrupted;
      break;
    }
    outcome = simulation.step();
    if (outcome == Outcome::running && simulation.steps() % stride == 0) {
      recorder.add(simulation.snapshot());
      recorder.add(simulation.take_events());
      talk(false);
    }
  }
  const double wall = seconds_since(start);
  std::string message = simulation.message();
  if (outcome == Outcome::running) outcome = Outcome::done;
  if (outcome == Outcome::interrupted) {
    if (simulation.steps() % stride != 0) recorder.add(simulation.snapshot());
    message = fmt::format("interrupted at t = {:.3f} s of {:g} s; the results so far are readable", simulation.time(),
                          experiment.duration);
  }
  recorder.add(simulation.take_events());
  recorder.commit(outcome, message);
  talk(true);

  const nlohmann::json summary = {{"run_id", recorder.run_id()},
                                  {"scenario", experiment.name},
                                  {"status", word(outcome)},
                                  {"time_reached", simulation.time()},
                                  {"steps", simulation.steps()},
                                  {"wall_s", wall},
                                  {"real_time_factor", simulation.time() / wall},
                                  {"message", message}};
  fmt::print("{}\n", summary.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  if (outcome == Outcome::done) return kDone;
  fmt::print(stderr, "{}\n", message);
  return outcome == Outcome::interrupted ? kInterrupted : kPhysics;
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGINT, [](int) { interrupted = true; });
  std::signal(SIGTERM, [](int) { interrupted = true; });
  CLI::App app{"rille-solver: simulates the model in a database of rille and writes the results into it"};
  app.require_subcommand(1);
  RunOptions options;
  CLI::App* run_command = app.add_subcommand("run", "simulate a scenario; example: rille-solver run rover.db --scenario traverse");
  run_command->add_option("database", options.database, "database with model and scenario")->required();
  run_command->add_option("--scenario", options.scenario, "name of the scenario; default: the only one");
  run_command->add_option("--step", options.step, "time step [s]; default: the scenario's");
  run_command->add_option("--duration", options.duration, "simulated time [s]; default: the scenario's");
  run_command->add_flag("--progress", options.progress, "print lines `progress TIME DURATION` on stderr");
  CLI::App* version_command = app.add_subcommand("version", "print version and schema version");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  try {
    if (*version_command) {
      fmt::print("rille-solver {} (schema {})\n", RILLE_VERSION, rille::contract::kSchemaVersion);
      return kDone;
    }
    return run(options);
  } catch (const rille::InputRefused& error) {
    fmt::print(stderr, "{}\n", error.what());
    return kRefused;
  } catch (const SQLite::Exception& error) {
    fmt::print(stderr, "the database could not be written: {}; what was committed is readable\n", error.what());
    return kRefused;
  } catch (const std::exception& error) {
    fmt::print(stderr, "unexpected: {}; this is a bug of rille-solver\n", error.what());
    return kBug;
  }
}
