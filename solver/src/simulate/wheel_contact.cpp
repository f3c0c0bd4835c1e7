#include "simulate/wheel_contact.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/slip.hpp"

namespace rille {
namespace {

using Eigen::Vector3d;

// Below this speed [m/s] slip is not reported: it would be a ratio of two noises.
constexpr double kSlipReportSpeed = 1e-4;

// A wheel that spins on the spot still ploughs its rut, and a locked one that is dragged still has its rolling torque: resistance sees this
// share of the other velocity too, so that it has its full size and its direction there, and rests only where both velocities do.
constexpr double kTravelShare = 0.01;

// A wheel touches hard ground along a line: this share of its radius long.
constexpr double kLineContact = 1e-3;

// Dry friction of the given size against one velocity; a negative size (an unusual soil) is taken as a given force.
void bound(Row& row, double h, double size, double speed) {
  if (size >= 0) {
    row.lower = -h * size;
    row.upper = h * size;
  } else {
    row.lower = row.upper = -std::copysign(h * size, speed);
  }
}

}  // namespace

WheelContact::WheelContact(const Rover& rover, const Terrain& terrain, int wheel, WheelEffects& effects)
    : wheel_(&rover.wheels[static_cast<std::size_t>(wheel)]),
      terrain_(&terrain),
      ground_(terrain),
      index_(wheel),
      effects_(&effects) {
  const Joint& joint = rover.joints[static_cast<std::size_t>(wheel_->joint)];
  body_ = joint.child;
  axle_in_model_ = joint.axis.y() < 0 ? Vector3d(-joint.axis) : joint.axis;
}

ContactStatus WheelContact::open_rows(const Mechanism& mechanism, double time, double h, RowSet& rows, RigidContacts& rigid, Ruts* ruts) {
  first_row_ = -1;
  n_rows_ = 0;
  on_rigid_ = false;
  const double load_before = std::exchange(rigid_load_, 0.0);
  const double radius = wheel_->radius;
  const Vector3d center = mechanism.to_world(body_, wheel_->center);
  const Vector3d axle = mechanism.rotate_to_world(body_, axle_in_model_);
  state_ = WheelState{};
  state_.center = center;

  Eigen::Vector2d heading(axle.y(), -axle.x());  // axle x up, level
  const double level = heading.norm();
  heading = level > 1e-6 ? Eigen::Vector2d(heading / level) : Eigen::Vector2d(1, 0);
  const auto below = ground_.height(center.x(), center.y());
  const auto plane = ground_.plane(center.x(), center.y(), heading, 0.5 * radius, 0.5 * wheel_->width);
  if (!below || !plane) return ContactStatus::off_terrain;
  state_.ground_height = *below;

  // Frame of the wheel: "up" is the ground's normal seen in the wheel's plane; a wheel that lies flat has none.
  const Vector3d in_plane = plane->normal - plane->normal.dot(axle) * axle;
  const double cos_camber = in_plane.norm();
  if (cos_camber < 0.1) return ContactStatus::in_air;
  const Vector3d up = in_plane / cos_camber;
  const Vector3d ahead = axle.cross(up);
  up_ = up;
  ahead_ = ahead;
  axle_ = axle;
  const Vector3d foot = center - radius * up;
  const double v = mechanism.velocity_at(body_, center).dot(ahead);
  const double u = radius * mechanism.angular_velocity(body_).dot(axle);
  const double v_y = mechanism.velocity_at(body_, foot).dot(axle);
  const Slip slip = slip_of(v, u, v_y);

  const double distance = (center.z() - plane->height) * plane->normal.z() / cos_camber;
  const double sinkage = radius - distance;
  const int soil_index = ground_.soil(center.x(), center.y());
  const WheelSoilLaw law = terrain_->response[static_cast<std::size_t>(index_)][static_cast<std::size_t>(soil_index)];
  if (law == WheelSoilLaw::rigid) {
    const double speed = mechanism.velocity_at(body_, center).norm();
    if (-sinkage < 5e-3 + 2 * h * speed)
      rigid.add_wheel_on_ground(index_, body_, foot, plane->normal, -sinkage * cos_camber,
                                terrain_->rigid_ground[static_cast<std::size_t>(index_)][static_cast<std::size_t>(soil_index)]);
    if (sinkage <= -5e-3) return ContactStatus::in_air;
    report_slip(slip, v, u, v_y);
    state_.sinkage = std::max(sinkage, 0.0);
    on_rigid_ = true;
    if (!effects_->empty() && load_before > 0)
      open_rigid_effects(mechanism, {.wheel = wheel_, .time = time, .angle = mechanism.joint_position(wheel_->joint), .position = center.head<2>(),
                                     .travel_speed = v, .rim_speed = u, .lateral_speed = v_y, .slip = slip}, load_before, h, rows);
    return ContactStatus::on_rigid;
  }
  if (sinkage <= 0) {
    sides_.fill(RowSide::free);
    return ContactStatus::in_air;
  }
  if (sinkage >= radius) return ContactStatus::buried;
  state_.sinkage = sinkage;
  report_slip(slip, v, u, v_y);

  const Soil& soil = terrain_->soils[static_cast<std::size_t>(soil_index)];
  const bool rolls = std::max({std::abs(v), std::abs(u), std::abs(v_y)}) >= kRollingSpeed;
  const Eigen::Vector2d place = center.head<2>();
  const Eigen::Vector2d left(-heading.y(), heading.x());
  SoilReaction reaction;
  double load = 0;
  double local_sinkage = sinkage;
  double exponent = soil.sinkage_exponent;
  double damping = soil.damping;
  if (effects_->empty()) {
    const auto react_to = [&](const Slip& motion) {
      return react(law, soil, {radius, wheel_->width}, {sinkage, motion.ratio, motion.travel_ratio, motion.lateral_ratio});
    };
    reaction = react_to(slip);
    load = rolls ? reaction.normal_load : react_to(slip_of(v, u, v_y, kRollingSpeed)).normal_load;
  } else {
    WheelSite site;
    site.wheel = wheel_;
    site.time = time;
    site.angle = mechanism.joint_position(wheel_->joint);
    site.position = place;
    site.travel_speed = v;
    site.rim_speed = u;
    site.lateral_speed = v_y;
    const bool reads_ruts = ruts != nullptr && std::any_of(effects_->begin(), effects_->end(), [](const auto& e) { return e->reads_ruts(); });
    if (reads_ruts) {  // where the wheel enters the soil, which it has not touched itself yet
      const double reach = std::sqrt(2 * radius * sinkage) + 2 * ruts->posting();
      site.rut_depth = ruts->depth(place + slip.direction * reach * heading, left, wheel_->width);
    }
    if (assume_steady_ && rolls) {
      site.slip = slip;
      site.sinkage = sinkage;
      for (auto& effect : *effects_) effect->begin(site);
    }
    const auto react_to = [&](const Slip& motion) {
      site.slip = motion;
      site.soil = soil;
      site.sinkage = sinkage;
      site.lateral_ratio = motion.lateral_ratio;
      return react_with(*effects_, law, site);
    };
    if (!rolls) load = react_to(slip_of(v, u, v_y, kRollingSpeed)).normal_load;
    reaction = react_to(slip);
    if (rolls) load = reaction.normal_load;
    for (auto& effect : *effects_) effect->advance(site, h);
    exponent = site.soil.sinkage_exponent;
    local_sinkage = radius * (1 - std::cos(reaction.entry_angle));
    if (load <= 0) return ContactStatus::in_air;
  }
  assume_steady_ = false;
  if (ruts != nullptr) mark(*ruts, sinkage, reaction.peak_stress, left);

  const double shear = (reaction.torque - reaction.rolling_torque) / radius;  // S in the direction of travel
  const double rolling = reaction.rolling_torque / radius;
  const double rut = shear - reaction.drawbar_pull;
  const double strength = h * reaction.shear_strength;
  const double stiffness = (exponent + 0.5) * load / local_sinkage;
  const double dashpot = damping * wheel_->width * reaction.contact_length;

  const auto open = [&](const Vector3d& point, const Vector3d& linear, const Vector3d& angular, double weight) -> Row& {
    return open_row(mechanism, RowKind::soil, point, linear, angular, weight, rows);
  };
  const double normal_slope = h * stiffness + dashpot;
  Row& normal = open(center, up, Vector3d::Zero(), h * normal_slope);
  normal.target = normal_slope > 0 ? load / normal_slope : 0;
  normal.lower = 0;

  Row& sliding = open(center, -ahead, radius * axle, h * std::abs(shear) / slip.sliding_speed);
  if (shear * slip.ratio >= 0) {
    // The strength bounds the whole shear S + T_0/r along the travel, of which the row is the part S, with opposite sign.
    sliding.lower = -strength + slip.direction * h * rolling;
    sliding.upper = strength + slip.direction * h * rolling;
  } else {
    sliding.lower = sliding.upper = -h * slip.direction * shear;
  }

  Row& rolling_row = open(center, Vector3d::Zero(), radius * axle, h * std::max(rolling, 0.0) / kParkingSpeed);
  bound(rolling_row, h, rolling, u);
  rolling_row.target = std::abs(v) > std::abs(u) ? -slip.direction * kTravelShare * std::abs(v) : 0;

  Row& rut_row = open(center, ahead, Vector3d::Zero(), h * std::max(rut, 0.0) / kParkingSpeed);
  bound(rut_row, h, rut, v);
  rut_row.target = std::abs(u) > std::abs(v) ? -slip.direction * kTravelShare * std::abs(u) : 0;

  Row& side = open(foot, axle, Vector3d::Zero(), h * reaction.side_force / slip.lateral_speed);
  side.lower = -strength;
  side.upper = strength;

  if (reaction.scrub_torque > 0) {
    Row& scrub = open(foot, Vector3d::Zero(), up, h * reaction.scrub_torque / kParkingSpeed);
    scrub.lower = -h * reaction.scrub_torque;
    scrub.upper = h * reaction.scrub_torque;
  }
  return ContactStatus::on_soil;
}

// What is the wheel's own and not the soil's, with the load of the last step.
void WheelContact::open_rigid_effects(const Mechanism& mechanism, const WheelSite& site, double load, double h, RowSet& rows) {
  SoilReaction reaction;
  reaction.normal_load = load;
  reaction.contact_length = kLineContact * wheel_->radius;
  for (const auto& effect : *effects_)
    if (effect->acts_on_rigid()) effect->after(site, reaction);
  const Vector3d none = Vector3d::Zero();
  const Vector3d foot = state_.center - wheel_->radius * up_;
  const double rolling = reaction.rolling_torque / wheel_->radius;
  if (rolling > 0) bound(open_row(mechanism, RowKind::contact, foot, none, wheel_->radius * axle_, h * rolling / kParkingSpeed, rows), h, rolling, site.rim_speed);
  const double scrub = reaction.scrub_torque;
  if (scrub > 0) bound(open_row(mechanism, RowKind::contact, foot, none, up_, h * scrub / kParkingSpeed, rows), h, scrub, 0);
  rigid_torque_row_ = rolling > 0 ? first_row_ : -1;
}

Row& WheelContact::open_row(const Mechanism& mechanism, RowKind kind, const Vector3d& point, const Vector3d& linear, const Vector3d& angular,
                            double weight, RowSet& rows) {
  const int row = rows.open(kind);
  if (n_rows_ == 0) first_row_ = row;
  mechanism.add_jacobian(body_, point, linear, angular, rows);
  rows[row].weight = std::max(weight, 1e-30);
  rows[row].side = sides_[static_cast<std::size_t>(n_rows_++)];
  return rows[row];
}

void WheelContact::report_slip(const Slip& slip, double v, double u, double v_y) {
  if (std::max(std::abs(v), std::abs(u)) <= kSlipReportSpeed) return;
  state_.slip_ratio = slip.ratio;
  state_.slip_angle = std::atan2(v_y, std::abs(v));
}

void WheelContact::mark(Ruts& ruts, double sinkage, double pressure, const Eigen::Vector2d& left) {
  const Eigen::Vector2d place = state_.center.head<2>();
  const double step = 0.5 * ruts.posting();
  if ((place - marked_at_).squaredNorm() < step * step && std::abs(sinkage - marked_sinkage_) < 1e-4) return;
  marked_at_ = place;
  marked_sinkage_ = sinkage;
  ruts.mark(place, left, wheel_->width, sinkage, pressure);
}

void WheelContact::close_rows(const RowSet& rows, const Eigen::VectorXd& impulse, double h) {
  if (first_row_ < 0) return;
  const auto force = [&](int k) { return impulse[first_row_ + k] / h; };
  for (int k = 0; k < n_rows_; ++k) sides_[static_cast<std::size_t>(k)] = rows[first_row_ + k].side;
  if (on_rigid_) {
    if (rigid_torque_row_ >= 0) state_.drive_torque = -wheel_->radius * force(rigid_torque_row_ - first_row_);
    return;
  }
  state_.normal_load = force(0);
  state_.drawbar_pull = force(3) - force(1);
  state_.side_force = force(4);
  state_.drive_torque = -wheel_->radius * (force(1) + force(2));
}

void WheelContact::add_rigid(const Vector3d& force) {
  if (force.isZero(0)) return;
  state_.normal_load += force.dot(up_);
  if (on_rigid_) rigid_load_ = std::max(0.0, force.dot(up_));
  state_.drawbar_pull += force.dot(ahead_);
  state_.side_force += force.dot(axle_);
  state_.drive_torque += wheel_->radius * force.dot(ahead_);
}

}  // namespace rille
