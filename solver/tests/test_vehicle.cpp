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
  HeightGrid grid = *model.terrain->grid;
  for (int i = 0; i < grid.n_rows; ++i)
    for (int j = 0; j < grid.n_cols; ++j)
      if (grid.y_north - i > 0 && grid.x_west + j == 2) grid.heights[static_cast<std::size_t>(i * grid.n_cols + j)] += 0.15;
  model.terrain->grid = std::make_shared<const HeightGrid>(std::move(grid));
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

TEST_CASE("a hull that reaches the ground carries its share of the weight, and its touch is an event") {
  Model model = cart_model(0, 9.80665, 1e-3);
  BodyShape skid{.body = 0};
  skid.shape.center = {0, 0, 0.2};
  skid.shape.size = {0.6, 0.4, 0.395};  // its lower face 2.5 mm above the ground before the wheels sink by 1.2 cm
  model.rover.shapes.push_back(skid);
  Simulation simulation(model);
  REQUIRE(simulation.settle() == Outcome::running);
  for (int k = 0; k < 500; ++k) REQUIRE(simulation.step() == Outcome::running);
  int touches = 0;
  for (const Event& event : simulation.take_events()) touches += event.kind == "contact_begin" && event.subject == "chassis";
  CHECK(touches == 1);
  const Snapshot snapshot = simulation.snapshot();
  double on_wheels = 0;
  for (const WheelState& wheel : snapshot.wheels) on_wheels += wheel.normal_load;
  CHECK(on_wheels < 0.5 * total_weight(model));  // the wheels stand at 2.5 mm instead of 12: load as z^1.5 is a tenth
  CHECK(snapshot.bodies[0].velocity.norm() < 1e-4);
}

TEST_CASE("a box on a rigid slope holds below the friction angle and slides with g (sin - mu cos) above it") {
  for (const double slope : {0.3, 0.7}) {
    const double mu = 0.5;
    Model model;
    model.rover.bodies.push_back(test::box_body("box", 10, {0, 0, 0.1}, {0.4, 0.3, 0.2}));
    BodyShape hull{.body = 0};
    hull.shape.center = {0, 0, 0.1};
    hull.shape.size = {0.4, 0.3, 0.2};
    model.rover.shapes.push_back(hull);
    model.terrain = test::plane_terrain(slope, 0);
    model.terrain->rigid_ground = {{RigidPair{mu, 0}}};
    model.scenario = test::scenario(9.80665, 1e-3, 1);
    model.scenario.start_rotation = Eigen::Quaterniond(Eigen::AngleAxisd(-std::atan(slope), Eigen::Vector3d::UnitY()));
    Simulation simulation(model);
    for (int k = 0; k < 1000; ++k) REQUIRE(simulation.step() == Outcome::running);
    const Eigen::Vector3d v = simulation.snapshot().bodies[0].velocity;
    const double angle = std::atan(slope);
    const double acceleration = 9.80665 * std::max(0.0, std::sin(angle) - mu * std::cos(angle));
    CHECK(v.norm() == doctest::Approx(acceleration * 1.0).epsilon(0.01).scale(0.01));  // 1 %: slop and push-out at the start
    CHECK(simulation.snapshot().energy.contact_loss >= -1e-9);
  }
}

TEST_CASE("a ball that falls on a rock rebounds with the restitution of the pair") {
  Model model;
  model.rover.bodies.push_back(test::box_body("ball", 1, {0, 0, 0}, {0.2, 0.2, 0.2}));
  BodyShape ball{.body = 0};
  ball.shape.kind = ShapeKind::sphere;
  ball.shape.size = {0.1, 0.1, 0.1};
  model.rover.shapes.push_back(ball);
  model.terrain = test::plane_terrain(0, 0);
  Obstacle rock{.name = "rock"};
  rock.shape.size = {1, 1, 1};
  model.terrain->obstacles.push_back(rock);
  model.terrain->rigid = {{RigidPair{0.5, 0.8}}};
  model.terrain->rigid_ground = {{RigidPair{}}};
  model.scenario = test::scenario(9.80665, 1e-4, 2);
  model.scenario.start_position = {0, 0, 1.6};  // 1 m above the rock's top, less the radius
  Simulation simulation(model);
  double impact = 0, rebound = 0;
  for (int k = 0; k < 8000; ++k) {
    REQUIRE(simulation.step() == Outcome::running);
    const double v = simulation.snapshot().bodies[0].velocity.z();
    impact = std::min(impact, v);
    rebound = std::max(rebound, v);
  }
  CHECK(impact == doctest::Approx(-std::sqrt(2 * 9.80665 * 1.0)).epsilon(1e-3));
  CHECK(rebound == doctest::Approx(-0.8 * impact).epsilon(1e-3));
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
