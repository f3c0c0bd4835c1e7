// Stamped forms must equal their formula point by point, and no tiling or number of threads may change a bit.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <stdexcept>

#include "model/error.hpp"
#include "terrain/radial_stamp.hpp"

using namespace rille;

namespace {

constexpr std::int64_t kRows = 300, kColumns = 420;

// Of state s the shape 1 - r to the knot at 0.3, from there 0.5 + s with a step at 1: what a table of straight lines holds exactly.
double shape(double r, double state) { return r >= 1 ? 0 : r >= 0.3 ? 0.5 + state : 1 - r; }

RadialShapes shapes() {
  const double knots[] = {0, 0.3, 1};
  const std::int64_t counts[] = {3, 2};
  std::vector<double> cells;
  for (int state = 0; state < 5; ++state) {
    for (int k = 0; k < 3; ++k) cells.insert(cells.end(), {1 - 0.1 * k, -0.1});
    for (int k = 0; k < 2; ++k) cells.insert(cells.end(), {0.5 + state, 0});
  }
  return {knots, counts, cells, 5};
}

RadialForm form(double column, double row, double half_columns, double half_rows, double turn, double state) {
  const double c = std::cos(turn), s = std::sin(turn);
  return {column, row, c / half_columns, s / half_columns, -s / half_rows, c / half_rows, 2 - state, state};
}

std::vector<RadialForm> some(int n) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-50, 470), turn(-4, 4), state(0, 4), size(-2, 5);
  std::vector<RadialForm> made;
  for (int k = 0; k < n; ++k) {
    const double half = std::exp(size(random));
    made.push_back(form(place(random), place(random), half, half * (k % 3 ? 1 : 0.2), turn(random), k % 2 ? state(random) : 2));
  }
  return made;
}

double distance(const RadialForm& f, double column, double row) {
  const double dc = column - f.column, dr = row - f.row;
  return std::hypot(f.u_column * dc + f.u_row * dr, f.v_column * dc + f.v_row * dr);
}

std::vector<double> stamped(const RadialForms& forms, StampMode mode, std::int64_t tile, int threads) {
  std::vector<double> heights(kRows * kColumns, 1.5);
  const RadialShapes table = shapes();
  for (std::int64_t i = 0; i < kRows; i += tile)
    for (std::int64_t j = 0; j < kColumns; j += tile)
      stamp_radial(table, forms,
                   {&heights[static_cast<std::size_t>(i * kColumns + j)], kColumns, i, j, std::min(tile, kRows - i), std::min(tile, kColumns - j)},
                   mode, threads);
  return heights;
}

bool same(const std::vector<double>& a, const std::vector<double>& b) { return std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0; }

}  // namespace

TEST_CASE("stamped forms equal their formula at every point") {
  const std::vector<RadialForm> made = some(60);
  const std::vector<double> added = stamped(RadialForms(made), StampMode::add, 1000, 1);
  const std::vector<double> highest = stamped(RadialForms(made), StampMode::highest, 1000, 1);
  int inside = 0;
  for (std::int64_t i = 0; i < kRows; ++i)
    for (std::int64_t j = 0; j < kColumns; ++j) {
      double sum = 0, most = 0;
      bool on_edge = false;
      for (const RadialForm& f : made) {
        const double r = distance(f, static_cast<double>(j), static_cast<double>(i)), z = f.amplitude * shape(r, f.state);
        on_edge = on_edge || std::abs(r - 1) < 1e-12 || std::abs(r - 0.3) < 1e-12;  // where rounding decides on which side of a step it lies
        sum += z;
        most = std::max(most, z);
        inside += r < 1;
      }
      if (on_edge) continue;
      // Sums of some ten numbers of size 10.
      CHECK(std::abs(added[static_cast<std::size_t>(i * kColumns + j)] - 1.5 - sum) < 1e-12);
      CHECK(std::abs(highest[static_cast<std::size_t>(i * kColumns + j)] - 1.5 - most) < 1e-12);
    }
  CHECK(inside > 50000);
}

TEST_CASE("tiles and threads change no bit") {
  const RadialForms forms(some(400));
  for (const StampMode mode : {StampMode::add, StampMode::highest}) {
    const std::vector<double> whole = stamped(forms, mode, 1000, 1);
    CHECK(same(whole, stamped(forms, mode, 1000, 7)));
    for (const std::int64_t tile : {7, 37, 256}) CHECK(same(whole, stamped(forms, mode, tile, 1)));
  }
}

TEST_CASE("points between the values of a grid") {
  const std::vector<RadialForm> made = some(60);
  const std::vector<double> column = {100.25, 17, 1e300, std::nan(""), 99.5}, row = {80.75, 200.5, 3, 5, -40.1};
  std::vector<double> heights(5, 1.0);
  stamp_points(shapes(), RadialForms(made), column, row, heights, StampMode::add);
  for (const std::size_t p : {std::size_t{0}, std::size_t{1}, std::size_t{4}}) {
    double sum = 1;
    for (const RadialForm& f : made) sum += f.amplitude * shape(distance(f, column[p], row[p]), f.state);
    CHECK(std::abs(heights[p] - sum) < 1e-12);
  }
  CHECK(heights[2] == 1);
  CHECK(heights[3] == 1);
}

TEST_CASE("forms out of all scale stay where they are") {
  std::vector<double> heights(4 * 4, 0.0);
  const auto stamp = [&](const RadialForm& f) {
    std::fill(heights.begin(), heights.end(), 0.0);
    stamp_radial(shapes(), RadialForms({f}), {heights.data(), 4, 0, 0, 4, 4}, StampMode::add, 1);
  };
  stamp(form(1e300, -1e300, 1, 1, 0, 0));
  CHECK(heights == std::vector<double>(16, 0.0));
  stamp(form(1.5, 1.5, 1e-9, 1e-9, 0.3, 0));  // between the values
  CHECK(heights == std::vector<double>(16, 0.0));
  stamp(form(2, 1, 1e-9, 1e-9, 0.3, 0));
  CHECK(heights[1 * 4 + 2] == 2);
  stamp(form(2, 1, 1e9, 1e9, 0.3, 1));  // its top, everywhere
  CHECK(std::abs(heights[15] - 1) < 1e-8);
  stamp(form(2, 1, 1e11, 0.6, 0.3, 1));
  CHECK(heights[15] == 0);
}

TEST_CASE("nonsense is refused") {
  const double nan = std::nan(""), oo = std::numeric_limits<double>::infinity();
  const auto with = [](auto change) {
    RadialForm f = form(1, 1, 2, 2, 0, 0);
    change(f);
    return std::vector<RadialForm>{f};
  };
  CHECK_THROWS_AS(RadialForms(with([&](RadialForm& f) { f.column = nan; })), InputRefused);
  CHECK_THROWS_AS(RadialForms(with([&](RadialForm& f) { f.row = oo; })), InputRefused);
  CHECK_THROWS_AS(RadialForms(with([&](RadialForm& f) { f.amplitude = nan; })), InputRefused);
  CHECK_THROWS_AS(RadialForms(with([&](RadialForm& f) { f.state = -0.1; })), InputRefused);
  CHECK_THROWS_AS(RadialForms(with([&](RadialForm& f) { f.u_row = nan; })), InputRefused);
  CHECK_THROWS_AS(RadialForms(with([&](RadialForm& f) { f.u_column = oo; })), InputRefused);
  CHECK_THROWS_AS(RadialForms(with([&](RadialForm& f) { f.u_column = 0; })), InputRefused);
  double height = 0;
  const HeightWindow one{&height, 1, 0, 0, 1, 1};
  const RadialForms sound(with([](RadialForm&) {}));
  CHECK_THROWS_AS(stamp_radial(shapes(), sound, one, StampMode::add, 0), std::invalid_argument);
  CHECK_THROWS_AS(stamp_radial(shapes(), sound, {&height, 1, std::int64_t{1} << 40, 0, 1, 1}, StampMode::add, 1), std::invalid_argument);
  CHECK_THROWS_AS(stamp_radial(shapes(), RadialForms(with([](RadialForm& f) { f.state = 4.5; })), one, StampMode::add, 1), std::invalid_argument);
  const double knots[] = {0, 1}, backwards[] = {0, 0.5, 0.5, 1}, cells[] = {1, -1}, bad[] = {nan, 0};
  const std::int64_t counts[] = {1}, none[] = {0};
  CHECK_THROWS_AS(RadialShapes(knots, counts, bad, 1), InputRefused);
  CHECK_THROWS_AS(RadialShapes(knots, none, cells, 1), std::invalid_argument);
  CHECK_THROWS_AS(RadialShapes(knots, counts, cells, 2), std::invalid_argument);
  CHECK_THROWS_AS(RadialShapes(backwards, std::vector<std::int64_t>{1, 1, 1}, cells, 1), std::invalid_argument);
}
