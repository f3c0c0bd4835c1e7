// The active-set solution must satisfy the definition of the rows: momentum balance, clamps, and complementarity.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

#include "physics/rows.hpp"

using namespace rille;

namespace {

// n degrees of freedom with a random mass and a random motion.
struct Problem {
  Eigen::MatrixXd mass;
  Eigen::VectorXd v_free;

  Problem(int n, std::mt19937& random) {
    std::normal_distribution<double> normal;
    Eigen::MatrixXd root(n, n);
    for (auto& x : root.reshaped()) x = normal(random);
    mass = root * root.transpose() + 0.1 * Eigen::MatrixXd::Identity(n, n);
    v_free.resize(n);
    for (auto& x : v_free) x = normal(random);
  }
};

// Opens row i with a random Jacobian on every degree of freedom or every second one.
int open_row(RowSet& rows, Eigen::MatrixXd& jacobian, int i, std::mt19937& random) {
  std::normal_distribution<double> normal;
  const int row = rows.open();
  for (int d = i % 3; d < jacobian.cols(); d += 1 + i % 2) {
    jacobian(i, d) = normal(random);
    rows.add(d, jacobian(i, d));
  }
  return row;
}

}  // namespace

TEST_CASE("random rows satisfy balance and clamps") {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  RowSolver solver;
  RowSet rows;
  Eigen::VectorXd v;
  for (int trial = 0; trial < 300; ++trial) {
    const int n = 4 + trial % 9;
    const int n_rows = 1 + trial % 17;
    const Problem problem(n, random);
    const auto& [mass, v_free] = problem;
    rows.clear();
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(n_rows, n);
    const int n_hard = n_rows > 3 ? 2 : 0;
    for (int i = 0; i < n_rows; ++i) {
      const int row = open_row(rows, jacobian, i, random);
      rows[row].target = normal(random);
      if (i < n_hard) continue;
      rows[row].weight = std::pow(10.0, 4 * uniform(random) - 1);
      rows[row].lower = -uniform(random);
      rows[row].upper = i % 4 == 0 ? rows[row].lower : uniform(random);
    }
    REQUIRE(solver.solve(mass, v_free, rows, v));
    const Eigen::VectorXd& f = solver.impulse();
    // Weights reach 1e3 times the smallest eigenvalue of mass (0.1): ten digits remain of sixteen.
    const Eigen::VectorXd balance = mass * (v - v_free) - jacobian.transpose() * f;
    CHECK(balance.cwiseAbs().maxCoeff() < 1e-9);
    for (int i = 0; i < n_rows; ++i) {
      const double error = rows[i].target - jacobian.row(i).dot(v);
      if (i < n_hard) {
        CHECK(std::abs(error) < 1e-9);
      } else {
        CHECK(f[i] == doctest::Approx(std::clamp(rows[i].weight * error, rows[i].lower, rows[i].upper)).epsilon(1e-7));
      }
    }
  }
}

// Dry friction and rocks are stiff rows with narrow bounds, more of them than degrees of freedom, and sides that are guessed wrongly. Each set has
// to settle. Impulses of stiff rows carry the rounding of speeds, w 1e-15 |v|, so they are checked as what they must be at the speed that is off
// by that much.
TEST_CASE("stiff rows with narrow bounds settle from any sides") {
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  RowSolver solver;
  RowSet rows;
  Eigen::VectorXd v;
  int most = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const int n = 6 + trial % 15;
    const int n_rows = 10 + trial % 60;
    const Problem problem(n, random);
    const auto& [mass, v_free] = problem;
    rows.clear();
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(n_rows, n);
    for (int i = 0; i < n_rows; ++i) {
      const int row = open_row(rows, jacobian, i, random);
      rows[row].weight = std::pow(10.0, 9 * uniform(random) - 1);
      rows[row].lower = i % 5 == 0 ? 0 : -std::pow(10.0, -5 * uniform(random));
      rows[row].upper = i % 5 == 0 ? std::numeric_limits<double>::infinity() : -rows[row].lower;
      rows[row].target = i % 4 == 0 ? 0.1 * normal(random) : 0;
      rows[row].side = static_cast<RowSide>(static_cast<int>(3 * uniform(random)) - 1);
      if (rows[row].side == RowSide::at_upper && std::isinf(rows[row].upper)) rows[row].side = RowSide::free;
    }
    const int before = solver.factorisations();
    REQUIRE(solver.solve(mass, v_free, rows, v));
    most = std::max(most, solver.factorisations() - before);
    const Eigen::VectorXd& f = solver.impulse();
    const double rounding = 1e-12 * (1 + v.cwiseAbs().maxCoeff() + v_free.cwiseAbs().maxCoeff());
    for (int i = 0; i < n_rows; ++i) {
      const double error = rows[i].target - jacobian.row(i).dot(v), w = rows[i].weight;
      CHECK(f[i] >= std::clamp(w * (error - rounding), rows[i].lower, rows[i].upper) - 1e-9);
      CHECK(f[i] <= std::clamp(w * (error + rounding), rows[i].lower, rows[i].upper) + 1e-9);
    }
  }
  MESSAGE("most factorisations: " << most);
}

TEST_CASE("a warm start at the solution needs one factorisation") {
  RowSet rows;
  RowSolver solver;
  Eigen::VectorXd v;
  const int row = rows.open();
  rows.add(0, 1);
  rows[row].weight = 1e6;
  rows[row].target = 5;
  rows[row].lower = -1;
  rows[row].upper = 1;  // saturates
  const Eigen::MatrixXd mass = Eigen::MatrixXd::Identity(2, 2);
  REQUIRE(solver.solve(mass, Eigen::VectorXd::Zero(2), rows, v));
  CHECK(v[0] == 1);
  CHECK(rows[row].side == RowSide::at_upper);
  const int before = solver.factorisations();
  REQUIRE(solver.solve(mass, Eigen::VectorXd::Zero(2), rows, v));
  CHECK(solver.factorisations() == before + 1);
}
