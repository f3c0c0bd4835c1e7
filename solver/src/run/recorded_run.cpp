#include "run/recorded_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/error.hpp"
#include "store/load.hpp"

namespace rille {
namespace {

constexpr double kCommit = 1;  // [s] of real time after which an endless run is readable

// Whole number of steps in a time; a time that is no multiple of the step is rounded to the nearest one.
long long steps_in(double time, double step) { return std::max(1LL, std::llround(time / step)); }

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// A state that a run goes on from.
struct Kept {
  std::int64_t run_id = 0;
  long long step = 0;
  double length = 0;  // [s] of its time step
  std::optional<double> duration;  // [s] that it was to take, if that is known
  std::string state;
};

Kept kept_in(SQLite::Statement& row) {
  Kept found;
  found.run_id = row.getColumn("id").getInt64();
  found.step = row.getColumn("step").getInt64();
  found.length = row.getColumn("length").getDouble();
  if (const SQLite::Column duration = row.getColumn("duration"); !duration.isNull()) found.duration = duration.getDouble();
  const SQLite::Column data = row.getColumn("data");
  found.state.assign(static_cast<const char*>(data.getBlob()), static_cast<std::size_t>(data.getBytes()));
  return found;
}

// The last run of the scenario that can go on.
Kept find_checkpoint(SQLite::Database& database, const Scenario& scenario, const std::string& digest) {
  SQLite::Statement row(database,
                        "SELECT run.id AS id, run.step AS length, duration, checkpoint.step AS step, model_hash, data FROM checkpoint JOIN run ON run.id = run_id "
                        "WHERE scenario_id = ? AND status IN ('interrupted', 'running') ORDER BY run.id DESC LIMIT 1");
  row.bind(1, scenario.id);
  if (!row.executeStep())
    throw InputRefused(fmt::format("scenario '{}' has no run that was interrupted; start one without --resume", scenario.name));
  if (row.getColumn("model_hash").getString() != digest)
    throw InputRefused(fmt::format("the model changed since run {} was interrupted; start the run again without --resume",
                                   row.getColumn("id").getInt64()));
  return kept_in(row);
}

Kept find_saved(SQLite::Database& database, const std::string& name, const std::string& world) {
  SQLite::Statement row(database, "SELECT run.id AS id, run.step AS length, duration, saved_state.step AS step, model_hash, data FROM saved_state "
                                  "JOIN run ON run.id = run_id WHERE name = ?");
  row.bind(1, name);
  if (!row.executeStep()) throw InputRefused(fmt::format("no state was saved as '{}'", name));
  const std::string digest = row.getColumn("model_hash").getString();
  if (!digest.empty() && digest != world)
    throw InputRefused(fmt::format("the model or its ground changed since state '{}' was saved; it can be loaded with those of that time only", name));
  return kept_in(row);
}

}  // namespace

RecordedRun::RecordedRun(const RunOptions& options)
    : database_(open_database(options.database)), endless_(options.endless), checkpoint_(options.checkpoint), last_checkpoint_(std::chrono::steady_clock::now()) {
  Model model = load_model(database_, options.scenario);
  digest_ = model_digest(database_, model.scenario.id);
  world_ = world_digest(database_, model.scenario.id);
  std::optional<Kept> kept;
  if (options.resume) kept = find_checkpoint(database_, model.scenario, digest_);
  if (options.from) kept = find_saved(database_, *options.from, world_);
  if (kept) {
    if (options.step && *options.step != kept->length)
      throw InputRefused(fmt::format("step is {:g} s, but the run that it goes on from used {:g} s; leave --step out", *options.step, kept->length));
    model.scenario.step = kept->length;
  } else if (options.step) {
    model.scenario.step = *options.step;
  }
  if (options.duration)
    model.scenario.duration = *options.duration;
  else if (options.resume && kept->duration)
    model.scenario.duration = *kept->duration;
  Scenario& scenario = model.scenario;
  require_step(scenario.step);
  if (!(scenario.duration > 0 && std::isfinite(scenario.duration)))
    throw InputRefused(fmt::format("duration is {:g} s; it must be above 0 and finite", scenario.duration));
  if (!options.endless && scenario.duration / scenario.step > 1e12)
    throw InputRefused(fmt::format("duration is {:g} s, more than 1e12 steps of {:g} s; shorten it", scenario.duration, scenario.step));
  scenario.output_interval = std::max(scenario.output_interval, scenario.step);
  duration_ = scenario.duration;
  n_steps_ = options.endless ? std::numeric_limits<long long>::max() : steps_in(scenario.duration, scenario.step);
  stride_ = steps_in(scenario.output_interval, scenario.step);
  if (options.resume && kept->step > n_steps_)
    throw InputRefused(fmt::format("duration is {:g} s, but run {} had reached {:g} s when it was interrupted; state a longer --duration",
                                   scenario.duration, kept->run_id, static_cast<double>(kept->step) * scenario.step));
  const std::optional<double> asked = options.endless ? std::nullopt : std::optional(scenario.duration);
  simulation_ = std::make_unique<Simulation>(std::move(model));
  if (!kept) {
    recorder_ = std::make_unique<Recorder>(database_, simulation_->model(), asked, "rille-solver " RILLE_VERSION);
    return;
  }
  fresh_ = false;
  simulation_->restore(kept->state);
  first_step_ = simulation_->steps();
  if (first_step_ != kept->step || kept->step < 0) throw InputRefused("the checkpoint is damaged; start the run again without --resume");
  if (options.resume) {
    recorder_ = std::make_unique<Recorder>(database_, simulation_->model(), asked, kept->run_id, simulation_->time(), first_step_ % stride_ == 0,
                                           simulation_->sensor_clocks());
    return;
  }
  simulation_->close_instant();
  recorder_ = std::make_unique<Recorder>(database_, simulation_->model(), asked, "rille-solver " RILLE_VERSION);
  recorder_->copy(kept->run_id, simulation_->time(), scenario.step, simulation_->sensor_clocks());
  recorder_->commit(Outcome::running, "");
}

void RecordedRun::hear() {
  const std::vector<Event>& now = simulation_->events();
  heard_.insert(heard_.end(), now.begin() + static_cast<std::ptrdiff_t>(heard_of_these_), now.end());
  heard_of_these_ = now.size();
}

std::vector<Event> RecordedRun::tell() {
  hear();
  return std::exchange(heard_, {});
}

void RecordedRun::record(bool with_snapshot) {
  if (with_snapshot) {
    if (endless_) recorder_->set_duration(simulation_->time());  // adding may commit
    recorder_->add(simulation_->snapshot());
  }
  recorder_->add(simulation_->take_events());
  heard_of_these_ = 0;
  recorder_->add(simulation_->take_samples());
}

void RecordedRun::keep_state() {
  if (std::exchange(steered_, false)) digest_ = model_digest(database_, simulation_->model().scenario.id);
  recorder_->add_checkpoint(simulation_->steps(), digest_, simulation_->save());
  last_checkpoint_ = std::chrono::steady_clock::now();
}

void RecordedRun::commit() {
  if (endless_) recorder_->set_duration(simulation_->time());  // whatever happens now, a run of the scenario repeats what is written
  recorder_->commit(Outcome::running, "");
}

Outcome RecordedRun::begin(const Asked& interrupted) {
  if (!std::exchange(fresh_, false)) return Outcome::running;
  const Outcome outcome = simulation_->settle([&] { return !interrupted(); });
  hear();
  record(true);
  commit();
  return outcome;
}

Outcome RecordedRun::advance(long long most, const Asked& interrupted, bool to_event) {
  for (long long k = 0; k < most; ++k) {
    if (simulation_->steps() >= n_steps_) return Outcome::done;
    if (interrupted()) return Outcome::interrupted;
    const bool due = (simulation_->steps() + 1) % stride_ == 0;
    const Outcome outcome = simulation_->step(due);
    const bool happened = simulation_->events().size() > heard_of_these_;
    if (happened) hear();
    if (outcome != Outcome::running) return outcome;
    if (due) {
      record(true);
      if (endless_ && seconds_since(last_checkpoint_) > kCommit) {
        commit();
        last_checkpoint_ = std::chrono::steady_clock::now();
      } else if (!endless_ && checkpoint_ > 0 && seconds_since(last_checkpoint_) > checkpoint_) {
        keep_state();
        commit();
      }
    }
    if (to_event && happened) break;
  }
  return simulation_->steps() >= n_steps_ ? Outcome::done : Outcome::running;
}

void RecordedRun::flush() {
  if (!ended_ && recorder_->is_open()) commit();
}

// What is steered is done after the database is ours to write: what was done and not kept could not be repeated.

void RecordedRun::command(int drive, double value) {
  recorder_->begin();
  if (const auto made = simulation_->command(drive, value)) {
    recorder_->add(*made);
    steered_ = true;
  }
}

void RecordedRun::change(StateChange change) {
  recorder_->begin();
  const StateChange made = simulation_->change(std::move(change));
  const auto& all = simulation_->model().scenario.changes;
  // What the scenario itself changes later keeps its place behind it.
  for (std::size_t number = all.size(); number-- > 0;)
    if (all[number].time >= made.time) recorder_->add(number + 1, all[number]);
  steered_ = true;
}

void RecordedRun::save(const std::string& name) {
  simulation_->close_instant();
  hear();
  record(false);  // what happened since the last output is not in the state
  recorder_->add_saved(name, simulation_->steps(), simulation_->time(), world_, simulation_->save());
  commit();
}

void RecordedRun::finish(Outcome outcome, const std::string& message) {
  if (std::exchange(ended_, true)) return;
  hear();
  message_ = message.empty() ? simulation_->message() : message;
  const bool interrupted = outcome == Outcome::interrupted && simulation_->outcome() == Outcome::running;
  if (interrupted && !endless_) {
    message_ = fmt::format("interrupted at t = {:.3f} s of {:g} s; the results so far are readable, and --resume goes on from here",
                           simulation_->time(), duration_);
    record(simulation_->steps() % stride_ != 0);
    keep_state();
  } else {
    if (interrupted)
      message_ = fmt::format("interrupted at t = {:.3f} s; the results so far are readable, and a run of the scenario repeats them", simulation_->time());
    record(outcome == Outcome::stopped && simulation_->steps() % stride_ != 0);
    recorder_->drop_checkpoint();
  }
  if (endless_) {  // so that a run of the scenario ends where this one did, by physics where this one did so
    const bool failed = simulation_->outcome() != Outcome::running;
    recorder_->set_duration(static_cast<double>(std::max(1LL, simulation_->steps() + (failed ? 1 : 0))) * simulation_->model().scenario.step);
  }
  if (simulation_->ruts() != nullptr) recorder_->add(*simulation_->ruts());
  recorder_->commit(outcome, message_);
}

}  // namespace rille
