// The single-wheel bench: a carriage at fixed speed, a wheel turned by its own drive, a given vertical load; drawbar pull, side force,
// drive torque and sinkage are measured. Two ways, which must agree:
//   quasi_static   root of N(z) = load of the stress integrals, with the effects in their steady state
//   dynamic        the rig as a mechanism in the solver, run until it has settled
// Slip is set by the wheel's drive: rim at v/(1 - s) for s >= 0 (s = 1: the carriage stands), at v (1 + s) for s < 0, v: speed along the heading.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "model/effect.hpp"
#include "model/rover.hpp"
#include "model/terrain.hpp"

namespace rille {

enum class BenchMethod { quasi_static, dynamic };
enum class BenchStatus { done, not_carried, not_settled };

// The word that the table `bench_point` keeps.
constexpr const char* word(BenchStatus status) {
  return status == BenchStatus::done ? "done" : status == BenchStatus::not_carried ? "not_carried" : "not_settled";
}

struct BenchCase {
  int soil = 0;
  WheelSoilLaw law = WheelSoilLaw::bekker_wong;
  double load = 0;        // [N]
  double slip_ratio = 0;  // [-]
  double slip_angle = 0;  // [rad]
};

struct BenchPoint {
  double sinkage = 0;       // [m]
  double drawbar_pull = 0;  // [N]
  double side_force = 0;    // [N] against the drift
  double drive_torque = 0;  // [N m]
  double normal_load = 0;   // [N] as carried
  double entry_angle = 0, peak_angle = 0, exit_angle = 0;  // [rad]; quasi-static only
  BenchStatus status = BenchStatus::done;
};

struct Bench {
  Wheel wheel;
  std::vector<Soil> soils;
  std::vector<EffectRow> effects;  // on wheels; others are refused
  double speed = 0.05;             // [m/s]
  double step = 1e-3;              // [s] dynamic
  double longest = 60;             // [s] dynamic: not settled after this
};

// Points of the cases, in their order. Neighbouring quasi-static cases start from each other. threads: for the dynamic rig, 0 = all cores.
// keep_going: asked between cases; false ends early with the points so far. Raises InputRefused for values that no rig could run.
std::vector<BenchPoint> run_bench(const Bench& bench, const std::vector<BenchCase>& cases, BenchMethod method, int threads = 0,
                                  const std::function<bool()>& keep_going = nullptr);

}  // namespace rille
