#include "simulate/rigid_contact.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace rille {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kContactRigidity = 1e5;   // [1] weight of a contact as a multiple of the body's mass: gives way by F h/(1e5 m), micrometres per minute
constexpr double kSlop = 1e-4;             // [m] overlap that is left alone, so that resting contacts do not come and go
constexpr double kPushOut = 0.2;           // [-] share of the overlap that is worked off in a step
constexpr double kPushOutSpeed = 0.1;      // [m/s] at most
constexpr double kImpactSpeed = 0.02;      // [m/s] slower approaches do not bounce
constexpr double kReach = 5e-3;            // [m] contacts are prepared for at this distance
constexpr double kPartTime = 0.1;          // [s] without touch before a contact counts as ended
constexpr std::size_t kGroundCorners = 4;  // deepest corners of a hull that touch the ground
constexpr double kStops = 0.5;             // [-] share of its strength below which sliding comes to rest within the step
constexpr double kSlides = 0.999;          // [-] share of its strength from which a contact slides
constexpr int kFreeRounds = 3;             // before they are damped
constexpr int kMostFrictionRounds = 20;    // of friction bounds in a step

template <class Value>
Value& entry(std::vector<std::pair<std::pair<int, int>, Value>>& list, const std::pair<int, int>& key, const Value& fallback) {
  for (auto& [k, value] : list)
    if (k == key) return value;
  return list.emplace_back(key, fallback).second;
}

}  // namespace

std::vector<Vector3d> corners_of(const Shape& shape) {
  std::vector<Vector3d> corners;
  if (shape.kind == ShapeKind::hull) {
    for (const Vector3d& vertex : shape.vertices) corners.push_back(shape.center + shape.rotation * vertex);
    return corners;
  }
  Vector3d half = 0.5 * shape.size;
  if (shape.kind == ShapeKind::sphere) half = Vector3d::Constant(shape.size.x());
  if (shape.kind == ShapeKind::cylinder) half = Vector3d(shape.size.x(), shape.size.x(), 0.5 * shape.size.z());
  for (int k = 0; k < 8; ++k)
    corners.push_back(shape.center + shape.rotation * half.cwiseProduct(Vector3d(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1)));
  return corners;
}

RigidContacts::RigidContacts(const Model& model, const Mechanism&)
    : model_(&model), collision_(model.terrain ? model.terrain->obstacles : std::vector<Obstacle>{}) {
  const Rover& rover = model.rover;
  for (const Wheel& wheel : rover.wheels) {
    Shape rim{.kind = ShapeKind::cylinder, .center = wheel.center, .size = Vector3d(wheel.radius, wheel.radius, wheel.width)};
    rim.rotation = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), rover.joints[static_cast<std::size_t>(wheel.joint)].axis);
    collision_.add_mover(rim);
    axes_.push_back(rim.rotation);
  }
  for (const BodyShape& carried : rover.shapes) {
    collision_.add_mover(carried.shape);
    axes_.push_back(carried.shape.rotation);
    corners_.push_back(corners_of(carried.shape));
    double bound = 0;
    for (const Vector3d& corner : corners_.back()) bound = std::max(bound, (corner - carried.shape.center).norm());
    bound_.push_back(bound);
  }
  wheel_force_.assign(rover.wheels.size(), Vector3d::Zero());
}

const std::string& RigidContacts::name(int mover) const {
  const Rover& rover = model_->rover;
  const auto m = static_cast<std::size_t>(mover);
  if (m < rover.wheels.size()) return rover.wheels[m].name;
  return rover.bodies[static_cast<std::size_t>(rover.shapes[m - rover.wheels.size()].body)].name;
}

void RigidContacts::find(const Mechanism& mechanism, double h) {
  contacts_.clear();
  if (!model_->terrain) return;
  const Rover& rover = model_->rover;
  const Terrain& terrain = *model_->terrain;
  const std::size_t n_wheels = rover.wheels.size();
  if (!collision_.empty()) {
    for (std::size_t m = 0; m < axes_.size(); ++m) {
      const bool is_wheel = m < n_wheels;
      const int body = is_wheel ? rover.joints[static_cast<std::size_t>(rover.wheels[m].joint)].child : rover.shapes[m - n_wheels].body;
      const Vector3d center = mechanism.to_world(body, is_wheel ? rover.wheels[m].center : rover.shapes[m - n_wheels].shape.center);
      const Quaterniond rotation = mechanism.rotation_from_model(body) * axes_[m];
      touches_.clear();
      const double speed = mechanism.velocity_at(body, center).norm();
      collision_.find(static_cast<int>(m), center, rotation, kReach + 2 * h * speed, touches_);
      for (const Touch& touch : touches_) {
        Contact contact;
        contact.mover = static_cast<int>(m);
        contact.obstacle = touch.obstacle;
        contact.body = body;
        contact.point = touch.point;
        contact.normal = touch.normal;
        contact.gap = touch.gap;
        contact.pair = terrain.rigid[m][static_cast<std::size_t>(touch.obstacle)];
        contacts_.push_back(contact);
      }
    }
  }
  const Ground ground(terrain);
  for (std::size_t s = 0; s < rover.shapes.size(); ++s) {
    const BodyShape& carried = rover.shapes[s];
    const Vector3d center = mechanism.to_world(carried.body, carried.shape.center);
    const double ceiling = ground.ceiling(center.x(), center.y(), bound_[s]) + kReach;
    if (center.z() - bound_[s] > ceiling) continue;
    // Height of a corner above the centre: one product instead of its place in the world.
    const Vector3d up = mechanism.rotation_from_model(carried.body).conjugate() * Vector3d::UnitZ();
    std::vector<Contact> deep;
    for (const Vector3d& corner : corners_[s]) {
      if (center.z() + up.dot(corner - carried.shape.center) > ceiling) continue;
      const Vector3d p = mechanism.to_world(carried.body, corner);
      const auto height = ground.height(p.x(), p.y());
      if (!height || p.z() - *height > kReach) continue;
      const auto plane = ground.plane(p.x(), p.y(), Eigen::Vector2d::UnitX(), 0.05, 0.05);
      Contact contact;
      contact.mover = static_cast<int>(n_wheels + s);
      contact.body = carried.body;
      contact.point = p;
      contact.normal = plane ? plane->normal : Vector3d::UnitZ();
      contact.gap = (p.z() - *height) * contact.normal.z();
      contact.pair = terrain.rigid_ground[n_wheels + s][static_cast<std::size_t>(ground.soil(p.x(), p.y()))];
      deep.push_back(contact);
    }
    std::stable_sort(deep.begin(), deep.end(), [](const Contact& a, const Contact& b) { return a.gap < b.gap; });
    if (deep.size() > kGroundCorners) deep.resize(kGroundCorners);
    contacts_.insert(contacts_.end(), deep.begin(), deep.end());
  }
}

void RigidContacts::add_wheel_on_ground(int wheel, int body, const Vector3d& point, const Vector3d& normal, double gap, const RigidPair& pair) {
  Contact contact;
  contact.mover = wheel;
  contact.body = body;
  contact.point = point;
  contact.normal = normal;
  contact.gap = gap;
  contact.pair = pair;
  contacts_.push_back(contact);
}

bool RigidContacts::open_rows(const Mechanism& mechanism, double h, RowSet& rows) {
  rounds_ = 0;
  for (Vector3d& force : wheel_force_) force.setZero();
  for (Contact& contact : contacts_) {
    const Vector3d any = std::abs(contact.normal.x()) < 0.7 ? Vector3d::UnitX() : Vector3d::UnitY();
    contact.tangent_1 = (any - any.dot(contact.normal) * contact.normal).normalized();
    contact.tangent_2 = contact.normal.cross(contact.tangent_1);
    const double mass = model_->rover.bodies[static_cast<std::size_t>(contact.body)].mass;
    const auto open = [&](const Vector3d& direction) -> Row& {
      const int row = rows.open(RowKind::contact);
      mechanism.add_jacobian(contact.body, contact.point, direction, Vector3d::Zero(), rows);
      rows[row].weight = kContactRigidity * mass;
      return rows[row];
    };
    contact.row = rows.size();
    const double approach = mechanism.velocity_at(contact.body, contact.point).dot(contact.normal);
    Row& normal = open(contact.normal);
    normal.lower = 0;
    normal.target = contact.gap > 0 ? -contact.gap / h : std::min(kPushOut * std::max(-contact.gap - kSlop, 0.0) / h, kPushOutSpeed);
    if (approach < -kImpactSpeed && contact.gap <= -h * approach && contact.pair.restitution > 0)
      normal.target = std::max(normal.target, -contact.pair.restitution * approach);
    if (contact.gap > 0) normal.side = RowSide::at_lower;
    // Several points of one pair share the last step's force.
    const auto n = static_cast<double>(std::count_if(contacts_.begin(), contacts_.end(), [&](const Contact& other) {
      return other.mover == contact.mover && other.obstacle == contact.obstacle;
    }));
    contact.strength = contact.pair.friction * entry(last_normal_, {contact.mover, contact.obstacle}, 0.0) / n;
    // What slid goes on sliding until the solution says otherwise.
    contact.stiffness = kContactRigidity * mass;
    open(contact.tangent_1);
    open(contact.tangent_2);
    const Vector3d velocity = mechanism.velocity_at(contact.body, contact.point);
    const double speed = std::hypot(velocity.dot(contact.tangent_1), velocity.dot(contact.tangent_2));
    const bool slid = entry<Vector3d>(last_slide_, {contact.mover, contact.obstacle}, Vector3d::Zero()) != Vector3d::Zero();
    if (slid && contact.strength > 0 && contact.strength < contact.stiffness * speed)
      slide(contact, speed, rows);
    else
      stick(contact, {contact.strength, contact.strength}, rows);
  }
  return !contacts_.empty();
}

void RigidContacts::stick(Contact& contact, const std::array<double, 2>& bound, RowSet& rows) {
  contact.slides = false;
  for (int k = 0; k < 2; ++k) {
    Row& row = rows[contact.row + 1 + k];
    row.weight = contact.stiffness;
    row.lower = -bound[static_cast<std::size_t>(k)];
    row.upper = bound[static_cast<std::size_t>(k)];
  }
}

void RigidContacts::slide(Contact& contact, double speed, RowSet& rows) {
  contact.slides = true;
  for (int k = 0; k < 2; ++k) {
    Row& row = rows[contact.row + 1 + k];
    row.weight = std::clamp(contact.strength / speed, 1e-30, contact.stiffness);
    row.lower = -std::numeric_limits<double>::infinity();
    row.upper = std::numeric_limits<double>::infinity();
    row.side = RowSide::free;
  }
}

bool RigidContacts::tighten(RowSet& rows, const Eigen::VectorXd& impulse, const Eigen::VectorXd& velocity) {
  if (contacts_.empty() || ++rounds_ > kMostFrictionRounds) return false;
  bool again = false;
  for (Contact& contact : contacts_) {
    const double before = contact.strength;
    contact.strength = contact.pair.friction * std::max(impulse[contact.row], 0.0);
    // Wheels that share a load may hand it to and fro; half a step each time ends that.
    if (rounds_ > kFreeRounds) contact.strength = 0.5 * (contact.strength + before);
    const std::array<double, 2> force = {impulse[contact.row + 1], impulse[contact.row + 2]};
    const double size = std::hypot(force[0], force[1]);
    const double allowed = 1e-3 * std::max(contact.strength, before) + 1e-12;
    const auto sliding = [&](int k) { return rows.dot(rows[contact.row + 1 + k], velocity); };
    const double speed = std::hypot(sliding(0), sliding(1));
    if (contact.slides) {
      const bool stiffest = rows[contact.row + 1].weight >= contact.stiffness;
      if (size < kStops * contact.strength && !stiffest && !contact.was_stopped) {
        contact.was_stopped = true;
        stick(contact, {contact.strength, contact.strength}, rows);
        again = true;
      } else if (std::abs(size - contact.strength) > allowed && !(stiffest && size < contact.strength)) {
        slide(contact, std::max(speed, contact.strength / contact.stiffness), rows);
        again = true;
      }
      continue;
    }
    const auto at_bound = [&](int k) { return std::abs(force[static_cast<std::size_t>(k)]) >= kSlides * rows[contact.row + 1 + k].upper; };
    if (size == 0 || (!at_bound(0) && !at_bound(1) && size < kSlides * contact.strength)) continue;  // sticks well inside its bounds
    if (size > contact.strength + allowed && rounds_ == 1 && speed * contact.stiffness < 2 * size) {
      // Only its corner of the square of bounds holds it: bounds along the force show how fast it slides.
      stick(contact, {contact.strength * std::abs(force[0]) / size, contact.strength * std::abs(force[1]) / size}, rows);
      again = true;
    } else if (speed * contact.stiffness > contact.strength + allowed) {
      slide(contact, speed, rows);
      again = true;
    } else if (std::abs(contact.strength - before) > allowed) {
      stick(contact, {contact.strength, contact.strength}, rows);
      again = true;
    }
  }
  return again;
}

void RigidContacts::close_rows(const Eigen::VectorXd& impulse, double h, double time, std::vector<Event>& events) {
  last_normal_.clear();
  last_slide_.clear();
  const auto n_wheels = static_cast<int>(wheel_force_.size());
  for (Contact& contact : contacts_) {
    const double normal = impulse[contact.row];
    if (normal <= 0) continue;
    entry(last_normal_, {contact.mover, contact.obstacle}, 0.0) += normal;
    const Vector3d friction = impulse[contact.row + 1] * contact.tangent_1 + impulse[contact.row + 2] * contact.tangent_2;
    if (friction.norm() >= kSlides * contact.pair.friction * normal)
      entry<Vector3d>(last_slide_, {contact.mover, contact.obstacle}, Vector3d::Zero()) += friction;
    if (contact.mover < n_wheels) wheel_force_[static_cast<std::size_t>(contact.mover)] += (normal * contact.normal + friction) / h;
    if (contact.obstacle < 0 && contact.mover < n_wheels) continue;  // wheels on the ground: what wheels are for
    const std::string what =
        contact.obstacle >= 0 ? "obstacle '" + model_->terrain->obstacles[static_cast<std::size_t>(contact.obstacle)].name + "'" : "the ground";
    double& touched = entry(last_touch_, {contact.mover, contact.obstacle}, -1.0);
    if (touched < 0)
      events.push_back({time, "contact_begin", name(contact.mover),
                        fmt::format("'{}' touches {} at t = {:.3f} s, x = {:.2f} m, y = {:.2f} m", name(contact.mover), what, time,
                                    contact.point.x(), contact.point.y())});
    touched = std::max(time, 0.0);
  }
  std::erase_if(last_touch_, [&](const auto& item) {
    if (item.second >= 0 && time - item.second <= kPartTime) return false;
    if (item.second >= 0)
      events.push_back({time, "contact_end", name(item.first.first),
                        fmt::format("'{}' came free of {} at t = {:.3f} s", name(item.first.first),
                                    item.first.second >= 0
                                        ? "obstacle '" + model_->terrain->obstacles[static_cast<std::size_t>(item.first.second)].name + "'"
                                        : std::string("the ground"),
                                    item.second)});
    return true;
  });
}

std::pair<double, std::string> RigidContacts::deepest_overlap() const {
  std::pair<double, std::string> deepest = {0, ""};
  for (const Contact& contact : contacts_)
    if (contact.obstacle >= 0 && contact.gap < deepest.first)
      deepest = {contact.gap, fmt::format("'{}' would start {:.3f} m inside obstacle '{}'", name(contact.mover), -contact.gap,
                                          model_->terrain->obstacles[static_cast<std::size_t>(contact.obstacle)].name)};
  return deepest;
}

}  // namespace rille
