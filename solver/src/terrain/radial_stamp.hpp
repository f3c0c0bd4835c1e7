// Many radial landforms stamped into a window of a grid of heights.
//   z(i, j) = amplitude * shape(r, state),   r = |M (j - column, i - row)|,   nothing where r >= 1
// Rows and columns count in the whole grid, and blocks of the window are independent of each other: every tiling and every number of threads
// gives the same bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace rille {

// A family of shapes over r in [0, 1), tabulated at equally spaced states: in each cell of r a straight line. Between the knots, which are
// where the shapes have kinks or jumps, cells are equally wide.
class RadialShapes {
 public:
  // knots: 0 = k_0 < k_1 < ... = 1. counts: cells between neighbouring knots. cells: value at the start and rise over the cell
  // (n_states x n_cells x 2). Throws std::invalid_argument for sizes that do not fit, InputRefused for numbers that are not finite.
  RadialShapes(std::span<const double> knots, std::span<const std::int64_t> counts, std::span<const double> cells, std::size_t n_states);

  struct Segment {
    double knot;     // where it begins
    double density;  // [cells per r]
    double first;    // index of its first cell
  };
  struct Cell {
    double value, rise;
  };

  std::span<const Segment> segments() const { return segments_; }
  std::size_t n_states() const { return n_states_; }
  const Cell* cells(std::size_t state) const { return cells_.data() + state * row_; }

 private:
  std::vector<Segment> segments_;  // the last is [1, oo) with the empty cell
  std::vector<Cell> cells_;        // n_states x row_
  std::size_t n_states_, row_;     // row_: cells of a state, with an empty one at the end for r >= 1
};

struct RadialForm {
  double column, row;                       // of the centre
  double u_column, u_row, v_column, v_row;  // M: r = |(u, v)|, (u, v) = M (j - column, i - row)
  double amplitude;                         // [m]
  double state;                             // index into the family of shapes, with a fraction
};

// Forms in the order in which they are added.
class RadialForms {
 public:
  // Throws InputRefused for a number that is not finite, a negative state, or a matrix that is singular or out of all scale.
  explicit RadialForms(std::vector<RadialForm> forms);

  struct Box {
    std::int64_t row0, row1, column0, column1;  // [begin, end)
  };

  std::size_t size() const { return forms_.size(); }
  double highest_state() const { return highest_state_; }
  const RadialForm& form(std::size_t k) const { return forms_[k]; }
  const Box& box(std::size_t k) const { return boxes_[k]; }

 private:
  std::vector<RadialForm> forms_;
  std::vector<Box> boxes_;
  double highest_state_ = 0;
};

// A window of the grid: value (i, j) of the whole grid is heights[(i - row0) * stride + (j - column0)].
struct HeightWindow {
  double* heights;  // [m]
  std::ptrdiff_t stride;
  std::int64_t row0, column0, n_rows, n_columns;
};

enum class StampMode {
  add,      // forms are added one after the other
  highest,  // the highest of the forms, where it is above zero, is added
};

// Throws std::invalid_argument if a form's state lies beyond the family, for a window beyond 2^30, or threads outside 1 to 256.
void stamp_radial(const RadialShapes& shapes, const RadialForms& forms, const HeightWindow& window, StampMode mode, int threads);

// The same at points (column, row) anywhere, added to their heights (n) [m]. Throws std::invalid_argument where sizes differ, and as above.
void stamp_points(const RadialShapes& shapes, const RadialForms& forms, std::span<const double> column, std::span<const double> row,
                  std::span<double> heights, StampMode mode);

}  // namespace rille
