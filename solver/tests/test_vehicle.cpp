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
