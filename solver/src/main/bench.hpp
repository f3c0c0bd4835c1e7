// `rille-solver bench`: the single-wheel bench with a wheel and soils of a database.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace rille {

struct BenchOptions {
  std::string database;
  std::optional<std::string> wheel;   // absent: the only shape of wheel there is
  std::vector<std::string> soils;     // empty: all
  std::vector<std::string> laws = {"bekker_wong"};
  std::vector<double> loads;          // [N]
  std::vector<double> slips = {0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8};
  double slip_angle = 0;              // [rad]
  double gravity = 9.80665;           // [m/s^2] of the soils' unit weight
  double speed = 0.05;                // [m/s]
  bool dynamic = false;
  std::optional<std::string> save;    // name of the series in table bench_point
};

int bench(const BenchOptions& options, bool (*interrupted)());

}  // namespace rille
