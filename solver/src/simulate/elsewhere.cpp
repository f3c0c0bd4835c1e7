#include "simulate/elsewhere.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/error.hpp"
#include "model/named.hpp"

namespace rille {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kLongest = 1e6;  // [m, rad or per second] no state is beyond

bool of_joint(const StateChange& change) { return change.quantity.starts_with("joint."); }

std::size_t numbers_of(const std::string& quantity) {
  if (quantity == "joint.position" || quantity == "joint.velocity") return 1;
  if (quantity == "part.orientation") return 4;
  if (quantity == "part.position" || quantity == "part.linear_velocity" || quantity == "part.angular_velocity") return 3;
  return 0;
}

int root_of(const Rover& rover) {
  std::vector<bool> carried(rover.bodies.size(), false);
  for (const Joint& joint : rover.joints) carried[static_cast<std::size_t>(joint.child)] = true;
  return static_cast<int>(std::find(carried.begin(), carried.end(), false) - carried.begin());
}

void put_joint(Mechanism& mechanism, const Rover& rover, int joint, const std::string& quantity, double value) {
  const bool position = quantity == "joint.position";
  const auto put = [&](int j, double v) {
    mechanism.set_joint(j, position ? v : mechanism.joint_position(j), position ? mechanism.joint_velocity(j) : v);
  };
  put(joint, value);
  for (const Differential& differential : rover.differentials) {
    const auto axis = [&](int j) { return rover.joints[static_cast<std::size_t>(j)].axis; };
    const double ratio = axis(differential.joint_a).dot(axis(differential.joint_b)) > 0 ? -1 : 1;
    if (differential.joint_a == joint) put(differential.joint_b, ratio * value);
    if (differential.joint_b == joint) put(differential.joint_a, ratio * value);
  }
  for (const Gear& gear : rover.gears) {
    if (gear.joint_a == joint) put(gear.joint_b, gear.ratio * value);
    if (gear.joint_b == joint) put(gear.joint_a, value / gear.ratio);
  }
}

}  // namespace

void require_change(const Rover& rover, bool held_by_world, const StateChange& change) {
  const std::string who = fmt::format("{} of '{}'", change.quantity, change.target);
  const std::size_t numbers = numbers_of(change.quantity);
  if (numbers == 0)
    throw InputRefused(fmt::format("{} can be read but not set; what can be set are joint.position, joint.velocity, part.position, part.orientation, "
                                   "part.linear_velocity and part.angular_velocity", who));
  if (change.values.size() != numbers)
    throw InputRefused(fmt::format("{} has {} numbers, not {}; give all of them", who, numbers, change.values.size()));
  for (const double value : change.values)
    if (!(std::abs(value) <= kLongest)) throw InputRefused(fmt::format("{} cannot be {:g}; it must be within +-{:g}", who, value, kLongest));
  if (of_joint(change)) {
    const int index = find_named(rover.joints, change.target, "the change is of joint");
    const Joint& joint = rover.joints[static_cast<std::size_t>(index)];
    if (!joint.has_one_freedom()) throw InputRefused(fmt::format("{} cannot be set: the joint is neither a hinge nor prismatic", who));
    if (joint.limit && change.quantity == "joint.position" && (change.values[0] < joint.limit->lower || change.values[0] > joint.limit->upper))
      throw InputRefused(fmt::format("{} cannot be {:g}; its limits are {:g} and {:g}", who, change.values[0], joint.limit->lower, joint.limit->upper));
    return;
  }
  const int body = find_named(rover.bodies, change.target, "the change is of body");
  if (held_by_world) throw InputRefused(fmt::format("{} cannot be set: the world holds this model; set its joints", who));
  if (body != root_of(rover))
    throw InputRefused(fmt::format("{} cannot be set: it follows its joints; set those, or '{}', which no joint carries", who,
                                   rover.bodies[static_cast<std::size_t>(root_of(rover))].name));
  if (change.quantity == "part.orientation") {
    const double norm = std::hypot(std::hypot(change.values[0], change.values[1]), std::hypot(change.values[2], change.values[3]));
    if (std::abs(norm - 1) > 1e-3) throw InputRefused(fmt::format("{} has the length {:g}; a quaternion w x y z has the length 1", who, norm));
  }
}

void put_elsewhere(Mechanism& mechanism, const Rover& rover, const StateChange& change) {
  require_change(rover, mechanism.held_by_world(), change);
  mechanism.update_kinematics();
  if (of_joint(change)) {
    put_joint(mechanism, rover, find_named(rover.joints, change.target, "the change is of joint"), change.quantity, change.values[0]);
    return;
  }
  BodyState root = mechanism.body_state(root_of(rover));
  const std::vector<double>& v = change.values;
  if (change.quantity == "part.position") root.position = Vector3d(v[0], v[1], v[2]);
  if (change.quantity == "part.orientation") root.rotation = Quaterniond(v[0], v[1], v[2], v[3]).normalized();
  if (change.quantity == "part.linear_velocity") root.velocity = Vector3d(v[0], v[1], v[2]);
  if (change.quantity == "part.angular_velocity") root.angular_velocity = Vector3d(v[0], v[1], v[2]);
  mechanism.set_root(root);
}

}  // namespace rille
