#include "simulate/windows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "effects/registry.hpp"
#include "model/error.hpp"
#include "simulate/parallel.hpp"

namespace rille {
namespace {

constexpr std::size_t kMostHiddenBytes = 256U << 20U;  // that states between windows may take at once
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Commands by drive, so that a short window need not carry those of hours.
class CommandLog {
 public:
  explicit CommandLog(const Model& model)
      : by_drive_(model.rover.drives.size()), slack_(0.5 * model.scenario.step), late_(longest_command_delay(model)) {
    for (const Command& command : model.scenario.commands) by_drive_[static_cast<std::size_t>(command.drive)].push_back(command);
  }

  // What acts from `start` to `stop` [s]: of each drive the last command before, and those in between.
  std::vector<Command> between(double start, double stop) const {
    std::vector<Command> found;
    const auto later = [](double time, const Command& command) { return time < command.time; };
    for (const auto& commands : by_drive_) {
      auto first = std::upper_bound(commands.begin(), commands.end(), start - late_ + slack_, later);
      // One more than the last before: where a delay moves a command past the start by rounding, the one before it still holds.
      for (int k = 0; k < 2 && first != commands.begin(); ++k) --first;
      found.insert(found.end(), first, std::upper_bound(first, commands.end(), stop + slack_, later));
    }
    std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.time < b.time; });
    return found;
  }

 private:
  std::vector<std::vector<Command>> by_drive_;
  double slack_;  // [s] a command acts in the step nearest to its time
  double late_;   // [s] that a command may reach its drive after its time
};

// Models without commands, and what each window is given of them.
struct Prepared {
  std::vector<CommandLog> logs;
  std::vector<Model> bare;

  explicit Prepared(const std::vector<Model*>& models) {
    for (const Model* model : models) {
      logs.emplace_back(*model);
      bare.push_back(*model);
      bare.back().scenario.commands.clear();
    }
  }
  Model between(std::size_t number, double start, double stop) const {
    Model model = bare[number];
    model.scenario.commands = logs[number].between(start, stop);
    return model;
  }
};

// Puts a simulation that was never stepped, or stands in an earlier window, into a window: at rest, or with what is not motion as the bytes say.
void put_into_window(Simulation& simulation, const std::string& hidden, const double* row, std::size_t size) {
  const MechanismState motion = motion_from_row(simulation, row, size);
  if (hidden.empty()) {
    simulation.start_at(row[0], motion);
  } else {
    simulation.restore(hidden);
    simulation.put(motion);
  }
}

}  // namespace

ChannelReaders channel_readers(const Rover& rover, const ChannelNames& channels) {
  ChannelReaders made;
  for (const auto& [quantity, target, component] : channels) {
    made.emplace_back(Quantity(rover, quantity, target, false, "channel '" + quantity + "'"), component);
    if (component < 0 || component >= made.back().first.size())
      throw InputRefused(fmt::format("channel {} of '{}' has no component {}", quantity, target, component));
  }
  return made;
}

std::vector<double> motion_row(Simulation& simulation) {
  const MechanismState m = simulation.motion();
  std::vector<double> row = {simulation.time(), m.base_position.x(), m.base_position.y(), m.base_position.z(),
                             m.base_rotation.x(), m.base_rotation.y(), m.base_rotation.z(), m.base_rotation.w()};
  row.insert(row.end(), m.joint_position.data(), m.joint_position.data() + m.joint_position.size());
  row.insert(row.end(), m.velocity.data(), m.velocity.data() + m.velocity.size());
  return row;
}

MechanismState motion_from_row(Simulation& simulation, const double* row, std::size_t size) {
  MechanismState m = simulation.motion();
  const auto n_q = static_cast<std::size_t>(m.joint_position.size()), n_v = static_cast<std::size_t>(m.velocity.size());
  if (size != 8 + n_q + n_v) throw InputRefused(fmt::format("a motion has {} numbers; this model needs {}", size, 8 + n_q + n_v));
  for (std::size_t k = 0; k < size; ++k)
    if (!std::isfinite(row[k])) throw InputRefused(fmt::format("number {} of a motion is not finite", k));
  m.base_position = {row[1], row[2], row[3]};
  m.base_rotation = Eigen::Quaterniond(row[7], row[4], row[5], row[6]);
  std::copy(row + 8, row + 8 + n_q, m.joint_position.data());
  std::copy(row + 8 + n_q, row + size, m.velocity.data());
  return m;
}

void sample(Simulation& simulation, ChannelReaders& channels, long long n_steps, long long every, bool from_start, double* out) {
  simulation.read(channels, from_start ? out : nullptr);  // also where an accelerometer begins
  if (from_start) out += channels.size();
  Outcome outcome = simulation.outcome();
  for (long long k = 1; k <= n_steps; ++k) {
    if (outcome == Outcome::running) outcome = simulation.step(false);
    if (k % every != 0) continue;
    if (outcome == Outcome::running) simulation.read(channels, out);
    else std::fill(out, out + channels.size(), kNaN);
    out += channels.size();
  }
}

void run_windows(const std::vector<Model*>& models, const Motions& motions, long long n_steps, long long every, const ChannelNames& channels,
                 int threads, bool from_start, double* out) {
  const std::size_t per_window = static_cast<std::size_t>(n_steps / every + (from_start ? 1 : 0)) * channels.size();
  const Prepared prepared(models);
  parallel_for(models.size() * motions.windows, threads, [&](std::size_t task) {
    // Each window starts from a simulation that was never stepped, so that its result does not depend on which thread ran what before.
    const std::size_t number = task / motions.windows;
    const double* row = motions.row(number, 0, task % motions.windows);
    const double start = motions.size > 0 ? row[0] : 0;
    Simulation simulation(prepared.between(number, start, start + static_cast<double>(n_steps) * prepared.bare[number].scenario.step));
    put_into_window(simulation, {}, row, motions.size);
    ChannelReaders read = channel_readers(simulation.model().rover, channels);
    sample(simulation, read, n_steps, every, from_start, out + task * per_window);
  });
}

Hidden run_carried(const std::vector<Model*>& models, const Motions& motions, std::span<const long long> n_steps, const ChannelNames& channels,
                   const Hidden& begin, double next_start, int threads, double* out) {
  const std::size_t n_windows = motions.windows, n_models = models.size();
  if (n_steps.size() != n_windows || (!begin.empty() && begin.size() != n_models))
    throw InputRefused("carried windows need a number of steps for each window, and a beginning for each model or none");
  if (n_windows == 0 || n_models == 0) return begin;
  const double h = models[0]->scenario.step;
  long long longest = 0;
  std::vector<long long> first(n_windows + 1);  // step at which each window begins
  for (std::size_t w = 0; w < n_windows; ++w) {
    longest = std::max(longest, n_steps[w]);
    const double start = motions.size > 0 ? motions.row(0, 0, w)[0] : kNaN;
    if (!std::isfinite(start) || n_steps[w] < 1) throw InputRefused(fmt::format("window {} has no start time or no step", w));
    first[w] = std::llround(start / h);
    if (w > 0 && first[w] <= first[w - 1]) throw InputRefused(fmt::format("carried windows must ascend; window {} begins at {:g} s, not after the one before", w, start));
  }
  for (const Model* model : models)
    if (model->scenario.step != h) throw InputRefused("models whose windows are carried together need one step");
  const long long last = first[n_windows - 1] + n_steps[n_windows - 1];
  first[n_windows] = std::isfinite(next_start) ? std::llround(next_start / h) : -1;
  if (std::isfinite(next_start) && first[n_windows] <= first[n_windows - 1])
    throw InputRefused(fmt::format("carried windows must ascend; the next one begins at {:g} s, not after the last", next_start));
  const double start = static_cast<double>(first[0]) * h, stop = static_cast<double>(std::max(last, first[n_windows])) * h;
  const std::size_t per_window = static_cast<std::size_t>(longest + 1) * channels.size();
  const auto place = [&](std::size_t model, std::size_t variant, std::size_t window) {
    return out + ((model * motions.variants + variant) * n_windows + window) * per_window;
  };
  std::fill(out, out + n_models * motions.variants * n_windows * per_window, kNaN);

  const Prepared prepared(models);
  std::vector<std::unique_ptr<Simulation>> leading(n_models);
  std::vector<std::vector<std::string>> hidden(n_models, std::vector<std::string>(n_windows + 1));  // of each window, as it begins
  std::size_t state_bytes = 0;
  for (std::size_t done = 0, stretch = 1; done < n_windows; done += stretch) {
    // Of each model variant 0 runs through a stretch of windows, one after the other; then all other variants, each on its own. The first
    // stretch is one window, which tells how large a state is.
    const std::size_t most = state_bytes > 0 ? kMostHiddenBytes / (2 * n_models * state_bytes) : 1;
    stretch = std::clamp<std::size_t>(most, 1, n_windows - done);
    parallel_for(n_models, threads, [&](std::size_t m) {
      if (done == 0 && !begin.empty()) hidden[m][0] = begin[m];
      for (std::size_t w = done; w < done + stretch; ++w) {
        if (leading[m] == nullptr || hidden[m][w].empty()) leading[m] = std::make_unique<Simulation>(prepared.between(m, start, stop));
        Simulation& simulation = *leading[m];
        put_into_window(simulation, hidden[m][w], motions.row(m, 0, w), motions.size);
        ChannelReaders read = channel_readers(simulation.model().rover, channels);
        const long long until = first[w + 1] - first[w];  // steps to where the next window begins; negative: there is none
        double* into = place(m, 0, w);
        simulation.read(read, into);
        for (long long k = 1; k <= std::max(n_steps[w], until) && simulation.outcome() == Outcome::running; ++k) {
          simulation.step(false);
          if (simulation.outcome() != Outcome::running) break;
          if (k <= n_steps[w]) simulation.read(read, into += channels.size());
          if (k == until) hidden[m][w + 1] = simulation.save();
        }
      }
    });
    const std::size_t others = motions.variants - 1;
    parallel_for(n_models * stretch * others, threads, [&](std::size_t task) {
      const std::size_t variant = 1 + task % others, rest = task / others;
      const std::size_t m = rest / stretch, w = done + rest % stretch;
      Simulation simulation(prepared.between(m, static_cast<double>(first[w]) * h, static_cast<double>(first[w] + n_steps[w]) * h));
      put_into_window(simulation, hidden[m][w], motions.row(m, variant, w), motions.size);
      ChannelReaders read = channel_readers(simulation.model().rover, channels);
      sample(simulation, read, n_steps[w], 1, true, place(m, variant, w));
    });
    for (std::size_t m = 0; m < n_models; ++m) {
      state_bytes = std::max(state_bytes, hidden[m][done + stretch].size());
      for (std::size_t w = done; w < done + stretch; ++w) hidden[m][w].clear();
    }
  }
  Hidden end(n_models);
  for (std::size_t m = 0; m < n_models; ++m) end[m] = hidden[m][n_windows];
  return end;
}

}  // namespace rille
