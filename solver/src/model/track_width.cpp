#include "model/track_width.hpp"

#include <algorithm>
#include <cmath>

namespace rille {
namespace {

using Eigen::Vector3d;

constexpr double kVertical = 0.9;  // cosine of the tilt below which a hinge counts as steering

std::size_t at(int index) { return static_cast<std::size_t>(index); }

// Unit vector across, level; zero for a wheel that lies flat.
Vector3d across(const Rover& rover) {
  Vector3d axle = rover.joints[at(rover.wheels[0].joint)].axis;
  axle.z() = 0;
  return axle.norm() > 1e-3 ? Vector3d(axle.normalized()) : Vector3d::Zero();
}

struct Span {
  double lowest = 0, highest = 0;  // [m] of the wheel centres across
};

Span span_of(const Rover& rover, const Vector3d& direction) {
  Span span{.lowest = direction.dot(rover.wheels[0].center), .highest = direction.dot(rover.wheels[0].center)};
  for (const Wheel& wheel : rover.wheels) {
    const double offset = direction.dot(wheel.center);
    span.lowest = std::min(span.lowest, offset);
    span.highest = std::max(span.highest, offset);
  }
  return span;
}

int carrier_of(const Rover& rover, int body) {
  for (std::size_t j = 0; j < rover.joints.size(); ++j)
    if (rover.joints[j].child == body) return static_cast<int>(j);
  return -1;
}

// The wheel's joint, or the steering hinge above it.
int top_joint(const Rover& rover, int wheel_joint) {
  int top = wheel_joint;
  for (int above = carrier_of(rover, rover.joints[at(top)].parent); above >= 0; above = carrier_of(rover, rover.joints[at(top)].parent)) {
    const Joint& joint = rover.joints[at(above)];
    if (joint.kind != JointKind::hinge || std::abs(joint.axis.z()) < kVertical || joint.parent < 0) break;
    top = above;
  }
  return top;
}

// Bodies that a joint carries, by itself or through others.
std::vector<bool> carried_by(const Rover& rover, int top) {
  std::vector<bool> carried(rover.bodies.size(), false);
  carried[at(rover.joints[at(top)].child)] = true;
  for (std::size_t pass = 0; pass < rover.joints.size(); ++pass)
    for (const Joint& joint : rover.joints)
      if (joint.parent >= 0 && carried[at(joint.parent)]) carried[at(joint.child)] = true;
  return carried;
}

void move(Rover& rover, int top, const Vector3d& by) {
  const std::vector<bool> carried = carried_by(rover, top);
  for (std::size_t b = 0; b < carried.size(); ++b) {
    if (!carried[b]) continue;
    rover.bodies[b].com += by;
    rover.bodies[b].frame += by;
  }
  for (Joint& joint : rover.joints)
    if (carried[at(joint.child)]) joint.point += by;
  for (Wheel& wheel : rover.wheels)
    if (carried[at(rover.joints[at(wheel.joint)].child)]) wheel.center += by;
  for (BodyShape& shape : rover.shapes)
    if (carried[at(shape.body)]) shape.shape.center += by;
  for (LoopClosure& closure : rover.loop_closures)
    if (carried[at(closure.body_a)]) closure.point += by;
}

}  // namespace

double drawn_track_width(const Rover& rover) {
  if (rover.wheels.size() < 2) return 0;
  for (const Wheel& wheel : rover.wheels)
    if (rover.joints[at(wheel.joint)].parent < 0) return 0;
  const Span span = span_of(rover, across(rover));
  return span.highest - span.lowest;
}

void spread_wheels(Rover& rover) {
  const double drawn = drawn_track_width(rover);
  if (drawn <= 0 || rover.track_width <= 0 || rover.track_width == drawn) return;
  const Vector3d direction = across(rover);
  const Span span = span_of(rover, direction);
  const double middle = 0.5 * (span.lowest + span.highest), growth = rover.track_width / drawn - 1;
  std::vector<std::pair<int, double>> moves;  // top joint, distance
  for (const Wheel& wheel : rover.wheels) {
    const int top = top_joint(rover, wheel.joint);
    if (std::none_of(moves.begin(), moves.end(), [&](const auto& known) { return known.first == top; }))
      moves.emplace_back(top, growth * (direction.dot(wheel.center) - middle));
  }
  for (const auto& [top, distance] : moves) move(rover, top, distance * direction);
}

}  // namespace rille
