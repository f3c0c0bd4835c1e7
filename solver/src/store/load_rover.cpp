#include "store/parts.hpp"

#include <Eigen/Eigenvalues>
#include <cstring>

namespace rille {
namespace {

Index load_bodies(Database& database, Rover& rover) {
  Index index;
  Statement row(database, "SELECT * FROM body ORDER BY id");
  while (row.executeStep()) {
    Body body;
    body.id = row.getColumn("id").getInt64();
    body.name = row.getColumn("name").getString();
    const std::string subject = "body '" + body.name + "'";
    body.frame = vector(row, "frame_x", "frame_y", "frame_z", subject);
    body.mass = finite(row, "mass", subject);
    body.com = vector(row, "com_x", "com_y", "com_z", subject);
    const double ixy = finite(row, "ixy", subject);
    const double ixz = finite(row, "ixz", subject);
    const double iyz = finite(row, "iyz", subject);
    body.inertia << finite(row, "ixx", subject), ixy, ixz, ixy, finite(row, "iyy", subject), iyz, ixz, iyz,
        finite(row, "izz", subject);
    if (!(body.mass > 0)) throw InputRefused(fmt::format("mass of {} is {:g} kg; it must be above 0", subject, body.mass));
    const Vector3d moments = body.inertia.selfadjointView<Eigen::Lower>().eigenvalues();
    if (!(moments[0] > 0))
      throw InputRefused(fmt::format("inertia of {} has the principal moment {:g} kg m^2; all must be above 0", subject, moments[0]));
    if (moments[2] > (moments[0] + moments[1]) * (1 + 1e-6))
      throw InputRefused(fmt::format("inertia of {} breaks the triangle inequality: {:g} > {:g} + {:g} kg m^2; no body has such "
                                     "moments, correct the inertia",
                                     subject, moments[2], moments[0], moments[1]));
    index[body.id] = static_cast<int>(rover.bodies.size());
    rover.bodies.push_back(body);
  }
  return index;
}

Index load_joints(Database& database, const Index& bodies, Rover& rover) {
  Index index;
  Statement row(database,
                "SELECT joint.*, lower, upper, stiffness, damping FROM joint LEFT JOIN joint_limit ON joint_limit.joint_id = joint.id ORDER BY id");
  while (row.executeStep()) {
    Joint joint;
    joint.id = row.getColumn("id").getInt64();
    joint.name = row.getColumn("name").getString();
    const std::string subject = "joint '" + joint.name + "'";
    joint.kind = word_of<JointKind>(row, "kind",
                                    {{"hinge", JointKind::hinge},
                                     {"prismatic", JointKind::prismatic},
                                     {"fixed", JointKind::fixed},
                                     {"spherical", JointKind::spherical}},
                                    subject);
    if (!row.getColumn("parent_body_id").isNull())
      joint.parent = index_of(bodies, row.getColumn("parent_body_id"), "body", subject);
    joint.child = index_of(bodies, row.getColumn("child_body_id"), "body", subject);
    joint.point = vector(row, "x", "y", "z", subject);
    joint.axis = vector(row, "axis_x", "axis_y", "axis_z", subject);
    if (!(joint.axis.norm() > 1e-3)) throw InputRefused(fmt::format("the axis of {} has length {:g}; give a unit vector", subject, joint.axis.norm()));
    joint.axis.normalize();
    if (!row.getColumn("lower").isNull()) {
      if (!joint.has_one_freedom())
        throw InputRefused(fmt::format("{} has a limit, but only hinges and prismatic joints can; remove the limit", subject));
      joint.limit = Limit{.lower = finite(row, "lower", subject), .upper = finite(row, "upper", subject)};
      if (!row.getColumn("stiffness").isNull()) joint.limit->stiffness = above_zero(row, "stiffness", subject);
      if (!row.getColumn("damping").isNull()) joint.limit->damping = not_negative(row, "damping", subject);
    }
    index[joint.id] = static_cast<int>(rover.joints.size());
    rover.joints.push_back(joint);
  }
  return index;
}

Index load_drives(Database& database, const Index& joints, Rover& rover) {
  Index index;
  Statement row(database, "SELECT * FROM drive ORDER BY id");
  while (row.executeStep()) {
    Drive drive;
    drive.id = row.getColumn("id").getInt64();
    drive.name = row.getColumn("name").getString();
    const std::string subject = "drive '" + drive.name + "'";
    drive.joint = index_of(joints, row.getColumn("joint_id"), "joint", subject);
    drive.mode = word_of<DriveMode>(
        row, "mode",
        {{"speed", DriveMode::speed}, {"torque", DriveMode::torque}, {"position", DriveMode::position}}, subject);
    drive.max_torque = above_zero(row, "max_torque", subject);
    drive.position_gain = above_zero(row, "position_gain", subject);
    drive.integral_gain = within(row, "integral_gain", 0, 1e12, subject);
    if (!row.getColumn("max_speed").isNull()) drive.max_speed = above_zero(row, "max_speed", subject);
    if (!row.getColumn("speed_gain").isNull()) drive.speed_gain = above_zero(row, "speed_gain", subject);
    if (!row.getColumn("torque_constant").isNull()) drive.torque_constant = above_zero(row, "torque_constant", subject);
    if (!row.getColumn("resistance").isNull()) drive.resistance = above_zero(row, "resistance", subject);
    require_one_freedom(rover, drive.joint, subject);
    index[drive.id] = static_cast<int>(rover.drives.size());
    rover.drives.push_back(drive);
  }
  return index;
}

void load_couplings(Database& database, const Index& bodies, const Index& joints, Rover& rover) {
  Statement row(database, "SELECT * FROM differential ORDER BY id");
  while (row.executeStep()) {
    Differential differential;
    differential.name = row.getColumn("name").getString();
    const std::string subject = "differential '" + differential.name + "'";
    differential.carrier = index_of(bodies, row.getColumn("carrier_body_id"), "body", subject);
    differential.joint_a = index_of(joints, row.getColumn("joint_a_id"), "joint", subject);
    differential.joint_b = index_of(joints, row.getColumn("joint_b_id"), "joint", subject);
    rover.differentials.push_back(differential);
  }
  Statement pair(database, "SELECT * FROM gear ORDER BY id");
  while (pair.executeStep()) {
    Gear gear;
    gear.name = pair.getColumn("name").getString();
    const std::string subject = "gear '" + gear.name + "'";
    gear.joint_a = index_of(joints, pair.getColumn("joint_a_id"), "joint", subject);
    gear.joint_b = index_of(joints, pair.getColumn("joint_b_id"), "joint", subject);
    gear.ratio = finite(pair, "ratio", subject);
    require_one_freedom(rover, gear.joint_a, subject);
    require_one_freedom(rover, gear.joint_b, subject);
    rover.gears.push_back(gear);
  }
}

void load_wheels(Database& database, const Index& joints, Rover& rover) {
  Statement row(database,
                "SELECT wheel.*, count AS grousers, height AS grouser_height FROM wheel LEFT JOIN grouser ON grouser.wheel_id = wheel.id ORDER BY id");
  while (row.executeStep()) {
    Wheel wheel;
    wheel.id = row.getColumn("id").getInt64();
    wheel.name = row.getColumn("name").getString();
    const std::string subject = "wheel '" + wheel.name + "'";
    wheel.joint = index_of(joints, row.getColumn("joint_id"), "joint", subject);
    if (rover.joints[wheel.joint].kind != JointKind::hinge)
      throw InputRefused(fmt::format("{} turns on joint '{}', which is not a hinge", subject, rover.joints[wheel.joint].name));
    if (!row.getColumn("material_id").isNull()) wheel.material_id = row.getColumn("material_id").getInt64();
    wheel.center = vector(row, "x", "y", "z", subject);
    wheel.radius = within(row, "radius", kSmallestWheel, kLargestWheel, subject);
    wheel.width = within(row, "width", kSmallestWheel, kLargestWheel, subject);
    if (!row.getColumn("grousers").isNull()) {
      wheel.grouser_count = row.getColumn("grousers").getInt();
      wheel.grouser_height = above_zero(row, "grouser_height", subject);
    }
    rover.wheels.push_back(wheel);
  }
}

// Wheels collide as cylinders; their own shapes in the database are for other programs.
void load_shapes(Database& database, const Index& bodies, Rover& rover) {
  Statement row(database,
                "SELECT * FROM collision_shape WHERE body_id NOT IN "
                "(SELECT child_body_id FROM wheel JOIN joint ON joint.id = wheel.joint_id) ORDER BY id");
  while (row.executeStep()) {
    const std::string subject = fmt::format("collision_shape {}", row.getColumn("id").getInt64());
    rover.shapes.push_back({index_of(bodies, row.getColumn("body_id"), "body", subject), load_shape(row, subject)});
  }
}

void load_closures(Database& database, const Index& bodies, Rover& rover) {
  Statement row(database, "SELECT * FROM loop_closure ORDER BY id");
  while (row.executeStep()) {
    LoopClosure closure;
    closure.name = row.getColumn("name").getString();
    const std::string subject = "loop_closure '" + closure.name + "'";
    closure.body_a = index_of(bodies, row.getColumn("body_a_id"), "body", subject);
    if (!row.getColumn("body_b_id").isNull()) closure.body_b = index_of(bodies, row.getColumn("body_b_id"), "body", subject);
    closure.point = vector(row, "x", "y", "z", subject);
    rover.loop_closures.push_back(closure);
  }
}

void load_sensors(Database& database, Rover& rover) {
  Statement row(database, "SELECT * FROM sensor ORDER BY id");
  while (row.executeStep()) {
    Sensor sensor;
    sensor.id = row.getColumn("id").getInt64();
    sensor.name = row.getColumn("name").getString();
    sensor.quantity = row.getColumn("quantity").getString();
    sensor.target = row.getColumn("target").getString();
    sensor.rate = above_zero(row, "rate", "sensor '" + sensor.name + "'");
    sensor.body_frame = row.getColumn("frame").getString() == "body";
    rover.sensors.push_back(sensor);
  }
}

}  // namespace

void require_one_freedom(const Rover& rover, int joint, const std::string& subject) {
  const Joint& carried = rover.joints[joint];
  if (!carried.has_one_freedom())
    throw InputRefused(fmt::format("{} acts on joint '{}', which is neither a hinge nor prismatic", subject, carried.name));
}

// A convex solid from the columns that collision_shape and obstacle share.
Shape load_shape(Statement& row, const std::string& subject) {
  Shape shape;
  shape.kind = word_of<ShapeKind>(row, "kind",
                                  {{"box", ShapeKind::box}, {"sphere", ShapeKind::sphere}, {"cylinder", ShapeKind::cylinder}, {"hull", ShapeKind::hull}},
                                  subject);
  shape.center = vector(row, "x", "y", "z", subject);
  shape.rotation = rotation(row, "qw", "qx", "qy", "qz", subject);
  if (!row.getColumn("material_id").isNull()) shape.material_id = row.getColumn("material_id").getInt64();
  if (shape.kind == ShapeKind::hull) {
    const Column data = row.getColumn("vertices");
    const int count = data.getBytes() / 24;
    for (int k = 0; k < count; ++k) {
      Vector3d vertex;
      std::memcpy(vertex.data(), static_cast<const char*>(data.getBlob()) + 24 * k, 24);
      if (!vertex.allFinite()) throw InputRefused(fmt::format("vertex {} of {} is not finite; build it again", k, subject));
      shape.vertices.push_back(vertex);
    }
    if (count < 4) throw InputRefused(fmt::format("{} is a hull of {} vertices; it needs at least 4", subject, count));
    return shape;
  }
  const bool box = shape.kind == ShapeKind::box;
  shape.size.x() = above_zero(row, "size_x", subject);
  shape.size.y() = box ? above_zero(row, "size_y", subject) : shape.size.x();
  shape.size.z() = shape.kind == ShapeKind::sphere ? shape.size.x() : above_zero(row, "size_z", subject);
  return shape;
}

Rover load_rover(Database& database, RoverKeys& keys) {
  Rover rover;
  const Index bodies = load_bodies(database, rover);
  keys.joints = load_joints(database, bodies, rover);
  keys.drives = load_drives(database, keys.joints, rover);
  load_couplings(database, bodies, keys.joints, rover);
  load_wheels(database, keys.joints, rover);
  load_shapes(database, bodies, rover);
  load_closures(database, bodies, rover);
  load_sensors(database, rover);
  return rover;
}

}  // namespace rille
