// Small models for the tests, made of values without a database.
#pragma once

#include "model/model.hpp"

namespace rille::test {

inline Body box_body(const std::string& name, double mass, const Eigen::Vector3d& com, const Eigen::Vector3d& size) {
  Body body;
  body.name = name;
  body.mass = mass;
  body.com = com;
  const Eigen::Vector3d s = size.cwiseProduct(size);
  body.inertia = Eigen::Vector3d(s.y() + s.z(), s.x() + s.z(), s.x() + s.y()).asDiagonal();
  body.inertia *= mass / 12;
  return body;
}

// Nominal lunar regolith, Carrier et al. 1991 (Lunar Sourcebook ch. 9).
inline Soil lunar_soil() {
  Soil soil;
  soil.sinkage_exponent = 1;
  soil.cohesive_modulus = 1400;
  soil.frictional_modulus = 820e3;
  soil.cohesion = 170;
  soil.friction_angle = 35 * M_PI / 180;
  soil.shear_modulus = 0.018;
  soil.lateral_shear_modulus = 0.018;
  soil.peak_angle_offset = 0.4;
  soil.peak_angle_slip = 0.15;
  soil.damping = 3e4;
  return soil;
}

// Plane terrain z = slope x, 40 m x 40 m around the origin.
inline Terrain plane_terrain(double slope, int n_wheels, const Soil& soil = lunar_soil()) {
  Terrain terrain;
  terrain.name = "plane";
  terrain.soils = {soil};
  terrain.soil_names = {"lunar_sourcebook"};
  terrain.response.assign(static_cast<std::size_t>(n_wheels), {WheelSoilLaw::bekker_wong});
  terrain.rigid_ground.assign(static_cast<std::size_t>(n_wheels) + 8, {RigidPair{}});  // enough for a few shapes
  terrain.rigid.resize(static_cast<std::size_t>(n_wheels) + 8);
  HeightGrid grid;
  grid.n_rows = grid.n_cols = 41;
  grid.posting_x = grid.posting_y = 1;
  grid.x_west = -20;
  grid.y_north = 20;
  for (int i = 0; i < grid.n_rows; ++i)
    for (int j = 0; j < grid.n_cols; ++j) grid.heights.push_back(slope * (grid.x_west + j));
  terrain.grid = std::make_shared<const HeightGrid>(std::move(grid));
  return terrain;
}

// Cart with four driven wheels, axles along y; each wheel carries about `load` kilograms.
inline Rover cart(double load) {
  Rover rover;
  const double wheel_mass = 1.5;
  rover.bodies.push_back(box_body("chassis", 4 * (load - wheel_mass), {0, 0, 0.2}, {0.8, 0.5, 0.2}));
  for (const double x : {0.5, -0.5})
    for (const double y : {0.4, -0.4}) {
      const std::string name = std::string(x > 0 ? "front_" : "rear_") + (y > 0 ? "left" : "right");
      const int index = static_cast<int>(rover.bodies.size());
      rover.bodies.push_back(box_body(name, wheel_mass, {x, y, 0.15}, {0.25, 0.16, 0.25}));
      Joint joint;
      joint.name = name;
      joint.parent = 0;
      joint.child = index;
      joint.point = {x, y, 0.15};
      joint.axis = Eigen::Vector3d::UnitY();
      rover.joints.push_back(joint);
      Drive drive;
      drive.name = name;
      drive.joint = index - 1;
      drive.mode = DriveMode::speed;
      drive.max_torque = 20;
      rover.drives.push_back(drive);
      Wheel wheel;
      wheel.name = name;
      wheel.joint = index - 1;
      wheel.center = joint.point;
      wheel.radius = 0.15;
      wheel.width = 0.165;
      rover.wheels.push_back(wheel);
    }
  return rover;
}

// Six-wheel rocker-bogie of about 140 kg: differential, four steered corner wheels, 16 hinges, 22 degrees of freedom.
inline Rover rocker_bogie() {
  Rover rover;
  const auto add_body = [&](const std::string& name, double mass, const Eigen::Vector3d& com, const Eigen::Vector3d& size) {
    rover.bodies.push_back(box_body(name, mass, com, size));
    return static_cast<int>(rover.bodies.size()) - 1;
  };
  const auto add_hinge = [&](const std::string& name, int parent, int child, const Eigen::Vector3d& point,
                             const Eigen::Vector3d& axis, std::optional<Limit> limit) {
    Joint joint;
    joint.name = name;
    joint.parent = parent;
    joint.child = child;
    joint.point = point;
    joint.axis = axis;
    joint.limit = limit;
    rover.joints.push_back(joint);
    return static_cast<int>(rover.joints.size()) - 1;
  };
  const auto add_drive = [&](const std::string& name, int joint, DriveMode mode, double max_torque) {
    Drive drive;
    drive.name = name;
    drive.joint = joint;
    drive.mode = mode;
    drive.max_torque = max_torque;
    rover.drives.push_back(drive);
  };
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const int chassis = add_body("chassis", 85, {0, 0, 0.55}, {0.9, 0.6, 0.35});
  int rockers[2] = {};
  for (const int side : {0, 1}) {
    const double lateral = side == 0 ? 0.5 : -0.5;
    const std::string tail = side == 0 ? "_left" : "_right";
    const int rocker = add_body("rocker" + tail, 6, {0.2, lateral, 0.4}, {0.7, 0.06, 0.1});
    rockers[side] = add_hinge("rocker" + tail, chassis, rocker, {0, lateral, 0.5}, y, Limit{-0.6, 0.6});
    const int bogie = add_body("bogie" + tail, 4, {-0.3, lateral, 0.3}, {0.6, 0.06, 0.1});
    const int bogie_joint = add_hinge("bogie" + tail, rocker, bogie, {-0.3, lateral, 0.3}, y, Limit{-0.6, 0.6});
    (void)bogie_joint;
    for (const auto& [place, x, carrier] :
         {std::tuple{"front", 0.6, rocker}, std::tuple{"middle", 0.0, bogie}, std::tuple{"rear", -0.6, bogie}}) {
      const std::string name = std::string(place) + tail;
      int mount = carrier;
      if (std::string(place) != "middle") {
        mount = add_body("knuckle_" + name, 1.5, {x, lateral, 0.3}, {0.08, 0.08, 0.25});
        const int steering = add_hinge("steering_" + name, carrier, mount, {x, lateral, 0.4}, z, Limit{-1.1, 1.1});
        add_drive("steering_" + name, steering, DriveMode::position, 30);
      }
      const int wheel_body = add_body("wheel_" + name, 4, {x, lateral, 0.15}, {0.25, 0.16, 0.25});
      const int hinge = add_hinge("wheel_" + name, mount, wheel_body, {x, lateral, 0.15}, y, std::nullopt);
      add_drive("wheel_" + name, hinge, DriveMode::speed, 15);
      Wheel wheel;
      wheel.name = "wheel_" + name;
      wheel.joint = hinge;
      wheel.center = {x, lateral, 0.15};
      wheel.radius = 0.15;
      wheel.width = 0.165;
      rover.wheels.push_back(wheel);
    }
  }
  Differential differential;
  differential.name = "differential";
  differential.carrier = chassis;
  differential.joint_a = rockers[0];
  differential.joint_b = rockers[1];
  rover.differentials.push_back(differential);
  return rover;
}

inline Scenario scenario(double gravity, double step, double duration) {
  Scenario s;
  s.name = "test";
  s.gravity = {0, 0, -gravity};
  s.step = step;
  s.duration = duration;
  return s;
}

}  // namespace rille::test
