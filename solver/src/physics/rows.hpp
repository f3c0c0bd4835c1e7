// Constraint rows and their direct solution.
//
// The generalised velocity v of the next step minimises kinetic distance to the unconstrained velocity v_free under rows
//   f_i = clamp(w_i (target_i - J_i v), lower_i, upper_i)          soft row, w_i > 0: motor, limit, soil, friction
//   J_i v = target_i                                               hard row: differential, gear
//   M (v - v_free) = Sum_i J_i^T f_i                               f_i: impulse of the step
// M is positive definite, so the solution exists and is unique: v minimises a strongly convex function that is piecewise quadratic,
//   1/2 (v - v_free)^T M (v - v_free) + Sum psi_i(J_i v),   psi_i' = -f_i.
// It is found by Newton's method, which here is an active set: rows that are not clamped add w J^T J to M, clamped ones a constant impulse; one
// Cholesky factorisation per change of the set, usually one per step. Where full steps do not settle, exact line searches make the method
// converge from anywhere (Sun 1997, "On piecewise quadratic Newton and trust region problems"); where these creep, from softer rows to stiffer ones.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <limits>
#include <vector>

namespace rille {

enum class RowSide : signed char { at_lower = -1, free = 0, at_upper = 1 };

// Where the energy that a row moves is booked.
enum class RowKind : signed char { drive, joint, coupling, soil, contact, external };

struct Row {
  int first = 0;      // first element in the pools of RowSet
  int count = 0;      // number of elements
  double weight = 0;  // [impulse per speed] w; 0 marks a hard row
                      // (lower == upper marks a given impulse; its weight only has to be positive)
  double target = 0;  // [speed]
  double lower = -std::numeric_limits<double>::infinity();  // [impulse]
  double upper = std::numeric_limits<double>::infinity();   // [impulse]
  RowSide side = RowSide::free;
  RowKind kind = RowKind::joint;
};

// Weight of a row of a joint that is meant to be rigid (limit, servo, dry friction at rest), as a multiple of the joint's own inertia: its
// speed error is effort h / weight, about 1e-8 rad/s, while the matrix stays well conditioned.
constexpr double kRigidity = 1e7;

// What a unit impulse of a row does to one body: force and torque, at a point.
struct RowWrench {
  int row = 0;
  int body = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    // [m] in W
  Eigen::Vector3d linear = Eigen::Vector3d::Zero();   // [-]
  Eigen::Vector3d angular = Eigen::Vector3d::Zero();  // [-]
};

// Rows with their sparse Jacobians in two pools; cleared and refilled at every step without allocating.
class RowSet {
 public:
  void clear();

  // Starts a row and returns its index; its Jacobian follows by add().
  int open(RowKind kind = RowKind::joint) {
    Row& row = rows_.emplace_back();
    row.kind = kind;
    row.first = static_cast<int>(index_.size());
    return size() - 1;
  }
  void add(int dof, double value) {
    index_.push_back(dof);
    value_.push_back(value);
    ++rows_.back().count;
  }
  // Remembers the open row's effect on a body, for the reactions in the joints.
  void add_wrench(const RowWrench& wrench) { wrenches_.push_back(wrench); }
  const std::vector<RowWrench>& wrenches() const { return wrenches_; }

  Row& operator[](int row) { return rows_[static_cast<std::size_t>(row)]; }
  const Row& operator[](int row) const { return rows_[static_cast<std::size_t>(row)]; }
  int size() const { return static_cast<int>(rows_.size()); }

  // J v
  double dot(const Row& row, const Eigen::VectorXd& v) const {
    double sum = 0;
    for (int k = row.first; k < row.first + row.count; ++k) sum += value_[k] * v[index_[k]];
    return sum;
  }
  // v += scale J^T
  void add_scaled(const Row& row, double scale, Eigen::VectorXd& v) const {
    for (int k = row.first; k < row.first + row.count; ++k) v[index_[k]] += scale * value_[k];
  }
  void add_outer(const Row& row, Eigen::MatrixXd& matrix) const;  // lower triangle of matrix += w J^T J

 private:
  std::vector<Row> rows_;
  std::vector<int> index_;
  std::vector<double> value_;
  std::vector<RowWrench> wrenches_;
};

class RowSolver {
 public:
  // Solves for v, starting from the sides that the rows carry and leaving them at the solution.
  // mass_matrix: (n, n), lower triangle is read. Returns false if the set did not settle or a matrix was not positive definite.
  bool solve(const Eigen::MatrixXd& mass_matrix, const Eigen::VectorXd& v_free, RowSet& rows, Eigen::VectorXd& v);

  // Impulse of each row of the last solution.
  const Eigen::VectorXd& impulse() const { return impulse_; }
  int factorisations() const { return factorisations_; }

 private:
  bool solve_on_set(const Eigen::MatrixXd& mass_matrix, const RowSet& rows);
  // At most so many Newton steps, full ones or with a line search, from the rows' sides. Returns false if a matrix was not positive definite.
  bool iterate(const Eigen::MatrixXd& mass_matrix, const Eigen::VectorXd& v_free, RowSet& rows, int most, bool search, bool& settled);
  // Sides and impulses of the rows at a change of velocity; whether a side changed.
  bool update_sides(RowSet& rows, const Eigen::VectorXd& v_free, const Eigen::VectorXd& change);
  // Where on the way from a change of velocity along a direction, in (0, 1], the function is least.
  double line_search(const Eigen::MatrixXd& mass_matrix, const RowSet& rows, const Eigen::VectorXd& from, const Eigen::VectorXd& direction);

  Eigen::MatrixXd stiffened_;   // M + Sum w J^T J over the free rows, overwritten by its factor
  Eigen::VectorXd change_;      // v - v_free
  Eigen::VectorXd residual_;    // target - J v_free
  Eigen::VectorXd impulse_;
  Eigen::MatrixXd response_;    // (n, hard rows): stiffened^-1 J^T
  Eigen::MatrixXd coupling_;    // (hard rows, hard rows): J stiffened^-1 J^T
  Eigen::VectorXd multiplier_;  // impulses of the hard rows
  std::vector<int> hard_;
  int factorisations_ = 0;
};

}  // namespace rille
