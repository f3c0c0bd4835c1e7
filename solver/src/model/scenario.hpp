// One experiment as read from the database.
#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "model/error.hpp"

namespace rille {

// Raises InputRefused for a time step [s] that no drive can be simulated with.
inline void require_step(double step) {
  if (!(step > 0 && step <= 0.1)) throw InputRefused(fmt::format("step is {:g} s; it must be above 0 and at most 0.1 s", step));
}

enum class Integrator { automatic, semi_implicit_euler, rk4 };
enum class Placement { on_terrain, as_given };

struct Command {
  int drive = -1;
  double time = 0;   // [s] holds from here until the drive's next command
  double value = 0;  // [rad/s, rad or N m] by the mode of the drive
};

// Puts a joint, or the body that no joint carries, elsewhere at the beginning of a step.
struct StateChange {
  double time = 0;       // [s]
  std::string quantity;  // joint.position, joint.velocity, part.position, part.orientation, part.linear_velocity or part.angular_velocity
  std::string target;    // name of the joint or body
  std::vector<double> values;  // [SI] in W; orientation: quaternion w x y z
};

struct InitialJointState {
  int joint = -1;
  double position = 0;  // [rad or m]
  double velocity = 0;  // [rad/s or m/s]
};

enum class WatchAction { mark, stop, command };

// Waits for an event or for a quantity to pass a bound, and acts once.
struct Watch {
  std::string name;
  std::string event;     // kind of event; empty: a quantity is compared
  std::string quantity;  // as of a sensor
  int component = 0;
  std::string target;    // name of the body, joint or wheel; empty: any (events only)
  std::optional<double> above;
  std::optional<double> below;
  double hold = 0;       // [s]
  WatchAction action = WatchAction::mark;
  int drive = -1;
  double value = 0;      // [rad/s, rad or N m]
};

struct Scenario {
  std::int64_t id = 0;
  std::string name;
  Eigen::Vector3d gravity = Eigen::Vector3d(0, 0, -9.80665);  // [m/s^2] in W
  double duration = 1;                                        // [s]
  double step = 1e-3;                                         // [s]
  double output_interval = 0.02;                              // [s]
  Integrator integrator = Integrator::automatic;
  Placement placement = Placement::as_given;
  double settle_time = 0;                                                    // [s] longest time to come to rest before t = 0
  Eigen::Vector3d start_position = Eigen::Vector3d::Zero();                  // [m] origin of the root's frame in W
  Eigen::Quaterniond start_rotation = Eigen::Quaterniond::Identity();        // R_WB of the root
  Eigen::Vector3d start_velocity = Eigen::Vector3d::Zero();                  // [m/s] of that origin in W
  Eigen::Vector3d start_angular_velocity = Eigen::Vector3d::Zero();          // [rad/s] in W
  std::vector<InitialJointState> initial_states;
  std::vector<Command> commands;  // sorted by time
  std::vector<StateChange> changes;  // in their order, times ascending
  std::vector<Watch> watches;
};

}  // namespace rille
