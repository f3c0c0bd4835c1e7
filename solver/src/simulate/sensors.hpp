// Sensors of the model: each reads one quantity at its own rate, through its faults.
#pragma once

#include <deque>
#include <utility>
#include <vector>

#include "effects/effect.hpp"
#include "simulate/quantity.hpp"

namespace rille {

class Sensors {
 public:
  Sensors(const Model& model, const std::vector<SensorEffects>& effects);

  bool empty() const { return channels_.empty(); }
  // Reads what is due at the end of a step (or at t = 0).
  void sense(double time, const Readable& from);
  // [s] What the clock of each sensor shows at a time.
  std::vector<double> clocks(double time) const;
  std::vector<SensorSample> take_samples() { return std::exchange(samples_, {}); }
  void visit(Archive& archive) {
    for (Channel& channel : channels_) archive(channel.quantity, channel.number, channel.past);
  }

 private:
  struct Channel {
    Quantity quantity;
    double rate;   // [Hz]
    double delay;  // [s]
    const SensorEffects* effects;
    long long number = 0;                                             // of the next sample
    std::deque<std::pair<double, std::vector<double>>> past;          // for delays: time, values
  };

  std::vector<Channel> channels_;
  std::vector<SensorSample> samples_;
};

}  // namespace rille
