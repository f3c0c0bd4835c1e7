#include "main/bench.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "main/exit_code.hpp"
#include "model/error.hpp"
#include "simulate/bench.hpp"
#include "store/load.hpp"
#include "world/mechanism.hpp"

namespace rille {
namespace {

template <class Names>
std::size_t find(const Names& names, const std::string& name, const char* what) {
  for (std::size_t k = 0; k < names.size(); ++k)
    if (names[k] == name) return k;
  throw InputRefused(fmt::format("the database has no {} '{}'; it has {}", what, name, fmt::join(names, ", ")));
}

}  // namespace

int bench(const BenchOptions& options, bool (*interrupted)()) {
  require_double_precision();
  SQLite::Database database = open_database(options.database);
  const Model vehicle = load_vehicle(database);
  const Terrain soils = load_soil_table(database, options.gravity);
  std::vector<std::string> wheels;
  for (const Wheel& wheel : vehicle.rover.wheels) wheels.push_back(wheel.name);
  if (wheels.empty()) throw InputRefused("the database has no wheel; build a rover into it first");
  if (soils.soils.empty()) throw InputRefused("the database has no soil; build a terrain into it first");
  Bench rig;
  const std::size_t which = options.wheel ? find(wheels, *options.wheel, "wheel") : 0;
  rig.wheel = vehicle.rover.wheels[which];
  for (const EffectRow& effect : vehicle.effects)
    if ((effect.target == EffectTarget::wheel && (effect.index < 0 || effect.index == static_cast<int>(which)))) {
      rig.effects.push_back(effect);
      rig.effects.back().index = -1;
    }
  rig.soils = soils.soils;
  rig.speed = options.speed;
  std::vector<BenchCase> cases;
  for (const std::string& soil : options.soils.empty() ? soils.soil_names : options.soils)
    for (const std::string& law : options.laws) {
      for (const double load : options.loads)
        for (const double slip : options.slips)
          cases.push_back({static_cast<int>(find(soils.soil_names, soil, "soil")), soft_soil_law(law), load, slip, options.slip_angle});
    }
  const BenchMethod method = options.dynamic ? BenchMethod::dynamic : BenchMethod::quasi_static;
  const std::vector<BenchPoint> points = run_bench(rig, cases, method, 0, [interrupted] { return !interrupted(); });

  if (options.save) {
    SQLite::Transaction transaction(database);
    SQLite::Statement clear(database, "DELETE FROM bench_point WHERE bench = ?");
    clear.bind(1, *options.save);
    clear.exec();
    SQLite::Statement row(database,
                          "INSERT INTO bench_point (bench, method, soil, response, radius, width, load, slip_ratio, slip_angle, sinkage, "
                          "drawbar_pull, side_force, drive_torque, status) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
    for (std::size_t k = 0; k < points.size(); ++k) {
      const BenchCase& c = cases[k];
      const BenchPoint& p = points[k];
      row.reset();
      row.clearBindings();
      row.bind(1, *options.save);
      row.bind(2, options.dynamic ? "dynamic" : "quasi_static");
      row.bind(3, soils.soil_names[static_cast<std::size_t>(c.soil)]);
      row.bind(4, word(c.law));
      int column = 5;
      for (const double value : {rig.wheel.radius, rig.wheel.width, c.load, c.slip_ratio, c.slip_angle}) row.bind(column++, value);
      if (p.status == BenchStatus::done)
        for (const double value : {p.sinkage, p.drawbar_pull, p.side_force, p.drive_torque}) row.bind(column++, value);
      row.bind(14, word(p.status));
      row.exec();
    }
    transaction.commit();
  }
  fmt::print("method,soil,response,load_N,slip_ratio,slip_angle_rad,sinkage_m,drawbar_pull_N,side_force_N,drive_torque_Nm,status\n");
  for (std::size_t k = 0; k < points.size(); ++k) {
    const BenchCase& c = cases[k];
    const BenchPoint& p = points[k];
    fmt::print("{},{},{},{:.9g},{:.9g},{:.9g},{:.12g},{:.12g},{:.12g},{:.12g},{}\n", options.dynamic ? "dynamic" : "quasi_static",
               soils.soil_names[static_cast<std::size_t>(c.soil)], word(c.law), c.load, c.slip_ratio, c.slip_angle, p.sinkage, p.drawbar_pull,
               p.side_force, p.drive_torque, word(p.status));
  }
  if (points.size() < cases.size()) {
    fmt::print(stderr, "interrupted after {} of {} points\n", points.size(), cases.size());
    return kInterrupted;
  }
  return kDone;
}

}  // namespace rille
