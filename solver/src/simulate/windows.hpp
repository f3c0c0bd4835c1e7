// Short simulations in batch: windows of a recording, each from a motion of its own, for several models at once.
#pragma once

#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "model/model.hpp"
#include "simulate/simulation.hpp"

namespace rille {

using ChannelNames = std::vector<std::tuple<std::string, std::string, int>>;  // quantity, target, component
using ChannelReaders = std::vector<std::pair<Quantity, int>>;

// Raises InputRefused for channels that the model does not have.
ChannelReaders channel_readers(const Rover& rover, const ChannelNames& channels);

// A motion as numbers: time, position and quaternion x y z w of the root's principal frame, joint positions, generalised velocity.
std::vector<double> motion_row(Simulation& simulation);
// The motion of a row; raises InputRefused for a row of another size or with values that are not finite.
MechanismState motion_from_row(Simulation& simulation, const double* row, std::size_t size);

// Motions that windows start from: (models or 1, variants, windows, size), the last index fastest.
struct Motions {
  const double* data = nullptr;
  std::size_t models = 1, variants = 1, windows = 0, size = 0;

  const double* row(std::size_t model, std::size_t variant, std::size_t window) const {
    return data + (((models == 1 ? 0 : model) * variants + variant) * windows + window) * size;
  }
};

// Values of the channels after every `every` steps, NaN once the run has ended; from_start: also those before the first step.
void sample(Simulation& simulation, ChannelReaders& channels, long long n_steps, long long every, bool from_start, double* out);

// Each window from its motion, with everything that is not motion at rest (Simulation::start_at). One variant.
// out: (models, windows, samples, channels). Commands are given from so long before a window as they may be late.
void run_windows(const std::vector<Model*>& models, const Motions& motions, long long n_steps, long long every, const ChannelNames& channels,
                 int threads, bool from_start, double* out);

// What is not motion at the end of a stretch of windows, so that the next stretch can go on; empty: at rest.
using Hidden = std::vector<std::string>;  // of each model

// Windows one after the other: what is not motion (ruts, integrals, lags, states of effects) is carried on from the run of variant 0 as it
// was at the time where the next window begins, and only the motion is put there. Between windows that lie apart the run goes on; a window
// after a run that has ended begins at rest. Variants share that state and differ in their motion.
//   starts: the motions' times, ascending, the same for all variants. n_steps: of each window. next_start: of the window that a following
//   call begins with (NaN: none). begin: of the call before, or empty.
//   out: (models, variants, windows, most steps + 1, channels), filled up with NaN.
// The same numbers for any number of threads.
Hidden run_carried(const std::vector<Model*>& models, const Motions& motions, std::span<const long long> n_steps, const ChannelNames& channels,
                   const Hidden& begin, double next_start, int threads, double* out);

}  // namespace rille
