#include "simulate/quantity.hpp"

#include <fmt/format.h>

#include <map>

#include "model/named.hpp"

namespace rille {
namespace {

const std::map<std::string, double JointState::*> kJoint = {
    {"joint.position", &JointState::position}, {"joint.velocity", &JointState::velocity}, {"joint.effort", &JointState::effort}};
const std::map<std::string, double WheelState::*> kWheel = {
    {"wheel.sinkage", &WheelState::sinkage},         {"wheel.drawbar_pull", &WheelState::drawbar_pull},
    {"wheel.normal_load", &WheelState::normal_load}, {"wheel.side_force", &WheelState::side_force},
    {"wheel.drive_torque", &WheelState::drive_torque}, {"wheel.slip_ratio", &WheelState::slip_ratio},
    {"wheel.slip_angle", &WheelState::slip_angle}};

}  // namespace

Quantity::Quantity(const Rover& rover, const std::string& quantity, const std::string& target, bool body_frame, const std::string& who)
    : body_frame_(body_frame) {
  if (const auto found = kJoint.find(quantity); found != kJoint.end()) {
    joint_ = found->second;
    index_ = find_named(rover.joints, target, who + " reads joint");
    return;
  }
  if (const auto found = kWheel.find(quantity); found != kWheel.end()) {
    kind_ = Kind::wheel;
    wheel_ = found->second;
    index_ = find_named(rover.wheels, target, who + " reads wheel");
    return;
  }
  const std::map<std::string, std::pair<Kind, int>> parts = {{"part.position", {Kind::position, 3}},
                                                             {"part.orientation", {Kind::orientation, 4}},
                                                             {"part.linear_velocity", {Kind::linear_velocity, 3}},
                                                             {"part.angular_velocity", {Kind::angular_velocity, 3}},
                                                             {"part.linear_acceleration", {Kind::linear_acceleration, 3}}};
  if (const auto found = parts.find(quantity); found != parts.end()) {
    kind_ = found->second.first;
    size_ = found->second.second;
    index_ = find_named(rover.bodies, target, who + " reads body");
    return;
  }
  if (quantity == "motor.current" || quantity == "motor.voltage") {
    kind_ = quantity == "motor.current" ? Kind::current : Kind::voltage;
    drive_ = find_named(rover.drives, target, who + " reads drive");
    const Drive& drive = rover.drives[static_cast<std::size_t>(drive_)];
    index_ = drive.joint;
    if (!drive.torque_constant || (kind_ == Kind::voltage && !drive.resistance))
      throw InputRefused(fmt::format("{} reads {} of drive '{}', which needs its torque_constant{}; give it in table drive", who, quantity,
                                     drive.name, kind_ == Kind::voltage ? " and resistance" : ""));
    return;
  }
  throw InputRefused(fmt::format("{} reads '{}', which is no quantity known here; use joint.position, joint.velocity, joint.effort, "
                                 "part.position, part.orientation, part.linear_velocity, part.angular_velocity, part.linear_acceleration, "
                                 "wheel.sinkage, wheel.normal_load, wheel.drawbar_pull, wheel.side_force, wheel.drive_torque, "
                                 "wheel.slip_ratio, wheel.slip_angle, motor.current or motor.voltage", who, quantity));
}

std::vector<double> Quantity::read(const Readable& from) {
  const auto index = static_cast<std::size_t>(index_);
  if (kind_ == Kind::joint) return {(*from.joints)[index].*joint_};
  if (kind_ == Kind::wheel) return {index < from.wheels->size() ? (*from.wheels)[index].*wheel_ : 0.0};
  if (kind_ == Kind::current || kind_ == Kind::voltage) {
    const Drive& drive = from.model->rover.drives[static_cast<std::size_t>(drive_)];
    const double current = (*from.joints)[index].effort / *drive.torque_constant;
    if (kind_ == Kind::current) return {current};
    return {current * *drive.resistance + *drive.torque_constant * (*from.joints)[index].velocity};
  }
  const BodyState state = from.mechanism->body_state(index_);
  const auto vector = [&](Eigen::Vector3d v) -> std::vector<double> {
    if (body_frame_) v = state.rotation.conjugate() * v;
    return {v.x(), v.y(), v.z()};
  };
  switch (kind_) {
    case Kind::position: return {state.position.x(), state.position.y(), state.position.z()};
    case Kind::orientation: return {state.rotation.w(), state.rotation.x(), state.rotation.y(), state.rotation.z()};
    case Kind::linear_velocity: return vector(state.velocity);
    case Kind::angular_velocity: return vector(state.angular_velocity);
    default: break;
  }
  // An accelerometer feels the specific force: acceleration less gravity.
  const Eigen::Vector3d change = has_last_ ? Eigen::Vector3d((state.velocity - last_velocity_) / from.h) : Eigen::Vector3d::Zero();
  last_velocity_ = state.velocity;
  has_last_ = true;
  return vector(change - from.model->scenario.gravity);
}

}  // namespace rille
