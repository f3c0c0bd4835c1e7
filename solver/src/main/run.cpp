#include "main/run.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "main/exit_code.hpp"
#include "model/error.hpp"
#include "record/recorder.hpp"
#include "simulate/simulation.hpp"
#include "store/load.hpp"

namespace rille {
namespace {

// Whole number of steps in a time; a time that is no multiple of the step is rounded to the nearest one.
long long steps_in(double time, double step) { return std::max(1LL, std::llround(time / step)); }

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// The last run of the scenario that can go on.
struct Checkpoint {
  std::int64_t run_id = 0;
  long long step = 0;
  double length = 0;  // [s] of its time step
  std::string state;
};

Checkpoint find_checkpoint(SQLite::Database& database, const Scenario& scenario, const std::string& digest) {
  SQLite::Statement row(database,
                        "SELECT run.id AS id, run.step AS length, checkpoint.step AS step, model_hash, data FROM checkpoint JOIN run ON run.id = run_id "
                        "WHERE scenario_id = ? AND status IN ('interrupted', 'running') ORDER BY run.id DESC LIMIT 1");
  row.bind(1, scenario.id);
  if (!row.executeStep())
    throw InputRefused(fmt::format("scenario '{}' has no run that was interrupted; start one without --resume", scenario.name));
  if (row.getColumn("model_hash").getString() != digest)
    throw InputRefused(fmt::format("the model changed since run {} was interrupted; start the run again without --resume",
                                   row.getColumn("id").getInt64()));
  Checkpoint found;
  found.run_id = row.getColumn("id").getInt64();
  found.step = row.getColumn("step").getInt64();
  found.length = row.getColumn("length").getDouble();
  const SQLite::Column data = row.getColumn("data");
  found.state.assign(static_cast<const char*>(data.getBlob()), static_cast<std::size_t>(data.getBytes()));
  return found;
}

}  // namespace

int run(const RunOptions& options, bool (*interrupted)()) {
  require_double_precision();
  SQLite::Database database = open_database(options.database);
  Model model = load_model(database, options.scenario);
  const std::string digest = model_digest(database);
  std::optional<Checkpoint> checkpoint;
  if (options.resume) {
    checkpoint = find_checkpoint(database, model.scenario, digest);
    if (options.step && *options.step != checkpoint->length)
      throw InputRefused(fmt::format("step is {:g} s, but the run that was interrupted used {:g} s; leave --step out", *options.step, checkpoint->length));
    model.scenario.step = checkpoint->length;
  } else if (options.step) {
    model.scenario.step = *options.step;
  }
  if (options.duration) model.scenario.duration = *options.duration;
  Scenario& scenario = model.scenario;
  require_step(scenario.step);
  if (!(scenario.duration > 0 && std::isfinite(scenario.duration)))
    throw InputRefused(fmt::format("duration is {:g} s; it must be above 0", scenario.duration));
  if (scenario.duration / scenario.step > 1e12)
    throw InputRefused(fmt::format("duration is {:g} s, more than 1e12 steps of {:g} s; shorten it", scenario.duration, scenario.step));
  scenario.output_interval = std::max(scenario.output_interval, scenario.step);
  const double step = scenario.step, duration = scenario.duration, output_interval = scenario.output_interval;

  Simulation simulation(std::move(model));
  const long long n_steps = steps_in(duration, step);
  const long long stride = steps_in(output_interval, step);
  if (checkpoint) {
    simulation.restore(checkpoint->state);
    if (simulation.steps() != checkpoint->step || checkpoint->step < 0)
      throw InputRefused("the checkpoint is damaged; start the run again without --resume");
  }
  const long long first_step = simulation.steps();
  Recorder recorder = checkpoint ? Recorder(database, simulation.model(), checkpoint->run_id, simulation.time(), first_step % stride == 0)
                                 : Recorder(database, simulation.model(), "rille-solver " RILLE_VERSION);
  const auto start = std::chrono::steady_clock::now();
  auto last_progress = start, last_checkpoint = start;
  const auto talk = [&](bool now) {
    if (!options.progress || (!now && seconds_since(last_progress) < 0.1)) return;
    last_progress = std::chrono::steady_clock::now();
    fmt::print(stderr, "progress {:.3f} {:g}\n", simulation.time(), duration);
    std::fflush(stderr);
  };
  const auto record = [&](bool with_snapshot) {
    if (with_snapshot) recorder.add(simulation.snapshot());
    recorder.add(simulation.take_events());
    recorder.add(simulation.take_samples());
  };
  const auto keep_state = [&] {
    recorder.add_checkpoint(simulation.steps(), digest, simulation.save());
    last_checkpoint = std::chrono::steady_clock::now();
  };

  talk(true);
  Outcome outcome = Outcome::running;
  if (!checkpoint) {
    outcome = simulation.settle([interrupted] { return !interrupted(); });
    record(true);
    recorder.commit(Outcome::running, "");
  }
  while (outcome == Outcome::running && simulation.steps() < n_steps) {
    if (interrupted()) {
      outcome = Outcome::interrupted;
      break;
    }
    const bool due = (simulation.steps() + 1) % stride == 0;
    outcome = simulation.step(due);
    if (!due || outcome != Outcome::running) continue;
    record(true);
    if (options.checkpoint > 0 && seconds_since(last_checkpoint) > options.checkpoint) {
      keep_state();
      recorder.commit(Outcome::running, "");
    }
    talk(false);
  }
  const double wall = seconds_since(start);
  std::string message = simulation.message();
  if (outcome == Outcome::running) outcome = Outcome::done;
  if (outcome == Outcome::interrupted && simulation.outcome() == Outcome::running) {
    message = fmt::format("interrupted at t = {:.3f} s of {:g} s; the results so far are readable, and --resume goes on from here",
                          simulation.time(), duration);
    record(simulation.steps() % stride != 0);
    keep_state();
  } else {
    record(outcome == Outcome::stopped && simulation.steps() % stride != 0);
    recorder.drop_checkpoint();
  }
  if (simulation.ruts() != nullptr) recorder.add(*simulation.ruts());
  recorder.commit(outcome, message);
  talk(true);

  const nlohmann::json summary = {{"run_id", recorder.run_id()},
                                  {"scenario", simulation.model().scenario.name},
                                  {"status", word(outcome)},
                                  {"time_reached", simulation.time()},
                                  {"steps", simulation.steps()},
                                  {"wall_s", wall},
                                  {"real_time_factor", static_cast<double>(simulation.steps() - first_step) * step / wall},
                                  {"message", message}};
  fmt::print("{}\n", summary.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  if (outcome == Outcome::done) return kDone;
  fmt::print(stderr, "{}\n", message);
  if (outcome == Outcome::stopped) return kDone;
  return outcome == Outcome::interrupted ? kInterrupted : kPhysics;
}

}  // namespace rille
