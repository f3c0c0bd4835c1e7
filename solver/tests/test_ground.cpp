// The ceiling under which a body may touch the ground: never below the ground, and close to it.
#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "world/ground.hpp"

using namespace rille;

TEST_CASE("the ceiling of the ground lies above every height within its radius, and is not far above") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (const int n_rows : {2, 3, 17, 18, 40}) {
    const int n_cols = n_rows + 14;
    HeightGrid grid{.n_rows = n_rows, .n_cols = n_cols, .posting_x = 0.1, .posting_y = 0.2, .x_west = -1, .y_north = 3};
    for (int k = 0; k < n_rows * n_cols; ++k) grid.heights.push_back(uniform(random) < 0.02 ? std::nan("") : uniform(random));
    grid.find_highest();
    Terrain terrain;
    terrain.grid = std::make_shared<const HeightGrid>(grid);
    const Ground ground(terrain);
    for (int trial = 0; trial < 200; ++trial) {
      const double x = -2 + 8 * uniform(random), y = -6 + 12 * uniform(random), radius = uniform(random);
      const double ceiling = ground.ceiling(x, y, radius);
      for (int k = 0; k < 50; ++k) {
        const double angle = 2 * 3.14159265 * uniform(random), r = radius * std::sqrt(uniform(random));
        const auto height = ground.height(x + r * std::cos(angle), y + r * std::sin(angle));
        if (height) CHECK(*height <= ceiling);
      }
      CHECK(ceiling <= 1.0);  // of heights in 0..1, however far the circle reaches
    }
    CHECK(ground.ceiling(1e6, 0, 1) == -INFINITY);
    CHECK(ground.ceiling(0, 0, 1e6) == *std::max_element(grid.heights.begin(), grid.heights.end(), [](double a, double b) {
      return std::isnan(a) || a < b;
    }));
  }
}
