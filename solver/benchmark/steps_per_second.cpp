// Steps per second of a six-wheel rocker-bogie on lunar soil, without files: for profilers.
#include <fmt/format.h>

#include <chrono>

#include "models.hpp"
#include "simulate/simulation.hpp"

int main() {
  using namespace rille;
  Model model;
  model.rover = test::rocker_bogie();
  model.terrain = test::plane_terrain(0.05, 6);
  model.scenario = test::scenario(1.625, 1e-3, 60);
  model.scenario.placement = Placement::on_terrain;
  model.scenario.settle_time = 5;
  for (std::size_t d = 0; d < model.rover.drives.size(); ++d)
    model.scenario.commands.push_back(
        {static_cast<int>(d), 0, model.rover.drives[d].mode == DriveMode::speed ? 1.0 : 0.05});
  std::stable_sort(model.scenario.commands.begin(), model.scenario.commands.end(),
                   [](const Command& a, const Command& b) { return a.time < b.time; });
  Simulation simulation(model);
  simulation.settle();
  constexpr int kSteps = 60000;
  const auto start = std::chrono::steady_clock::now();
  for (int k = 0; k < kSteps; ++k)
    if (simulation.step() != Outcome::running) break;
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  fmt::print("{} after {} steps: {:.0f} steps/s, differential error {:.1e} rad {}\n", word(simulation.outcome()),
             simulation.steps(), static_cast<double>(simulation.steps()) / wall, simulation.largest_differential_error(),
             simulation.message());
  for (const WheelState& w : simulation.snapshot().wheels)
    fmt::print("  slip {:.3f} angle {:.3f} sinkage {:.2f} mm load {:.2f} N pull {:.2f} N side {:.2f} N torque {:.3f} N m\n",
               w.slip_ratio, w.slip_angle, 1e3 * w.sinkage, w.normal_load, w.drawbar_pull, w.side_force, w.drive_torque);
}
