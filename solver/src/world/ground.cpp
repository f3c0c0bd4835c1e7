#include "world/ground.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace rille {
namespace {

// Even-odd rule (Shimrat 1962).
bool contains(const std::vector<Eigen::Vector2d>& polygon, double x, double y) {
  bool inside = false;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const auto& a = polygon[i];
    const auto& b = polygon[j];
    if ((a.y() > y) != (b.y() > y) && x < (b.x() - a.x()) * (y - a.y()) / (b.y() - a.y()) + a.x()) inside = !inside;
  }
  return inside;
}

}  // namespace

std::optional<double> Ground::height(double x, double y) const {
  const HeightGrid& g = *terrain_->grid;
  const double column = (x - g.x_west) / g.posting_x;
  const double row = (g.y_north - y) / g.posting_y;
  if (!(column >= 0 && row >= 0 && column <= g.n_cols - 1 && row <= g.n_rows - 1)) return std::nullopt;
  const int j = std::min(static_cast<int>(column), g.n_cols - 2);
  const int i = std::min(static_cast<int>(row), g.n_rows - 2);
  const double fx = column - j;
  const double fy = row - i;
  const double* north = g.heights.data() + static_cast<std::size_t>(i) * g.n_cols + j;
  const double* south = north + g.n_cols;
  const double h = (1 - fy) * ((1 - fx) * north[0] + fx * north[1]) + fy * ((1 - fx) * south[0] + fx * south[1]);
  if (std::isnan(h)) return std::nullopt;
  return h;
}

double Ground::ceiling(double x, double y, double radius) const {
  const HeightGrid& g = *terrain_->grid;
  if (g.highest.empty()) return std::numeric_limits<double>::infinity();
  const int n_across = g.blocks_across();
  const int n_down = g.blocks_down();
  const auto block = [](double cell, int count) { return static_cast<int>(std::clamp(std::floor(cell / HeightGrid::kBlock), -1.0, double(count))); };
  const int west = std::max(block((x - radius - g.x_west) / g.posting_x, n_across), 0);
  const int east = std::min(block((x + radius - g.x_west) / g.posting_x, n_across), n_across - 1);
  const int north = std::max(block((g.y_north - y - radius) / g.posting_y, n_down), 0);
  const int south = std::min(block((g.y_north - y + radius) / g.posting_y, n_down), n_down - 1);
  double found = -std::numeric_limits<double>::infinity();
  for (int i = north; i <= south; ++i)
    for (int j = west; j <= east; ++j) found = std::max(found, g.highest[static_cast<std::size_t>(i) * n_across + j]);
  return found;
}

std::optional<GroundPlane> Ground::plane(double x, double y, const Eigen::Vector2d& heading, double half_length,
                                         double half_width) const {
  const Eigen::Vector2d ahead = half_length * heading;
  const Eigen::Vector2d left = half_width * Eigen::Vector2d(-heading.y(), heading.x());
  const auto front = height(x + ahead.x(), y + ahead.y());
  const auto back = height(x - ahead.x(), y - ahead.y());
  const auto port = height(x + left.x(), y + left.y());
  const auto starboard = height(x - left.x(), y - left.y());
  if (!front || !back || !port || !starboard) return std::nullopt;
  const Eigen::Vector3d along(2 * ahead.x(), 2 * ahead.y(), *front - *back);
  const Eigen::Vector3d across(2 * left.x(), 2 * left.y(), *port - *starboard);
  return GroundPlane{(*front + *back + *port + *starboard) / 4, along.cross(across).normalized()};
}

int Ground::soil(double x, double y) const {
  for (std::size_t k = terrain_->patches.size(); k-- > 0;)
    if (contains(terrain_->patches[k].polygon, x, y)) return terrain_->patches[k].soil;
  return terrain_->base_soil;
}

}  // namespace rille
