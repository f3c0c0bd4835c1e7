// What a simulation reports: states, events, and how it ended.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace rille {

struct BodyState {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();              // [m] origin of B in W
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();    // R_WB
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();              // [m/s] of that origin in W
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();      // [rad/s] in W
};

struct JointState {
  double position = 0;  // [rad or m]
  double velocity = 0;  // [rad/s or m/s]
  double effort = 0;    // [N m or N] of its drive in the last step
  double work = 0;      // [J] done by its drive since t = 0
};

struct WheelState {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  // [m] in W
  double ground_height = 0;                          // [m] undisturbed terrain below the centre
  double slip_ratio = 0;                             // [-] in [-1, 1]
  double slip_angle = 0;                             // [rad] direction of travel against the wheel's plane
  double sinkage = 0;                                // [m] depth of the lowest point of the rim, 0 in the air
  double normal_load = 0;                            // [N]
  double drawbar_pull = 0;                           // [N]
  double side_force = 0;                             // [N]
  double drive_torque = 0;                           // [N m]
};

// Force and torque of the carrier on the carried body, about the joint's point, in W.
struct JointReaction {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   // [N]
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();  // [N m]
};

struct EnergyState {
  double kinetic = 0;        // [J]
  double potential = 0;      // [J] 0 at t = 0
  double drive_work = 0;     // [J] since t = 0, as all that follow
  double soil_loss = 0;      // [J]
  double joint_loss = 0;     // [J]
  double contact_loss = 0;   // [J]
  double external_work = 0;  // [J]
  double residual = 0;       // [J] open balance
};

struct SensorSample {
  int sensor = -1;
  double time = 0;  // [s] by the sensor's clock
  int component = 0;
  double value = 0;
};

struct Snapshot {
  double time = 0;  // [s]
  std::vector<BodyState> bodies;
  std::vector<JointState> joints;  // one per joint; fixed and spherical joints stay zero
  std::vector<WheelState> wheels;
  std::vector<JointReaction> reactions;  // one per joint
  EnergyState energy;
};

struct Event {
  double time = 0;  // [s]
  std::string kind;
  std::string subject;
  std::string message;
};

enum class Outcome { running, done, stopped, interrupted, left_terrain, wheel_buried, diverged };

// The word that the table `run` keeps.
constexpr const char* word(Outcome outcome) {
  switch (outcome) {
    case Outcome::running: return "running";
    case Outcome::done: return "done";
    case Outcome::stopped: return "stopped";
    case Outcome::interrupted: return "interrupted";
    case Outcome::left_terrain: return "left_terrain";
    case Outcome::wheel_buried: return "wheel_buried";
    case Outcome::diverged: return "diverged";
  }
  return "diverged";
}

}  // namespace rille
