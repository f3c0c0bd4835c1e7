#include "simulate/placement.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <limits>

#include "model/error.hpp"
#include "world/ground.hpp"

namespace rille {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

BodyState pose_on_terrain(const Model& model, Mechanism& mechanism) {
  const Scenario& scenario = model.scenario;
  const auto& wheels = model.rover.wheels;
  if (mechanism.held_by_world())
    throw InputRefused(fmt::format("scenario '{}' places the model on the terrain, but it is held by the world; "
                                   "use placement 'as_given'", scenario.name));
  if (wheels.size() < 3)
    throw InputRefused(fmt::format("scenario '{}' places the model on the terrain, but it has {} wheels and needs at least 3; "
                                   "use placement 'as_given'", scenario.name, wheels.size()));
  if (!model.terrain)
    throw InputRefused(fmt::format("scenario '{}' places the model on the terrain, but names no terrain; "
                                   "give it one or use placement 'as_given'", scenario.name));
  const Ground ground(*model.terrain);
  const HeightGrid& grid = *model.terrain->grid;
  const Vector3d forward = scenario.start_rotation * Vector3d::UnitX();
  const double heading = std::atan2(forward.y(), forward.x());

  BodyState pose;
  pose.rotation = Eigen::AngleAxisd(heading, Vector3d::UnitZ());
  pose.position = Vector3d(scenario.start_position.x(), scenario.start_position.y(), 0);
  const auto n = static_cast<Eigen::Index>(wheels.size());
  // The ground under the wheels depends on the tilt and the tilt on the ground: three rounds reach millimetres.
  for (int round = 0; round < 3; ++round) {
    mechanism.set_root(pose);
    mechanism.update_kinematics();
    Eigen::MatrixXd plane(n, 3);
    Eigen::VectorXd heights(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const Wheel& wheel = wheels[static_cast<std::size_t>(k)];
      const Vector3d center = mechanism.to_world(model.rover.joints[wheel.joint].child, wheel.center);
      const auto height = ground.height(center.x(), center.y());
      if (!height)
        throw InputRefused(fmt::format(
            "wheel '{}' would start at x = {:.2f} m, y = {:.2f} m, outside terrain '{}' (x {:.2f} to {:.2f} m, y {:.2f} to "
            "{:.2f} m) or on a missing height; move the scenario's start",
            wheel.name, center.x(), center.y(), model.terrain->name, grid.x_west,
            grid.x_west + (grid.n_cols - 1) * grid.posting_x, grid.y_north - (grid.n_rows - 1) * grid.posting_y,
            grid.y_north));
      plane.row(k) << center.x() - pose.position.x(), center.y() - pose.position.y(), 1;
      heights[k] = *height;
    }
    const Vector3d fit = plane.colPivHouseholderQr().solve(heights);
    const Vector3d normal = Vector3d(-fit.x(), -fit.y(), 1).normalized();
    const Vector3d left = normal.cross(Vector3d(std::cos(heading), std::sin(heading), 0)).normalized();
    Matrix3d axes;
    axes << left.cross(normal), left, normal;
    pose.rotation = Quaterniond(axes);
    pose.position.z() = fit.z();
  }

  mechanism.set_root(pose);
  mechanism.update_kinematics();
  double lowest = std::numeric_limits<double>::infinity();  // clearance of the lowest wheel
  for (const Wheel& wheel : wheels) {
    const Joint& joint = model.rover.joints[wheel.joint];
    const Vector3d center = mechanism.to_world(joint.child, wheel.center);
    const Vector3d axle = mechanism.rotate_to_world(joint.child, joint.axis);
    const Eigen::Vector2d across(axle.y(), -axle.x());
    const auto plane = ground.plane(center.x(), center.y(), across.normalized(), 0.5 * wheel.radius, 0.5 * wheel.width);
    if (!plane)
      throw InputRefused(fmt::format("wheel '{}' would start at the border of terrain '{}'; move the scenario's start",
                                     wheel.name, model.terrain->name));
    const Vector3d in_plane = plane->normal - plane->normal.dot(axle) * axle;
    const double reach = wheel.radius * in_plane.norm() / plane->normal.z();
    lowest = std::min(lowest, center.z() - plane->height - reach);
  }
  pose.position.z() -= lowest;
  return pose;
}

}  // namespace rille
