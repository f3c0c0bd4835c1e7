#include "physics/rows.hpp"

#include <algorithm>

namespace rille {

void RowSet::clear() {
  rows_.clear();
  index_.clear();
  value_.clear();
  wrenches_.clear();
}

void RowSet::add_outer(const Row& row, Eigen::MatrixXd& matrix) const {
  // Dofs ascend within a row, so the pairs below the diagonal are those with the later row index.
  for (int a = row.first; a < row.first + row.count; ++a) {
    const double scaled = row.weight * value_[a];
    double* column = matrix.col(index_[a]).data();
    for (int b = a; b < row.first + row.count; ++b) column[index_[b]] += scaled * value_[b];
  }
}

bool RowSolver::solve_on_set(const Eigen::MatrixXd& mass_matrix, const RowSet& rows) {
  ++factorisations_;
  stiffened_ = mass_matrix;
  change_.setZero(mass_matrix.rows());
  for (int i = 0; i < rows.size(); ++i) {
    const Row& row = rows[i];
    if (row.weight == 0) continue;
    if (row.side == RowSide::free) {
      rows.add_outer(row, stiffened_);
      rows.add_scaled(row, row.weight * residual_[i], change_);
    } else {
      rows.add_scaled(row, row.side == RowSide::at_lower ? row.lower : row.upper, change_);
    }
  }
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> factor(stiffened_);
  if (factor.info() != Eigen::Success) return false;
  factor.solveInPlace(change_);

  const auto n_hard = static_cast<Eigen::Index>(hard_.size());
  if (n_hard == 0) return true;
  response_.setZero(mass_matrix.rows(), n_hard);
  coupling_.resize(n_hard, n_hard);
  multiplier_.resize(n_hard);
  for (Eigen::Index k = 0; k < n_hard; ++k) {
    Eigen::VectorXd column = Eigen::VectorXd::Zero(mass_matrix.rows());
    rows.add_scaled(rows[hard_[k]], 1, column);
    factor.solveInPlace(column);
    response_.col(k) = column;
  }
  for (Eigen::Index k = 0; k < n_hard; ++k) {
    const Row& row = rows[hard_[k]];
    for (Eigen::Index l = 0; l < n_hard; ++l) coupling_(k, l) = rows.dot(row, response_.col(l));
    multiplier_[k] = residual_[hard_[k]] - rows.dot(row, change_);
  }
  const Eigen::LDLT<Eigen::MatrixXd> coupling_factor(coupling_);
  if (coupling_factor.info() != Eigen::Success) return false;
  multiplier_ = coupling_factor.solve(multiplier_).eval();
  change_ += response_ * multiplier_;
  return true;
}

bool RowSolver::update_sides(RowSet& rows, const Eigen::VectorXd& v_free, const Eigen::VectorXd& change) {
  // A stiff row turns the rounding of speeds into impulses; what lies within that is no reason to change the set, or it would cycle.
  const double rounding = 1e-14 * (v_free.lpNorm<Eigen::Infinity>() + change.lpNorm<Eigen::Infinity>());
  bool changed = false;
  for (int i = 0; i < rows.size(); ++i) {
    Row& row = rows[i];
    if (row.weight == 0) continue;
    if (row.lower == row.upper) {  // a given impulse
      impulse_[i] = row.lower;
      continue;
    }
    const double wanted = row.weight * (residual_[i] - rows.dot(row, change));
    const double slack = row.weight * rounding;
    RowSide side = row.side;
    if (row.upper - row.lower < 2 * slack) {  // bounds closer than rounding, nearly a given impulse: either will do
      if (side == RowSide::free) side = wanted < row.lower ? RowSide::at_lower : RowSide::at_upper;
      impulse_[i] = side == RowSide::at_lower ? row.lower : row.upper;
      changed = changed || side != row.side;
      row.side = side;
      continue;
    }
    if (side == RowSide::free) {
      if (wanted < row.lower - slack) side = RowSide::at_lower;
      if (wanted > row.upper + slack) side = RowSide::at_upper;
    } else if (wanted < row.lower - slack) {
      side = RowSide::at_lower;
    } else if (wanted > row.upper + slack) {
      side = RowSide::at_upper;
    } else if (side == RowSide::at_lower ? wanted > row.lower + slack : wanted < row.upper - slack) {
      side = RowSide::free;
    }
    impulse_[i] = std::clamp(wanted, row.lower, row.upper);
    changed = changed || side != row.side;
    row.side = side;
  }
  return changed;
}

double RowSolver::line_search(const Eigen::MatrixXd& mass_matrix, const RowSet& rows, const Eigen::VectorXd& from, const Eigen::VectorXd& direction) {
  const auto mass = mass_matrix.selfadjointView<Eigen::Lower>();
  const Eigen::VectorXd md = mass * direction;
  const double constant = md.dot(from), slope = md.dot(direction);
  struct Line {
    double wanted, fall, lower, upper, along;  // impulse wanted at 0, its decrease per unit, bounds, J d
  };
  std::vector<Line> lines;
  std::vector<double> kinks = {1.0};
  for (int i = 0; i < rows.size(); ++i) {
    const Row& row = rows[i];
    if (row.weight == 0) continue;
    const double along = rows.dot(row, direction);
    const Line line{row.weight * (residual_[i] - rows.dot(row, from)), row.weight * along, row.lower, row.upper, along};
    lines.push_back(line);
    if (line.fall == 0) continue;
    for (const double bound : {row.lower, row.upper})
      if (const double at = (line.wanted - bound) / line.fall; at > 0 && at < 1) kinks.push_back(at);
  }
  const auto derivative = [&](double at) {
    double sum = constant + at * slope;
    for (const Line& line : lines) sum -= std::clamp(line.wanted - at * line.fall, line.lower, line.upper) * line.along;
    return sum;
  };
  if (derivative(1) <= 0) return 1;
  // The derivative grows and is straight between kinks: the first kink where it is above 0, then a straight line.
  std::sort(kinks.begin(), kinks.end());
  const auto right = std::partition_point(kinks.begin(), kinks.end(), [&](double at) { return derivative(at) <= 0; });
  const double high = *right, low = right == kinks.begin() ? 0 : *(right - 1);
  const double at_low = derivative(low), at_high = derivative(high);
  return at_low >= 0 ? low : low + (high - low) * at_low / (at_low - at_high);
}

bool RowSolver::iterate(const Eigen::MatrixXd& mass_matrix, const Eigen::VectorXd& v_free, RowSet& rows, int most, bool search, bool& settled) {
  Eigen::VectorXd at;  // meets the hard rows from the first full step on, and so does every point on the way to another solution
  settled = false;
  for (int k = 0; k < most; ++k) {
    if (!solve_on_set(mass_matrix, rows)) return false;
    settled = !update_sides(rows, v_free, change_);
    if (settled) return true;
    if (!search) continue;
    if (k == 0) {
      at = change_;
    } else {
      const Eigen::VectorXd direction = change_ - at;
      if (direction.lpNorm<Eigen::Infinity>() < 1e-13 * (v_free.lpNorm<Eigen::Infinity>() + at.lpNorm<Eigen::Infinity>())) {
        settled = true;  // no way left to go but rounding
        return true;
      }
      at += line_search(mass_matrix, rows, at, direction) * direction;
      update_sides(rows, v_free, at);
    }
  }
  return true;
}

bool RowSolver::solve(const Eigen::MatrixXd& mass_matrix, const Eigen::VectorXd& v_free, RowSet& rows,
                      Eigen::VectorXd& v) {
  constexpr int kFullSteps = 3, kSearchedSteps = 60;
  constexpr double kSoftest = 10, kStiffer = 10;  // [kg] largest weight of the first of the softer problems; their ratio
  const int n_rows = rows.size();
  residual_.resize(n_rows);
  impulse_.setZero(n_rows);
  hard_.clear();
  for (int i = 0; i < n_rows; ++i) {
    residual_[i] = rows[i].target - rows.dot(rows[i], v_free);
    if (rows[i].weight == 0) hard_.push_back(i);
    if (rows[i].lower == rows[i].upper) rows[i].side = RowSide::at_lower;
  }

  bool settled = false;
  if (!iterate(mass_matrix, v_free, rows, kFullSteps, false, settled)) return false;
  if (!settled && !iterate(mass_matrix, v_free, rows, kSearchedSteps, true, settled)) return false;
  if (!settled) {
    // Stiff rows are free in a narrow band of speeds only, and the search may zigzag between two of them. Softer rows have wide bands:
    // from their solution to a stiffer one it is a short way.
    std::vector<double> weights(static_cast<std::size_t>(n_rows));
    double stiffest = 0;
    for (int i = 0; i < n_rows; ++i) stiffest = std::max(stiffest, weights[static_cast<std::size_t>(i)] = rows[i].weight);
    for (double most = kSoftest; most < kStiffer * stiffest; most *= kStiffer) {
      for (int i = 0; i < n_rows; ++i) rows[i].weight = std::min(weights[static_cast<std::size_t>(i)], most);
      if (!iterate(mass_matrix, v_free, rows, kSearchedSteps, true, settled)) return false;
    }
  }
  for (std::size_t k = 0; k < hard_.size(); ++k) impulse_[hard_[k]] = multiplier_[static_cast<Eigen::Index>(k)];
  v = v_free + change_;
  return settled;
}

}  // namespace rille
