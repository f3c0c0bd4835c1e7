#include "terrain/radial_stamp.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <stdexcept>
#include <thread>

#include "model/error.hpp"

namespace rille {
namespace {

using Box = RadialForms::Box;
using Cell = RadialShapes::Cell;

constexpr std::int64_t kBlock = 256;     // rows and columns of a block: its heights stay in the second-level cache
constexpr int kChunk = 128;              // columns worked on at once: fits the first-level cache
constexpr double kFar = 1LL << 40;       // boxes are cut off there, far beyond the largest window
constexpr double kLargestEntry = 1e12;   // of M: a form a million million times smaller than a cell
constexpr double kSmallestDet = 1e-24;   // of M: a form a million million cells wide

Box meet(const Box& a, const Box& b) {
  return {std::max(a.row0, b.row0), std::min(a.row1, b.row1), std::max(a.column0, b.column0), std::min(a.column1, b.column1)};
}

bool overlap(const Box& a, const Box& b) {
  return a.row0 < b.row1 && b.row0 < a.row1 && a.column0 < b.column1 && b.column0 < a.column1;
}

std::int64_t whole(double value) { return static_cast<std::int64_t>(std::clamp(value, -kFar, kFar)); }

Box box_of(const RadialForm& f) {
  const double det = std::abs(f.u_column * f.v_row - f.u_row * f.v_column);
  const double half_columns = std::hypot(f.u_row, f.v_row) / det, half_rows = std::hypot(f.u_column, f.v_column) / det;
  return {whole(std::floor(f.row - half_rows)), whole(std::ceil(f.row + half_rows)) + 1, whole(std::floor(f.column - half_columns)),
          whole(std::ceil(f.column + half_columns)) + 1};
}

void require_sound(const RadialForm& f, std::size_t k) {
  const auto require_finite = [k](double value, const char* what) {
    if (!std::isfinite(value))
      throw InputRefused(fmt::format("{} of form {} of the population is {}; it must be finite", what, k, value));
  };
  require_finite(f.column, "the column");
  require_finite(f.row, "the row");
  require_finite(f.amplitude, "the amplitude");
  require_finite(f.state, "the state");
  if (f.state < 0) throw InputRefused(fmt::format("the state of form {} of the population is {}; it must be at least 0", k, f.state));
  for (const double entry : {f.u_column, f.u_row, f.v_column, f.v_row})
    if (!(std::abs(entry) <= kLargestEntry))
      throw InputRefused(fmt::format("form {} of the population is infinitely small against the posting: its matrix holds {}", k, entry));
  if (!(std::abs(f.u_column * f.v_row - f.u_row * f.v_column) >= kSmallestDet))
    throw InputRefused(fmt::format("form {} of the population is infinitely large against the posting: its matrix is singular", k));
}

// A form's shape as a sum of the shapes of neighbouring states: the cubic of Lagrange in the state, times the amplitude. Fewer states, lower
// degree. One row where the state is one of the family.
struct Mixed {
  std::array<const Cell*, 4> rows{};
  std::array<double, 4> weights{};  // [m]
  int n_rows = 0;
};

Mixed mix(const RadialShapes& shapes, const RadialForm& form) {
  const auto n_states = static_cast<std::ptrdiff_t>(shapes.n_states()), n = std::min<std::ptrdiff_t>(4, n_states);
  const auto nearest = static_cast<std::ptrdiff_t>(form.state);
  if (static_cast<double>(nearest) == form.state) return {{shapes.cells(static_cast<std::size_t>(nearest))}, {form.amplitude}, 1};
  const std::ptrdiff_t first = std::clamp<std::ptrdiff_t>(nearest - 1, 0, n_states - n);
  const double x = form.state - static_cast<double>(first);
  Mixed mixed;
  mixed.rows.fill(shapes.cells(static_cast<std::size_t>(first)));
  mixed.n_rows = 4;
  for (std::ptrdiff_t k = 0; k < n; ++k) {
    double weight = form.amplitude;
    for (std::ptrdiff_t other = 0; other < n; ++other)
      if (other != k) weight *= (x - static_cast<double>(other)) / static_cast<double>(k - other);
    mixed.rows[static_cast<std::size_t>(k)] = shapes.cells(static_cast<std::size_t>(first + k));
    mixed.weights[static_cast<std::size_t>(k)] = weight;
  }
  return mixed;
}

// Positions in the table of `count` columns from `start` on, in a row.
void positions(std::span<const RadialShapes::Segment> segments, const RadialForm& form, double row, double start, int count, double* position) {
  const double u0 = form.u_row * (row - form.row), v0 = form.v_row * (row - form.row);
  double r[kChunk];
  for (int j = 0; j < count; ++j) {
    const double column = (start + j) - form.column;
    const double u = form.u_column * column + u0, v = form.v_column * column + v0;
    r[j] = std::sqrt(u * u + v * v);
  }
  for (int j = 0; j < count; ++j) position[j] = r[j] * segments[0].density;
  for (const auto& [knot, density, first_cell] : segments.subspan(1))
    for (int j = 0; j < count; ++j) position[j] = r[j] >= knot ? (r[j] - knot) * density + first_cell : position[j];
}

template <StampMode mode, int n_rows>
void look_up_rows(const Mixed& shape, const double* position, int count, double* target) {
  for (int j = 0; j < count; ++j) {
    const int k = static_cast<int>(position[j]);
    const double part = position[j] - k;
    double height = 0;
    for (std::size_t row = 0; row < n_rows; ++row) {
      const Cell& cell = shape.rows[row][k];
      height += shape.weights[row] * (cell.value + part * cell.rise);
    }
    if constexpr (mode == StampMode::add) target[j] += height;
    else target[j] = std::max(target[j], height);
  }
}

template <StampMode mode>
void look_up(const Mixed& shape, const double* position, int count, double* target) {
  if (shape.n_rows == 1) look_up_rows<mode, 1>(shape, position, count, target);
  else look_up_rows<mode, 4>(shape, position, count, target);
}

// `target`: the height at the first row and column of `part`, which is what the form's box and the block have in common.
template <StampMode mode>
void stamp_form(const RadialShapes& shapes, const RadialForm& form, const Box& part, double* target, std::ptrdiff_t stride) {
  const Mixed shape = mix(shapes, form);
  const double det = form.u_column * form.v_row - form.u_row * form.v_column;
  const double square = form.u_column * form.u_column + form.v_column * form.v_column;
  const double skew = (form.u_column * form.u_row + form.v_column * form.v_row) / square;
  double position[kChunk];
  for (std::int64_t i = part.row0; i < part.row1; ++i, target += stride) {
    // r^2 <= 1 is a quadratic in the column; its roots bound the chord. A column more on each side costs nothing: there the table is empty.
    const double row = static_cast<double>(i) - form.row;
    const double inside = square - det * row * (det * row);
    if (inside < 0) continue;
    const double middle = form.column - skew * row, half = std::sqrt(inside) / square;
    const auto begin = static_cast<std::int64_t>(std::clamp(std::floor(middle - half), double(part.column0), double(part.column1)));
    const auto end = static_cast<std::int64_t>(std::clamp(std::ceil(middle + half) + 1, double(part.column0), double(part.column1)));
    for (std::int64_t j = begin; j < end; j += kChunk) {
      const int count = static_cast<int>(std::min<std::int64_t>(kChunk, end - j));
      positions(shapes.segments(), form, static_cast<double>(i), static_cast<double>(j), count, position);
      look_up<mode>(shape, position, count, target + (j - part.column0));
    }
  }
}

template <StampMode mode>
void stamp_forms(const RadialShapes& shapes, const RadialForms& forms, const std::vector<std::size_t>& candidates, const Box& block,
                 double* heights, std::ptrdiff_t stride) {
  for (const std::size_t k : candidates) {
    if (!overlap(forms.box(k), block)) continue;
    const Box part = meet(forms.box(k), block);
    stamp_form<mode>(shapes, forms.form(k), part, heights + (part.row0 - block.row0) * stride + (part.column0 - block.column0), stride);
  }
}

// `highest`: heights to work in, as many as a block has at most.
void stamp_block(const RadialShapes& shapes, const RadialForms& forms, const std::vector<std::size_t>& candidates, const HeightWindow& window,
                 const Box& block, StampMode mode, std::vector<double>& highest) {
  double* heights = window.heights + (block.row0 - window.row0) * window.stride + (block.column0 - window.column0);
  if (mode == StampMode::add) return stamp_forms<StampMode::add>(shapes, forms, candidates, block, heights, window.stride);
  const std::int64_t n_rows = block.row1 - block.row0, n_columns = block.column1 - block.column0;
  std::fill_n(highest.begin(), n_rows * n_columns, 0.0);
  stamp_forms<StampMode::highest>(shapes, forms, candidates, block, highest.data(), n_columns);
  for (std::int64_t i = 0; i < n_rows; ++i)
    for (std::int64_t j = 0; j < n_columns; ++j) heights[i * window.stride + j] += highest[static_cast<std::size_t>(i * n_columns + j)];
}

template <StampMode mode>
double at_point(const RadialShapes& shapes, const RadialForms& forms, const std::vector<std::size_t>& candidates, double column, double row) {
  double height = 0, position;
  for (const std::size_t k : candidates) {
    const Box& box = forms.box(k);
    const bool near = row >= double(box.row0) && row < double(box.row1) && column >= double(box.column0) && column < double(box.column1);
    if (!near) continue;
    positions(shapes.segments(), forms.form(k), row, column, 1, &position);
    look_up<mode>(mix(shapes, forms.form(k)), &position, 1, &height);
  }
  return height;
}

std::vector<std::size_t> overlapping(const RadialForms& forms, const Box& box) {
  std::vector<std::size_t> found;
  for (std::size_t k = 0; k < forms.size(); ++k)
    if (overlap(forms.box(k), box)) found.push_back(k);
  return found;
}

// Whole rows and columns around points; those that are not numbers lie nowhere.
Box around(std::span<const double> column, std::span<const double> row) {
  Box box{whole(kFar), whole(-kFar), whole(kFar), whole(-kFar)};
  for (std::size_t k = 0; k < row.size(); ++k) {
    if (std::isnan(column[k]) || std::isnan(row[k])) continue;
    box.row0 = std::min(box.row0, whole(std::floor(row[k])));
    box.row1 = std::max(box.row1, whole(std::floor(row[k])) + 1);
    box.column0 = std::min(box.column0, whole(std::floor(column[k])));
    box.column1 = std::max(box.column1, whole(std::floor(column[k])) + 1);
  }
  return box;
}

void require_states(const RadialShapes& shapes, const RadialForms& forms) {
  if (forms.highest_state() > static_cast<double>(shapes.n_states() - 1))
    throw std::invalid_argument(fmt::format("a form has state {}; the family ends at {}", forms.highest_state(), shapes.n_states() - 1));
}

}  // namespace

RadialShapes::RadialShapes(std::span<const double> knots, std::span<const std::int64_t> counts, std::span<const double> cells,
                           std::size_t n_states)
    : n_states_(n_states), row_(0) {
  if (counts.empty() || knots.size() != counts.size() + 1) throw std::invalid_argument("shapes need one knot more than counts of cells");
  if (knots.front() != 0 || knots.back() != 1) throw std::invalid_argument("the knots of shapes must begin at 0 and end at 1");
  std::size_t n_cells = 0;
  for (std::size_t s = 0; s < counts.size(); ++s) {
    if (!(knots[s + 1] > knots[s])) throw std::invalid_argument("the knots of shapes must grow");
    if (counts[s] < 1 || counts[s] > 1 << 20) throw std::invalid_argument("the cells between two knots of shapes must be 1 to 2^20");
    segments_.push_back({knots[s], static_cast<double>(counts[s]) / (knots[s + 1] - knots[s]), static_cast<double>(n_cells)});
    n_cells += static_cast<std::size_t>(counts[s]);
  }
  if (n_cells > 1 << 20) throw std::invalid_argument("shapes have more than 2^20 cells");
  segments_.push_back({1.0, 0.0, static_cast<double>(n_cells)});
  if (n_states < 1 || cells.size() != n_states * n_cells * 2)
    throw std::invalid_argument(
        fmt::format("shapes of {} states and {} cells need {} numbers, not {}", n_states, n_cells, n_states * n_cells * 2, cells.size()));
  row_ = n_cells + 1;
  cells_.resize(n_states * row_, Cell{0, 0});
  for (std::size_t s = 0; s < n_states; ++s)
    for (std::size_t k = 0; k < n_cells; ++k) {
      const Cell cell{cells[2 * (s * n_cells + k)], cells[2 * (s * n_cells + k) + 1]};
      if (!std::isfinite(cell.value) || !std::isfinite(cell.rise))
        throw InputRefused(fmt::format("the shape of a radial landform is {} in cell {} of {} and rises by {}, in state {} of {}; it must be finite",
                                       cell.value, k, n_cells, cell.rise, s, n_states));
      cells_[s * row_ + k] = cell;
    }
}

RadialForms::RadialForms(std::vector<RadialForm> forms) : forms_(std::move(forms)) {
  boxes_.reserve(forms_.size());
  for (std::size_t k = 0; k < forms_.size(); ++k) {
    require_sound(forms_[k], k);
    boxes_.push_back(box_of(forms_[k]));
    highest_state_ = std::max(highest_state_, forms_[k].state);
  }
}

void stamp_radial(const RadialShapes& shapes, const RadialForms& forms, const HeightWindow& window, StampMode mode, int threads) {
  constexpr std::int64_t kLargest = 1 << 30;
  const auto beyond = [](std::int64_t value) { return value < -kLargest || value > kLargest; };
  if (beyond(window.row0) || beyond(window.column0) || beyond(window.n_rows) || beyond(window.n_columns))
    throw std::invalid_argument("a window must lie within 2^30 rows and columns");
  if (threads < 1 || threads > 256) throw std::invalid_argument(fmt::format("threads is {}; it must be 1 to 256", threads));
  require_states(shapes, forms);
  const Box all{window.row0, window.row0 + window.n_rows, window.column0, window.column0 + window.n_columns};
  // To look at 100 000 boxes takes a tenth of a millisecond: an index would gain nothing.
  const std::vector<std::size_t> candidates = overlapping(forms, all);
  if (candidates.empty()) return;
  const std::int64_t down = (window.n_rows + kBlock - 1) / kBlock, across = (window.n_columns + kBlock - 1) / kBlock;
  std::atomic<std::int64_t> next = 0;
  const std::int64_t n_threads = std::min<std::int64_t>(threads, down * across);
  std::vector<std::vector<double>> scratch(static_cast<std::size_t>(n_threads));
  if (mode == StampMode::highest)
    for (auto& heights : scratch)
      heights.resize(static_cast<std::size_t>(std::min(kBlock, window.n_rows) * std::min(kBlock, window.n_columns)));
  const auto work = [&](std::int64_t t) {
    for (std::int64_t b = next++; b < down * across; b = next++) {
      const std::int64_t row0 = all.row0 + b / across * kBlock, column0 = all.column0 + b % across * kBlock;
      stamp_block(shapes, forms, candidates, window, meet({row0, row0 + kBlock, column0, column0 + kBlock}, all), mode,
                  scratch[static_cast<std::size_t>(t)]);
    }
  };
  std::vector<std::jthread> others;
  for (std::int64_t t = 1; t < n_threads; ++t) others.emplace_back(work, t);
  if (n_threads > 0) work(0);
}

void stamp_points(const RadialShapes& shapes, const RadialForms& forms, std::span<const double> column, std::span<const double> row,
                  std::span<double> heights, StampMode mode) {
  if (row.size() != column.size() || heights.size() != column.size())
    throw std::invalid_argument("each point needs a column, a row and a height");
  require_states(shapes, forms);
  // Points of a ring or a line lie together: what is far from some of them is looked at once for all.
  constexpr std::size_t kTogether = 64;
  for (std::size_t begin = 0; begin < heights.size(); begin += kTogether) {
    const std::size_t n = std::min(kTogether, heights.size() - begin);
    const auto candidates = overlapping(forms, around(column.subspan(begin, n), row.subspan(begin, n)));
    for (std::size_t k = begin; k < begin + n; ++k)
      heights[k] += mode == StampMode::add ? at_point<StampMode::add>(shapes, forms, candidates, column[k], row[k])
                                           : at_point<StampMode::highest>(shapes, forms, candidates, column[k], row[k]);
  }
}

}  // namespace rille
