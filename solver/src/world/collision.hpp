// Where convex solids of the mechanism touch the obstacles of a terrain. Bullet's narrow phase, without memory: every call starts anew,
// so that a state that is resumed finds the same contacts bit by bit.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "model/terrain.hpp"

namespace rille {

struct Touch {
  int obstacle = -1;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    // [m] in W, on the obstacle
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // [-] from the obstacle to the mover
  double gap = 0;                                     // [m] negative: overlap
};

class Collision {
 public:
  explicit Collision(const std::vector<Obstacle>& obstacles);
  ~Collision();
  Collision(Collision&&) noexcept;
  Collision& operator=(Collision&&) noexcept;

  // Adds a solid that moves; its centre and axes are those of the shape. Returns its number.
  int add_mover(const Shape& shape);
  bool empty() const;  // no obstacles

  // Touches and near touches (closer than `reach` [m]) of a mover whose shape's centre and axes stand at the given pose in W.
  void find(int mover, const Eigen::Vector3d& center, const Eigen::Quaterniond& rotation, double reach, std::vector<Touch>& touches) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace rille
