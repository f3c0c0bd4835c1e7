// A mechanism as read from the database: plain values, indices instead of keys.
// Poses, points, axes and inertias are given in the model frame M at the zero pose. SI and radians.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace rille {

struct Body {
  std::int64_t id = 0;
  std::string name;
  Eigen::Vector3d frame = Eigen::Vector3d::Zero();    // [m] origin of the body frame B
  double mass = 0;                                    // [kg]
  Eigen::Vector3d com = Eigen::Vector3d::Zero();      // [m] centre of mass
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  // [kg m^2] about the centre of mass, axes of M
};

enum class JointKind { hinge, prismatic, fixed, spherical };

struct Limit {
  double lower = 0;  // [rad or m]
  double upper = 0;  // [rad or m]
};

struct Joint {
  std::int64_t id = 0;
  std::string name;
  JointKind kind = JointKind::hinge;
  int parent = -1;                                  // index of the carrying body; -1 = the world
  int child = -1;                                   // index of the carried body
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  // [m] a point on the axis
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  // [-] unit axis
  std::optional<Limit> limit;
};

enum class DriveMode { speed, torque, position };

struct Drive {
  std::int64_t id = 0;
  std::string name;
  int joint = -1;
  DriveMode mode = DriveMode::speed;
  double max_torque = 0;            // [N m or N]
  std::optional<double> max_speed;  // [rad/s or m/s]
  double position_gain = 5;         // [1/s] commanded speed per position error
};

// theta_a + theta_b = 2 theta_carrier about the common direction of the two hinges.
struct Differential {
  std::string name;
  int carrier = -1;  // index of the carrying body
  int joint_a = -1;
  int joint_b = -1;
};

// q_b = ratio q_a
struct Gear {
  std::string name;
  int joint_a = -1;
  int joint_b = -1;
  double ratio = 1;
};

struct Wheel {
  std::int64_t id = 0;
  std::string name;
  int joint = -1;
  std::optional<std::int64_t> material_id;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  // [m] in M
  double radius = 0;                                 // [m] rim, without grousers
  double width = 0;                                  // [m]
};

// Corners of a body's collision shape, which show whether it reaches into the ground.
struct Outline {
  int body = -1;
  std::vector<Eigen::Vector3d> corners;  // [m] in M
};

struct Rover {
  std::vector<Body> bodies;
  std::vector<Joint> joints;
  std::vector<Drive> drives;
  std::vector<Differential> differentials;
  std::vector<Gear> gears;
  std::vector<Wheel> wheels;
  std::vector<Outline> outlines;  // of bodies that are no wheels
};

}  // namespace rille
