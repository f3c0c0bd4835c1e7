// Expression: a formula for what has no name yet, added to one quantity of its target:
//   joint: joint.effort;  wheel: wheel.normal_load, wheel.drawbar_pull, wheel.side_force, wheel.drive_torque;
//   body: part.force_x ... part.torque_z in W.   value = gain x formula(state variables, constants)
// Signs as in table wheel_state: side_force and drive_torque count against the motion. The formula's dimension is checked (formula.hpp).
// While the mechanism settles, its time is 0.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "effects/effect.hpp"
#include "effects/formula.hpp"

namespace rille::effects {
namespace {

const std::vector<Variable> kJoint = {{"time", "s"}, {"position", "rad"}, {"velocity", "rad/s"}, {"drive_effort", "N m"}};
const std::vector<Variable> kSlide = {{"time", "s"}, {"position", "m"}, {"velocity", "m/s"}, {"drive_effort", "N"}};
const std::vector<Variable> kWheel = {{"time", "s"},         {"angle", "rad"},       {"x", "m"},           {"y", "m"},
                                      {"sinkage", "m"},      {"slip_ratio", "1"},    {"slip_angle", "rad"}, {"travel_speed", "m/s"},
                                      {"rim_speed", "m/s"},  {"lateral_speed", "m/s"}, {"normal_load", "N"}, {"radius", "m"},
                                      {"width", "m"}};
const std::vector<Variable> kBody = {{"time", "s"}, {"mass", "kg"}, {"x", "m"},      {"y", "m"},      {"z", "m"},      {"vx", "m/s"},
                                     {"vy", "m/s"}, {"vz", "m/s"},  {"wx", "rad/s"}, {"wy", "rad/s"}, {"wz", "rad/s"}};

class JointExpression final : public JointEffect {
 public:
  JointExpression(const EffectRow& row, bool slides)
      : gain_(row.parameter("gain")), formula_(row.formula, slides ? kSlide : kJoint, row.constants, slides ? "N" : "N m") {}
  double effort(const JointMotion& m) const override {
    return gain_ * formula_({std::max(m.time, 0.0), m.position, m.velocity, m.drive_effort});
  }
  bool depends_on_velocity() const override { return true; }

 private:
  double gain_;
  Formula formula_;
};

class WheelExpression final : public WheelEffect {
 public:
  WheelExpression(const EffectRow& row, const std::string& unit)
      : gain_(row.parameter("gain")), output_(row.output), formula_(row.formula, kWheel, row.constants, unit) {}
  void after(const WheelSite& s, SoilReaction& reaction) const override {
    const double value = gain_ * formula_({std::max(s.time, 0.0), s.angle, s.position.x(), s.position.y(), s.sinkage, s.slip.ratio,
                                           std::atan2(s.lateral_speed, std::abs(s.travel_speed)), s.travel_speed, s.rim_speed,
                                           s.lateral_speed, reaction.normal_load, s.wheel->radius, s.wheel->width});
    if (output_ == "wheel.normal_load") reaction.normal_load += value;
    if (output_ == "wheel.drawbar_pull") reaction.drawbar_pull += value;
    if (output_ == "wheel.side_force") reaction.side_force += value;
    if (output_ == "wheel.drive_torque") {
      reaction.torque += value;
      reaction.rolling_torque += value;
    }
  }

 private:
  double gain_;
  std::string output_;
  Formula formula_;
};

class BodyExpression final : public BodyEffect {
 public:
  BodyExpression(const EffectRow& row, bool torque, int axis)
      : gain_(row.parameter("gain")), torque_(torque), axis_(axis), formula_(row.formula, kBody, row.constants, torque ? "N m" : "N") {}
  void push(const BodyMotion& b, double h, std::vector<BodyForce>& forces) const override {
    const auto value = [&](const Eigen::Vector3d& v, const Eigen::Vector3d& w) {
      return gain_ * formula_({std::max(b.time, 0.0), b.mass, b.com.x(), b.com.y(), b.com.z(), v.x(), v.y(), v.z(), w.x(), w.y(), w.z()});
    };
    const Eigen::Vector3d axis = Eigen::Vector3d::Unit(axis_);
    const double now = value(b.velocity, b.angular_velocity);
    // The slope against the body's own speed is taken implicitly where it damps, so that a strong drag does not ring.
    constexpr double kNudge = 1e-6;
    const double slope = ((torque_ ? value(b.velocity, b.angular_velocity + kNudge * axis) : value(b.velocity + kNudge * axis, b.angular_velocity)) - now) / kNudge;
    if (slope < 0) {
      const double speed = torque_ ? b.angular_velocity[axis_] : b.velocity[axis_];
      forces.push_back({.direction = axis, .angular = torque_, .weight = -h * slope, .target = speed - now / slope});
    } else {
      forces.push_back(given_force(now * axis, h, torque_));
    }
  }

 private:
  double gain_;
  bool torque_;
  int axis_;
  Formula formula_;
};

}  // namespace

void attach_expression(const Attachment& a) {
  const EffectRow& row = a.row;
  const auto refuse = [&](const std::string& outputs) {
    return InputRefused(fmt::format("the expression on '{}' has the output '{}'; it may be {}", row.target_name, row.output, outputs));
  };
  switch (row.target) {
    case EffectTarget::joint:
      if (row.output != "joint.effort") throw refuse("joint.effort");
      a.each(a.effects.joints.size(), [&](std::size_t k) {
        const Joint& joint = a.model.rover.joints[k];
        if (joint.has_one_freedom())
          a.effects.joints[k].push_back(std::make_unique<JointExpression>(row, joint.kind == JointKind::prismatic));
      });
      return;
    case EffectTarget::wheel: {
      const bool torque = row.output == "wheel.drive_torque";
      if (!torque && row.output != "wheel.normal_load" && row.output != "wheel.drawbar_pull" && row.output != "wheel.side_force")
        throw refuse("wheel.normal_load, wheel.drawbar_pull, wheel.side_force or wheel.drive_torque");
      a.each(a.effects.wheels.size(),
             [&](std::size_t k) { a.effects.wheels[k].push_back(std::make_unique<WheelExpression>(row, torque ? "N m" : "N")); });
      return;
    }
    case EffectTarget::body: {
      constexpr std::array<const char*, 6> kOutputs = {"part.force_x",  "part.force_y",  "part.force_z",
                                                       "part.torque_x", "part.torque_y", "part.torque_z"};
      const auto found = std::find(kOutputs.begin(), kOutputs.end(), row.output);
      if (found == kOutputs.end()) throw refuse(fmt::format("{}", fmt::join(kOutputs, ", ")));
      const auto which = static_cast<int>(found - kOutputs.begin());
      a.each(a.effects.bodies.size(),
             [&](std::size_t k) { a.effects.bodies[k].push_back(std::make_unique<BodyExpression>(row, which >= 3, which % 3)); });
      return;
    }
    default: throw InputRefused("an expression acts on a wheel, a joint or a body; name one as its target");
  }
}

}  // namespace rille::effects
