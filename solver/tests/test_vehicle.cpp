// A four-wheeled cart on soft soil, without a database.
#include <doctest/doctest.h>

#include <cmath>

#include "models.hpp"
#include "simulate/simulation.hpp"

using namespace rille;

namespace {

Model cart_model(double slope, double gravity, double step) {
  Model model;
  model.rover = test::cart(5);
  model.terrain = test::plane_terrain(slope, 4);
  model.scenario = test::scenario(gravity, step, 10);
  model.scenario.placement = Placement::on_terrain;
  model.scenario.settle_time = 5;
  return model;
}

double total_weight(const Model& model) {
  double mass = 0;
  for (const Body& body : model.rover.bodies) mass += body.mass;
  return mass * model.scenario.gravity.norm();
}

}  // namespace

TEST_CASE("a cart at rest is carried by its wheels and stays where it is") {
  const Model model = cart_model(0, 9.80665, 1e-3);
  Simulation simulation(model);
  REQUIRE(simulation.settle() == Outcome::running);
  const double x = simulation.snapshot().bodies[0].position.x();
  for (int k = 0; k < 2000; ++k) REQUIRE(simulation.step() == Outcome::running);
  const Snapshot snapshot = simulation.snapshot();
  double carried = 0;
  for (const WheelState& wheel : snapshot.wheels) {
    carried += wheel.normal_load;
    CHECK(wheel.sinkage == doctest::Approx(snapshot.wheels[0].sinkage).epsilon(1e-6));
  }
  CHECK(carried == doctest::Approx(total_weight(model)).epsilon(1e-6));
  CHECK(std::abs(snapshot.bodies[0].position.x() - x) < 1e-9);
}

TEST_CASE("a parked cart creeps less than 1 mm per minute down 15 degrees, at any step") {
  for (const double step : {1e-3, 5e-3}) {
    Simulation simulation(cart_model(std::tan(15 * M_PI / 180), 9.80665, step));
    REQUIRE(simulation.settle() == Outcome::running);
    const auto start = simulation.snapshot().bodies[0].position;
    const int n = static_cast<int>(6 / step);
    for (int k = 0; k < n; ++k) REQUIRE(simulation.step() == Outcome::running);
    const double moved = (simulation.snapshot().bodies[0].position - start).norm();
    MESSAGE("creep at step " << step << " s: " << moved * 10 * 1e3 << " mm/min");
    CHECK(moved * 10 < 1e-3);
  }
}

TEST_CASE("a driven cart on flat soil: drawbar pull vanishes, and does not depend on the step") {
  double slip[3] = {};
  int index = 0;
  for (const double step : {5e-4, 1e-3, 5e-3}) {
    Model model = cart_model(0, 9.80665, step);
    for (int d = 0; d < 4; ++d) model.scenario.commands.push_back({d, 0.0, 1.0});
    Simulation simulation(model);
    REQUIRE(simulation.settle() == Outcome::running);
    const int n = static_cast<int>(8 / step);
    for (int k = 0; k < n; ++k) REQUIRE(simulation.step() == Outcome::running);
    const Snapshot snapshot = simulation.snapshot();
    double pull = 0;
    for (const WheelState& wheel : snapshot.wheels) pull += wheel.drawbar_pull;
    CHECK(std::abs(pull) < 1e-3 * total_weight(model));  // steady: nothing pulls the cart but the soil
    slip[index++] = snapshot.wheels[0].slip_ratio;
    MESSAGE("step " << step << " s: slip " << snapshot.wheels[0].slip_ratio << ", speed "
                    << snapshot.bodies[0].velocity.x() << " m/s, sinkage " << 1e3 * snapshot.wheels[0].sinkage << " mm");
  }
  // The steady state obeys the soil law at every step size: secants are exact there.
  CHECK(slip[1] == doctest::Approx(slip[0]).epsilon(1e-3));
  CHECK(slip[2] == doctest::Approx(slip[0]).epsilon(1e-2));
}

TEST_CASE("the differential of a rocker-bogie holds while it drives over a slope, and both sides share the load") {
  Model model;
  model.rover = test::rocker_bogie();
  model.terrain = test::plane_terrain(0.1, 6);
  // One bump under the left side only, so that the rockers have to turn against each other.
  HeightGrid& grid = model.terrain->grid;
  for (int i = 0; i < grid.n_rows; ++i)
    for (int j = 0; j < grid.n_cols; ++j)
      if (grid.y_north - i > 0 && grid.x_west + j == 2) grid.heights[static_cast<std::size_t>(i * grid.n_cols + j)] += 0.15;
  model.scenario = test::scenario(1.625, 1e-3, 20);
  model.scenario.placement = Placement::on_terrain;
  model.scenario.settle_time = 5;
  for (std::size_t d = 0; d < model.rover.drives.size(); ++d)
    if (model.rover.drives[d].mode == DriveMode::speed) model.scenario.commands.push_back({static_cast<int>(d), 0, 1.2});
  Simulation simulation(model);
  REQUIRE(simulation.settle() == Outcome::running);
  double largest_angle = 0, largest_error = 0;
  for (int k = 0; k < 20000; ++k) {
    REQUIRE(simulation.step() == Outcome::running);
    largest_error = std::max(largest_error, simulation.largest_differential_error());
    if (k % 100 == 0) largest_angle = std::max(largest_angle, std::abs(simulation.snapshot().joints[0].position));
  }
  CHECK(largest_angle > 0.03);
  // The constraint is linear in the joint angles and solved exactly: rounding only.
  CHECK(largest_error < 1e-12);
}

TEST_CASE("a body that should hit the ground is reported, once, with its depth") {
  Model model = cart_model(0, 9.80665, 1e-3);
  model.rover.outlines.push_back({0, {{0, 0, 0.1}, {0.4, 0, -0.05}}});  // a skid 5 cm below the wheels, and less than their sinkage higher
  Simulation simulation(model);
  REQUIRE(simulation.settle() == Outcome::running);
  for (int k = 0; k < 500; ++k) REQUIRE(simulation.step() == Outcome::running);
  int reports = 0;
  for (const Event& event : simulation.take_events())
    if (event.kind == "body_in_ground") {
      ++reports;
      CHECK(event.subject == "chassis");
      CHECK(event.message.find("0.06") != std::string::npos);  // 5 cm and 1.2 cm of sinkage
    }
  CHECK(reports == 1);
}

TEST_CASE("leaving the map, sinking past the axle: outcomes with time, place and a hint") {
  Model model = cart_model(0, 9.80665, 1e-3);
  model.scenario.start_position.x() = 18.5;
  for (int d = 0; d < 4; ++d) model.scenario.commands.push_back({d, 0.0, 5.0});
  Simulation leaving(model);
  leaving.settle();
  Outcome outcome = Outcome::running;
  for (int k = 0; k < 10000 && outcome == Outcome::running; ++k) outcome = leaving.step();
  CHECK(outcome == Outcome::left_terrain);
  CHECK(leaving.message().find("front_") != std::string::npos);
  CHECK(leaving.step() == Outcome::left_terrain);  // and it stays so

  Model soft = cart_model(0, 9.80665, 1e-3);
  soft.terrain->soils[0].frictional_modulus = 500;
  soft.terrain->soils[0].cohesive_modulus = 0;
  soft.terrain->soils[0].cohesion = 0;
  Simulation sinking(soft);
  CHECK(sinking.settle() == Outcome::wheel_buried);
}
