#include "simulate/sensors.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace rille {

Sensors::Sensors(const Model& model, const std::vector<SensorEffects>& effects) {
  for (std::size_t s = 0; s < model.rover.sensors.size(); ++s) {
    const Sensor& sensor = model.rover.sensors[s];
    double delay = 0;
    for (const auto& effect : effects[s]) delay += effect->delay();
    channels_.push_back({Quantity(model.rover, sensor.quantity, sensor.target, sensor.body_frame, "sensor '" + sensor.name + "'"), sensor.rate,
                         delay, &effects[s], 0, {}});
  }
}

std::vector<double> Sensors::clocks(double time) const {
  std::vector<double> found;
  for (const Channel& channel : channels_) {
    Reading reading{.time = time, .values = {}};
    for (const auto& effect : *channel.effects) effect->distort(reading, channel.number);
    found.push_back(reading.time);
  }
  return found;
}

void Sensors::sense(double time, const Readable& from) {
  for (std::size_t s = 0; s < channels_.size(); ++s) {
    Channel& channel = channels_[s];
    // Half a step of tolerance: a sample that is due at k/rate is taken at the step that ends there.
    const bool due = time + 0.5 * from.h >= static_cast<double>(channel.number) / channel.rate;
    if (!due && channel.delay == 0 && !channel.quantity.needs_every_step()) continue;
    std::vector<double> values = channel.quantity.read(from);
    if (channel.delay > 0) {
      channel.past.emplace_back(time, values);
      while (channel.past.size() > 2 && channel.past[1].first <= time - channel.delay) channel.past.pop_front();
      const auto& [t_0, v_0] = channel.past.front();
      if (channel.past.size() > 1) {
        const auto& [t_1, v_1] = channel.past[1];
        const double share = std::clamp((time - channel.delay - t_0) / (t_1 - t_0), 0.0, 1.0);
        // Of an orientation, q and -q are the same.
        const double sign = v_0.size() == 4 && std::inner_product(v_0.begin(), v_0.end(), v_1.begin(), 0.0) < 0 ? -1 : 1;
        for (std::size_t k = 0; k < values.size(); ++k) values[k] = (1 - share) * v_0[k] + sign * share * v_1[k];
      } else {
        values = v_0;
      }
    }
    if (!due) continue;
    Reading reading{.time = time, .values = std::move(values)};
    for (const auto& effect : *channel.effects) effect->distort(reading, channel.number);
    // The next one that is not due yet: a sensor faster than the steps is read once a step.
    channel.number = std::max(channel.number + 1, static_cast<long long>(std::floor((time + 0.5 * from.h) * channel.rate)) + 1);
    if (reading.lost) continue;
    for (std::size_t k = 0; k < reading.values.size(); ++k)
      samples_.push_back({static_cast<int>(s), reading.time, static_cast<int>(k), reading.values[k]});
  }
}

}  // namespace rille
