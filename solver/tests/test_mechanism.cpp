// Bullet's articulated bodies against our composite-body mass matrix: two independent descriptions of one mechanism.
#include <doctest/doctest.h>

#include <random>

#include "model/error.hpp"
#include "models.hpp"
#include "simulate/simulation.hpp"
#include "world/mechanism.hpp"

using namespace rille;
using Eigen::Vector3d;

namespace {

Vector3d random_vector(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return {normal(random), normal(random), normal(random)};
}

// Tree of random bodies with full inertia tensors and every kind of joint.
Rover random_tree(std::mt19937& random, bool held) {
  std::uniform_real_distribution<double> uniform;
  Rover rover;
  for (int b = 0; b < 8; ++b) {
    Body body = test::box_body("b" + std::to_string(b), 0.5 + uniform(random), random_vector(random),
                               Vector3d(0.1, 0.2, 0.3) + 0.3 * Vector3d(uniform(random), uniform(random), uniform(random)));
    const Eigen::Quaterniond q = Eigen::Quaterniond(uniform(random), uniform(random), uniform(random), 1).normalized();
    body.inertia = q * body.inertia * q.conjugate().toRotationMatrix();
    body.frame = random_vector(random);
    rover.bodies.push_back(body);
    if (b == 0 && !held) continue;
    Joint joint;
    joint.name = "j" + std::to_string(b);
    joint.kind = std::array{JointKind::hinge, JointKind::prismatic, JointKind::fixed, JointKind::spherical}[b % 4];
    if (b == 0) joint.kind = JointKind::hinge;
    joint.parent = b == 0 ? -1 : static_cast<int>(uniform(random) * b);
    joint.child = b;
    joint.point = random_vector(random);
    joint.axis = random_vector(random).normalized();
    rover.joints.push_back(joint);
  }
  return rover;
}

}  // namespace

TEST_CASE("efforts applied by the articulated-body algorithm return through the mass matrix") {
  require_double_precision();
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 40; ++trial) {
    const bool held = trial % 2 == 1;
    Mechanism mechanism(random_tree(random, held), Vector3d(0.3, -0.2, -9.81));
    MechanismState state = mechanism.state();
    if (!held) state.base_rotation = Eigen::Quaterniond(normal(random), normal(random), normal(random), 2).normalized();
    const Rover rover = random_tree(random, held);
    for (auto& x : state.velocity) x = normal(random);
    if (held) state.velocity.head<6>().setZero();
    mechanism.set_state(state);
    for (std::size_t j = 0; j < 8 - (held ? 0 : 1); ++j)
      if (mechanism.dof_of(static_cast<int>(j)) >= 0) mechanism.set_joint(static_cast<int>(j), normal(random), normal(random));
    mechanism.update_kinematics();
    mechanism.update_mass_matrix();
    Eigen::VectorXd effort = Eigen::VectorXd::Zero(mechanism.dofs());
    const Eigen::VectorXd unforced = mechanism.free_velocity(1e-3, effort);
    for (Eigen::Index i = 6; i < effort.size(); ++i) effort[i] = normal(random);
    const Eigen::VectorXd forced = mechanism.free_velocity(1e-3, effort);
    const Eigen::VectorXd impulse = mechanism.mass_matrix().selfadjointView<Eigen::Lower>() * (forced - unforced);
    // Velocities of order 1 lose 1e-16 when subtracted, divided by h: 1e-13, times inertias of order 10.
    CHECK((impulse / 1e-3 - effort).cwiseAbs().maxCoeff() < 1e-10);
  }
}

TEST_CASE("a row's Jacobian is the velocity of the point that it names") {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  Mechanism mechanism(random_tree(random, false), Vector3d::Zero());
  MechanismState state = mechanism.state();
  for (auto& x : state.velocity) x = normal(random);
  mechanism.set_state(state);
  mechanism.update_kinematics();
  for (int body = 0; body < 8; ++body) {
    RowSet rows;
    const Vector3d p = random_vector(random);
    const Vector3d along = random_vector(random);
    const Vector3d about = random_vector(random);
    const int row = rows.open();
    mechanism.add_jacobian(body, p, along, about, rows);
    const double expected = mechanism.velocity_at(body, p).dot(along) + mechanism.angular_velocity(body).dot(about);
    CHECK(rows.dot(rows[row], mechanism.velocity()) == doctest::Approx(expected).epsilon(1e-12));
  }
}

TEST_CASE("mechanisms that are no tree are refused with their names") {
  Rover rover = test::cart(5);
  Rover loose = rover;
  loose.bodies.push_back(test::box_body("stray", 1, {0, 0, 1}, {1, 1, 1}));
  CHECK_THROWS_WITH_AS(Mechanism(loose, Vector3d::Zero()), doctest::Contains("'stray'"), InputRefused);
  Rover twice = rover;
  twice.joints.push_back(rover.joints[0]);
  twice.joints.back().name = "again";
  CHECK_THROWS_WITH_AS(Mechanism(twice, Vector3d::Zero()), doctest::Contains("'again'"), InputRefused);
  Rover circle = rover;
  circle.joints[0].parent = 2;
  circle.joints[1].parent = 1;
  CHECK_THROWS_WITH_AS(Mechanism(circle, Vector3d::Zero()), doctest::Contains("circle"), InputRefused);
}
