// A mechanism as read from the database: plain values, indices instead of keys.
// Poses, points, axes and inertias are given in the model frame M at the zero pose. SI and radians.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
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
  double stiffness = 0;  // [N m/rad or N/m] of the stops; 0: rigid
  double damping = 0;    // [N m s/rad or N s/m] of elastic stops while they are pressed
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

  // Turns about its axis or slides along it: has a position, can be driven, limited and rubbed.
  bool has_one_freedom() const { return kind == JointKind::hinge || kind == JointKind::prismatic; }
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
  std::optional<double> speed_gain; // [N m s/rad or N s/m] effort per speed error; absent: the speed is held exactly up to max_torque
  double integral_gain = 0;         // [N m/rad or N/m] effort per integrated speed error
  std::optional<double> torque_constant;  // [N m/A]
  std::optional<double> resistance;       // [ohm]
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

inline constexpr double kSmallestWheel = 1e-3, kLargestWheel = 100;  // [m] radius and width; beyond these a unit was mistaken

struct Wheel {
  std::int64_t id = 0;
  std::string name;
  int joint = -1;
  std::optional<std::int64_t> material_id;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  // [m] in M
  double radius = 0;                                 // [m] rim, without grousers
  double width = 0;                                  // [m]
  int grouser_count = 0;                             // [-] 0: smooth
  double grouser_height = 0;                         // [m] above the rim
};

// A point of a body and a common point of another one (or of the world) that stay together.
struct LoopClosure {
  std::string name;
  int body_a = -1;
  int body_b = -1;                                  // -1 = the world
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  // [m] in M at the zero pose
};

enum class ShapeKind { box, sphere, cylinder, hull };

// A convex solid; on a body in M at the zero pose, as an obstacle in W.
struct Shape {
  ShapeKind kind = ShapeKind::box;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();              // [m]
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // a cylinder's axis is its z
  Eigen::Vector3d size = Eigen::Vector3d::Zero();                // [m] box: full lengths; sphere: radius; cylinder: radius, -, height
  std::vector<Eigen::Vector3d> vertices;                         // [m] hull: relative to the centre, in its own axes
  std::optional<std::int64_t> material_id;
};

// Shape that a body carries.
struct BodyShape {
  int body = -1;
  Shape shape;
};

struct Sensor {
  std::int64_t id = 0;
  std::string name;
  std::string quantity;     // "joint.velocity"
  std::string target;       // name of the body, joint or wheel
  double rate = 1;          // [Hz]
  bool body_frame = false;  // vectors in the axes of the body instead of W
};

struct Rover {
  std::vector<Body> bodies;
  std::vector<Joint> joints;
  std::vector<Drive> drives;
  std::vector<Differential> differentials;
  std::vector<Gear> gears;
  std::vector<Wheel> wheels;
  std::vector<LoopClosure> loop_closures;
  std::vector<BodyShape> shapes;  // of bodies that are no wheels; wheels collide as cylinders
  std::vector<Sensor> sensors;
  double track_width = 0;  // [m] across the outermost wheel centres; a simulation moves its wheels there (model/track_width.hpp); 0: none
};

// Sign s in q_a + s q_b = 0, which a differential asks of its joints: +1 where their axes are parallel, -1 where they are opposed.
inline double position_sign(const Rover& rover, const Differential& differential) {
  const auto axis = [&](int joint) { return rover.joints[static_cast<std::size_t>(joint)].axis; };
  return axis(differential.joint_a).dot(axis(differential.joint_b)) > 0 ? 1 : -1;
}

}  // namespace rille
