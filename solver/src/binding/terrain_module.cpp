// Python module rille._terrain: populations of radial landforms stamped into heights, in place; the interpreter lock is released meanwhile.

#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <stdexcept>
#include <vector>

#include "model/error.hpp"
#include "terrain/radial_stamp.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using Vector = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Counts = nb::ndarray<const std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Cells = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Matrices = nb::ndarray<const double, nb::shape<-1, 2, 2>, nb::c_contig, nb::device::cpu>;
using Points = nb::ndarray<double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Heights = nb::ndarray<double, nb::ndim<2>, nb::device::cpu>;

rille::RadialShapes shapes_from(const Vector& knots, const Counts& counts, const Cells& cells) {
  if (cells.shape(2) != 2) throw std::invalid_argument("cells must have the shape (n_states, n_cells, 2)");
  return {{knots.data(), knots.size()}, {counts.data(), counts.size()}, {cells.data(), cells.size()}, cells.shape(0)};
}

rille::RadialForms forms_from(const Vector& column, const Vector& row, const Matrices& matrix, const Vector& amplitude, const Vector& state) {
  const std::size_t n = column.size();
  if (row.size() != n || matrix.shape(0) != n || amplitude.size() != n || state.size() != n)
    throw std::invalid_argument(fmt::format("{} columns, {} rows, {} matrices, {} amplitudes and {} states: there must be one per form", n,
                                            row.size(), matrix.shape(0), amplitude.size(), state.size()));
  std::vector<rille::RadialForm> forms(n);
  for (std::size_t k = 0; k < n; ++k) {
    const double* m = matrix.data() + 4 * k;
    forms[k] = {column.data()[k], row.data()[k], m[0], m[1], m[2], m[3], amplitude.data()[k], state.data()[k]};
  }
  return rille::RadialForms(std::move(forms));
}

rille::HeightWindow window_of(const Heights& heights, std::int64_t row0, std::int64_t column0) {
  const auto n_rows = static_cast<std::int64_t>(heights.shape(0)), n_columns = static_cast<std::int64_t>(heights.shape(1));
  if ((n_columns > 1 && heights.stride(1) != 1) || (n_rows > 1 && heights.stride(0) < n_columns))
    throw std::invalid_argument("the values of a row of heights must lie side by side, and rows one after the other");
  return {heights.data(), n_rows > 1 ? heights.stride(0) : n_columns, row0, column0, n_rows, n_columns};
}

rille::StampMode mode_of(bool highest) { return highest ? rille::StampMode::highest : rille::StampMode::add; }

}  // namespace

NB_MODULE(_terrain, module) {
  module.doc() = "Stamping of many radial landforms.";
  nb::register_exception_translator([](const std::exception_ptr& pointer, void*) {
    try {
      std::rethrow_exception(pointer);
    } catch (const rille::InputRefused& error) {
      nb::object type = nb::module_::import_("rille.model").attr("InputRefused");
      PyErr_SetString(type.ptr(), error.what());
    }
  });

  nb::class_<rille::RadialShapes>(module, "RadialShapes",
                                  "Shapes over r in [0, 1), tabulated at equally spaced states; straight in each cell, empty for r >= 1.\n\n"
                                  "knots (n + 1,): from 0 to 1, where shapes have kinks. counts (n,): equal cells between neighbouring knots.\n"
                                  "cells (n_states, n_cells, 2): value at the start of a cell and rise over it.")
      .def("__init__", [](rille::RadialShapes* self, const Vector& knots, const Counts& counts,
                          const Cells& cells) { new (self) rille::RadialShapes(shapes_from(knots, counts, cells)); },
           "knots"_a, "counts"_a, "cells"_a)
      .def_prop_ro("n_states", &rille::RadialShapes::n_states);

  nb::class_<rille::RadialForms>(module, "RadialForms",
                                 "n forms in the order in which they are added.\n\n"
                                 "column, row (n,): of the centres, in the whole grid, with fractions. matrix (n, 2, 2): r = |M (dcolumn, drow)|.\n"
                                 "amplitude (n,) [m]. state (n,): index into the family of shapes, with a fraction.\n"
                                 "Raises rille.model.InputRefused where a number is not finite or a matrix is singular.")
      .def("__init__", [](rille::RadialForms* self, const Vector& column, const Vector& row, const Matrices& matrix, const Vector& amplitude,
                          const Vector& state) { new (self) rille::RadialForms(forms_from(column, row, matrix, amplitude, state)); },
           "column"_a, "row"_a, "matrix"_a, "amplitude"_a, "state"_a)
      .def("__len__", &rille::RadialForms::size);

  module.def(
      "stamp",
      [](const rille::RadialShapes& shapes, const rille::RadialForms& forms, const Heights& heights, std::int64_t row0, std::int64_t column0,
         bool highest, int threads) {
        const rille::HeightWindow window = window_of(heights, row0, column0);
        nb::gil_scoped_release release;
        rille::stamp_radial(shapes, forms, window, mode_of(highest), threads);
      },
      "shapes"_a, "forms"_a, "heights"_a.noconvert(), "row0"_a, "column0"_a, "highest"_a, "threads"_a,
      "Add the forms to heights (n_rows, n_columns) [m], in place: the window of the grid that begins at row0, column0.\n\n"
      "highest: the highest of the forms is added, where it is above zero. The same bytes for every tiling and every number of threads.\n"
      "Raises ValueError for a state beyond the family, rows that do not lie side by side, or threads outside 1 to 256.");

  module.def(
      "stamp_points",
      [](const rille::RadialShapes& shapes, const rille::RadialForms& forms, const Vector& column, const Vector& row, const Points& heights,
         bool highest) {
        nb::gil_scoped_release release;
        rille::stamp_points(shapes, forms, {column.data(), column.size()}, {row.data(), row.size()}, {heights.data(), heights.size()},
                            mode_of(highest));
      },
      "shapes"_a, "forms"_a, "column"_a, "row"_a, "heights"_a.noconvert(), "highest"_a,
      "Add the forms to heights (n,) [m] of points (column, row) anywhere, in place. Raises ValueError where sizes differ.");
}
