// Command line of the solver. Data on stdout, talk on stderr.
// Exit codes: 0 done, 1 our bug, 2 usage, 3 input refused, 4 physics did not converge, 130 interrupted.

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>

#include "effects/registry.hpp"
#include "main/bench.hpp"
#include "main/exit_code.hpp"
#include "main/run.hpp"
#include "model/error.hpp"
#include "store/contract.hpp"

namespace {

std::atomic<bool> interrupted_flag = false;
bool interrupted() { return interrupted_flag; }

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGINT, [](int) { interrupted_flag = true; });
  std::signal(SIGTERM, [](int) { interrupted_flag = true; });
  CLI::App app{"rille-solver: simulates the model in a database of rille and writes the results into it"};
  app.require_subcommand(1);
  rille::RunOptions run;
  CLI::App* run_command = app.add_subcommand("run", "simulate a scenario; example: rille-solver run rover.db --scenario traverse");
  run_command->add_option("database", run.database, "database with model and scenario")->required();
  run_command->add_option("--scenario", run.scenario, "name of the scenario; default: the only one");
  run_command->add_option("--step", run.step, "time step [s]; default: the scenario's");
  run_command->add_option("--duration", run.duration, "simulated time [s]; default: the scenario's");
  run_command->add_option("--checkpoint", run.checkpoint, "real time between checkpoints [s]; 0: only when interrupted; default 5")
      ->check(CLI::NonNegativeNumber);
  run_command->add_flag("--resume", run.resume, "go on with the scenario's run that was interrupted, bit by bit as if it had not been");
  bool progress = false;
  run_command->add_flag("--progress", progress, "print lines `progress TIME DURATION` on stderr");
  rille::BenchOptions bench;
  CLI::App* bench_command = app.add_subcommand(
      "bench", "single-wheel bench, CSV on stdout; example: rille-solver bench rover.db --load 30 --load 50 --slip 0 --slip 0.2");
  bench_command->add_option("database", bench.database, "database with wheel and soils")->required();
  bench_command->add_option("--wheel", bench.wheel, "name of the wheel; default: the first");
  bench_command->add_option("--soil", bench.soils, "name of a soil, repeatable; default: all");
  bench_command->add_option("--law", bench.laws, "bekker, bekker_wong or reece, repeatable; default: bekker_wong");
  bench_command->add_option("--load", bench.loads, "vertical load [N], repeatable")->required();
  bench_command->add_option("--slip", bench.slips, "slip ratio, repeatable; default: 0, 0.1 ... 0.8");
  bench_command->add_option("--slip-angle", bench.slip_angle, "slip angle [rad]; default 0");
  bench_command->add_option("--gravity", bench.gravity, "gravity for the soils' weight [m/s^2]; default 9.80665");
  bench_command->add_option("--speed", bench.speed, "speed of the carriage [m/s]; default 0.05");
  bench_command->add_flag("--dynamic", bench.dynamic, "simulate the rig instead of solving the integrals");
  bench_command->add_option("--save", bench.save, "keep the points in table bench_point under this name");
  CLI::App* effects_command = app.add_subcommand("effects", "print the names of the effects that this solver has");
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
    if (*effects_command) {
      for (const std::string& name : rille::known_effects()) fmt::print("{}\n", name);
      return kDone;
    }
    return *bench_command ? rille::bench(bench, interrupted) : rille::run(run, progress, interrupted);
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
