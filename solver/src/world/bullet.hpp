// Vectors and rotations between Eigen and Bullet, for the files of this folder that talk to Bullet.
#pragma once

#include <LinearMath/btQuaternion.h>
#include <LinearMath/btVector3.h>

#include <Eigen/Geometry>

namespace rille {

inline btVector3 bt(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
inline btQuaternion bt(const Eigen::Quaterniond& q) { return {q.x(), q.y(), q.z(), q.w()}; }
inline Eigen::Vector3d eigen(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
inline Eigen::Quaterniond eigen(const btQuaternion& q) { return {q.w(), q.x(), q.y(), q.z()}; }

}  // namespace rille
