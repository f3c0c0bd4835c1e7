// Tilted gravity: the ground, or the map's vertical, leans by two small angles:
//   g -> R_y(pitch) R_x(roll) g,   roll about x, pitch about y of W
#include "effects/effect.hpp"

namespace rille::effects {
void attach_gravity_tilt(const Attachment& a) {
  Eigen::Vector3d& gravity = a.model.scenario.gravity;
  gravity = Eigen::AngleAxisd(a["pitch"], Eigen::Vector3d::UnitY()) * (Eigen::AngleAxisd(a["roll"], Eigen::Vector3d::UnitX()) * gravity);
}

}  // namespace rille::effects
