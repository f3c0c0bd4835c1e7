#include "simulate/bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "effects/registry.hpp"
#include "model/error.hpp"
#include "model/soil_range.hpp"
#include "physics/sinkage.hpp"
#include "simulate/parallel.hpp"
#include "simulate/simulation.hpp"

namespace rille {
namespace {

using Eigen::Vector3d;

constexpr double kGravity = 9.80665;      // [m/s^2] of the rig; the load sets the mass
constexpr double kSettleWindow = 0.25;    // [s] over which means are compared
constexpr double kSettled = 2e-5;         // [-] change of load, pull and torque from window to window, of the load
constexpr double kSettledSinkage = 1e-6;  // [m] the same of the sinkage
constexpr int kQuietWindows = 4;          // in a row

struct Speeds {
  double travel, rim;  // [m/s] of the carriage, u = r w
};

// Slip is that along the wheel's heading, of which the carriage's travel has the cosine of the slip angle.
Speeds speeds_of(const Bench& bench, const BenchCase& c) {
  const double ahead = bench.speed * std::cos(c.slip_angle);
  if (c.slip_ratio >= 1) return {0, bench.speed};
  if (c.slip_ratio >= 0) return {bench.speed, ahead / (1 - c.slip_ratio)};
  return {bench.speed, ahead * (1 + c.slip_ratio)};
}

void check(const Bench& bench, const std::vector<BenchCase>& cases) {
  const auto need = [](bool good, const char* what, double value, const char* bound) {
    if (!good) throw InputRefused(fmt::format("{} of the bench is {:g}; it must be {}", what, value, bound));
  };
  need(bench.wheel.radius > 0 && std::isfinite(bench.wheel.radius), "wheel radius [m]", bench.wheel.radius, "above 0");
  need(bench.wheel.width > 0 && std::isfinite(bench.wheel.width), "wheel width [m]", bench.wheel.width, "above 0");
  need(bench.speed > 0 && bench.speed < 100, "speed [m/s]", bench.speed, "above 0 and below 100");
  need(bench.step > 0 && bench.step <= 0.1, "step [s]", bench.step, "above 0 and at most 0.1");
  need(bench.longest > 0 && bench.longest <= 1e6, "longest time [s]", bench.longest, "above 0 and at most 1e6");
  for (const Soil& soil : bench.soils) require_valid(soil, "the soil");
  for (const BenchCase& c : cases) {
    need(c.load > 0 && std::isfinite(c.load), "load [N]", c.load, "above 0");
    need(c.slip_ratio >= -1 && c.slip_ratio <= 1, "slip ratio", c.slip_ratio, "in -1 to 1");
    need(std::abs(c.slip_angle) < 1.5, "slip angle [rad]", c.slip_angle, "between -1.5 and 1.5");
    need(c.law != WheelSoilLaw::rigid, "law", 0, "bekker, bekker_wong or reece");
    require_carries(bench.soils[static_cast<std::size_t>(c.soil)], c.law, bench.wheel.width, "the soil", "the bench's wheel");
  }
}

Model rig(const Bench& bench, const BenchCase& c) {
  const double radius = bench.wheel.radius;
  const double mass = c.load / kGravity;
  Model model;
  const auto body = [&](const char* name, double m, const Vector3d& com) {
    Body made{.name = name, .mass = m, .com = com};
    made.inertia = Eigen::Matrix3d::Identity() * 0.4 * m * radius * radius;
    model.rover.bodies.push_back(made);
    return static_cast<int>(model.rover.bodies.size()) - 1;
  };
  const Vector3d center(0, 0, radius);
  const int carriage = body("carriage", mass, center);
  const int post = body("post", 0.7 * mass, center);
  const int wheel = body("wheel", 0.3 * mass, center);
  // Travel along x; the wheel heads to the right of it by the slip angle, so that it drifts to its left.
  const Vector3d axle(std::sin(c.slip_angle), std::cos(c.slip_angle), 0);
  const auto joint = [&](const char* name, JointKind kind, int parent, int child, const Vector3d& axis) {
    Joint made{.name = name, .kind = kind, .parent = parent, .child = child, .point = center, .axis = axis};
    model.rover.joints.push_back(made);
    return static_cast<int>(model.rover.joints.size()) - 1;
  };
  const int rail = joint("rail", JointKind::prismatic, -1, carriage, Vector3d::UnitX());
  joint("slide", JointKind::prismatic, carriage, post, Vector3d::UnitZ());
  const int hub = joint("axle", JointKind::hinge, post, wheel, axle);
  const double ample = 1e3 * c.load * std::max(1.0, radius);
  model.rover.drives.push_back({.name = "rail", .joint = rail, .max_torque = ample});
  model.rover.drives.push_back({.name = "axle", .joint = hub, .max_torque = ample});
  Wheel made = bench.wheel;
  made.joint = hub;
  made.center = center;
  made.name = bench.wheel.name.empty() ? "wheel" : bench.wheel.name;
  model.rover.wheels.push_back(made);

  const Speeds speeds = speeds_of(bench, c);
  const double length = speeds.travel * bench.longest + 4 * radius + 2;
  HeightGrid grid{.n_rows = 2, .n_cols = 2, .posting_x = length, .posting_y = 4, .x_west = -2 * radius - 1, .y_north = 2};
  grid.heights.assign(4, 0.0);
  Terrain terrain;
  terrain.name = "bench";
  terrain.grid = std::make_shared<const HeightGrid>(std::move(grid));
  terrain.soils = {bench.soils[static_cast<std::size_t>(c.soil)]};
  terrain.soil_names = {"soil"};
  terrain.response = {{c.law}};
  terrain.rigid_ground = {{RigidPair{}}};
  terrain.rigid = {{}};
  model.terrain = std::move(terrain);
  model.effects = bench.effects;
  model.scenario.gravity = Vector3d(0, 0, -kGravity);
  model.scenario.step = bench.step;
  model.scenario.duration = bench.longest;
  model.scenario.initial_states = {{rail, 0, speeds.travel}, {hub, 0, speeds.rim / radius}};
  model.scenario.commands = {{0, 0, speeds.travel}, {1, 0, speeds.rim / radius}};
  return model;
}

BenchPoint dynamic_point(const Bench& bench, const BenchCase& c) {
  Simulation simulation(rig(bench, c));
  const auto window = std::max(1LL, std::llround(kSettleWindow / bench.step));
  const auto n_windows = std::llround(bench.longest / kSettleWindow);
  BenchPoint last, mean;
  int quiet = 0;
  for (long long w = 0; w < n_windows; ++w) {
    last = mean;
    mean = {};
    for (long long k = 0; k < window; ++k) {
      if (simulation.step(false) != Outcome::running) {
        mean.status = simulation.outcome() == Outcome::wheel_buried ? BenchStatus::not_carried : BenchStatus::not_settled;
        return mean;
      }
      const WheelState state = simulation.wheel_state(0);
      const auto share = 1 / static_cast<double>(window);
      mean.sinkage += share * state.sinkage;
      mean.drawbar_pull += share * state.drawbar_pull;
      mean.side_force += share * -state.side_force;
      mean.drive_torque += share * state.drive_torque;
      mean.normal_load += share * state.normal_load;
    }
    const double change = std::max({std::abs(mean.drawbar_pull - last.drawbar_pull), std::abs(mean.normal_load - last.normal_load),
                                    std::abs(mean.side_force - last.side_force),
                                    std::abs(mean.drive_torque - last.drive_torque) / bench.wheel.radius});
    const bool still = w > 0 && change < kSettled * c.load && std::abs(mean.sinkage - last.sinkage) < kSettledSinkage &&
                       std::abs(mean.normal_load - c.load) < 1e-3 * c.load;
    quiet = still ? quiet + 1 : 0;
    if (quiet >= kQuietWindows) return mean;
  }
  mean.status = BenchStatus::not_settled;
  return mean;
}

// Quasi-static points one after the other; each law and load starts from its neighbour's sinkage.
class QuasiStatic {
 public:
  explicit QuasiStatic(const Bench& bench) : bench_(bench) {}

  BenchPoint point(const BenchCase& c) {
    Model model;  // effects attach to a model; a wheel is all that it needs here
    model.rover.wheels = {bench_.wheel};
    model.effects = bench_.effects;
    Effects effects;
    if (!bench_.effects.empty()) effects = attach_effects(model);
    WheelEffects& on_wheel = bench_.effects.empty() ? none_ : effects.wheels[0];
    const Soil& soil = bench_.soils[static_cast<std::size_t>(c.soil)];
    const Speeds speeds = speeds_of(bench_, c);
    WheelSite site;
    site.wheel = &bench_.wheel;
    // The carriage travels at the slip angle to the wheel's heading.
    site.travel_speed = speeds.travel * std::cos(c.slip_angle);
    site.rim_speed = speeds.rim;
    site.lateral_speed = speeds.travel * std::sin(c.slip_angle);
    site.slip = slip_of(site.travel_speed, site.rim_speed, site.lateral_speed);
    for (auto& effect : on_wheel) effect->settle(site);
    const auto reaction_at = [&](double z) {
      if (on_wheel.empty())
        return react(c.law, soil, {bench_.wheel.radius, bench_.wheel.width}, {z, site.slip.ratio, site.slip.travel_ratio, site.slip.lateral_ratio});
      site.soil = soil;
      site.sinkage = z;
      site.lateral_ratio = site.slip.lateral_ratio;
      return react_with(on_wheel, c.law, site);
    };
    const Equilibrium found = sinkage_under_load(reaction_at, bench_.wheel.radius, soil.sinkage_exponent, c.load, guess_);
    BenchPoint point;
    if (!found.found) {
      point.status = BenchStatus::not_carried;
      guess_ = 0;
      return point;
    }
    guess_ = found.sinkage;
    point.sinkage = found.sinkage;
    point.drawbar_pull = found.reaction.drawbar_pull;
    point.side_force = c.slip_angle == 0 ? 0 : std::copysign(found.reaction.side_force, c.slip_angle);
    point.drive_torque = found.reaction.torque;
    point.normal_load = found.reaction.normal_load;
    point.entry_angle = found.reaction.entry_angle;
    point.peak_angle = found.reaction.peak_angle;
    point.exit_angle = found.reaction.exit_angle;
    return point;
  }

 private:
  const Bench& bench_;
  WheelEffects none_;
  double guess_ = 0;  // [m]
};

}  // namespace

std::vector<BenchPoint> run_bench(const Bench& bench, const std::vector<BenchCase>& cases, BenchMethod method, int threads,
                                  const std::function<bool()>& keep_going) {
  check(bench, cases);
  for (const EffectRow& effect : bench.effects)
    if (effect.target != EffectTarget::wheel && effect.target != EffectTarget::terrain)
      throw InputRefused(fmt::format("the effect '{}' does not act on wheels; a bench knows nothing else", effect.kind));
  std::vector<BenchPoint> points(cases.size());
  if (method == BenchMethod::quasi_static) {
    QuasiStatic rig_free(bench);
    std::size_t k = 0;
    for (; k < cases.size() && (!keep_going || keep_going()); ++k) points[k] = rig_free.point(cases[k]);
    points.resize(k);
    return points;
  }
  const bool whole = parallel_for(cases.size(), threads, [&](std::size_t k) { points[k] = dynamic_point(bench, cases[k]); }, keep_going);
  if (!whole) points.clear();
  return points;
}

}  // namespace rille
