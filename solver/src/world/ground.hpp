// The ground under the wheels: heights, tangent planes and soils of a terrain.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "model/terrain.hpp"

namespace rille {

// Tangent plane of the ground under a footprint.
struct GroundPlane {
  double height = 0;                                   // [m] of the plane at the footprint's centre
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();   // [-] unit, upwards
};

class Ground {
 public:
  explicit Ground(const Terrain& terrain) : terrain_(&terrain) {}

  // Bilinear height at (x, y) [m]; nothing outside the grid or beside a value that is missing.
  std::optional<double> height(double x, double y) const;

  // Height [m] that the ground nowhere exceeds within `radius` of (x, y); -inf where there is no ground.
  double ceiling(double x, double y, double radius) const;

  // Plane through the heights at the ends of a cross of the given half lengths [m] around (x, y), its first arm along the
  // unit vector `heading`: the slope that a body of that size feels.
  std::optional<GroundPlane> plane(double x, double y, const Eigen::Vector2d& heading, double half_length,
                                   double half_width) const;

  // Index of the soil at (x, y): the last patch that contains the point, else the base soil.
  int soil(double x, double y) const;

 private:
  const Terrain* terrain_;
};

}  // namespace rille
