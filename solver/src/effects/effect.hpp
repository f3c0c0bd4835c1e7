// What an effect may do, by what it acts on. Each law is one file <name>.cpp; registry.hpp knows them all.
//
// Effects are values and pure functions of what they are shown: they know neither Bullet nor the database nor the order of a step.
// An effect without amplitude is never attached (see store/load), so that it leaves every bit of a trajectory as it was.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <vector>

#include "model/archive.hpp"
#include "model/model.hpp"
#include "physics/slip.hpp"
#include "physics/wheel_soil.hpp"

namespace rille {

// ---------------------------------------------------------------- wheels

// A wheel on soil, before and after its stresses are integrated.
struct WheelSite {
  const Wheel* wheel = nullptr;
  double time = 0;                                     // [s] at the step's beginning; below zero while the mechanism settles
  double angle = 0;                                    // [rad] of the wheel's joint
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  // [m] of the contact in W
  double travel_speed = 0;                             // [m/s] v of the centre along the heading
  double rim_speed = 0;                                // [m/s] u = r w
  double lateral_speed = 0;                            // [m/s] v_y
  Slip slip;
  double rut_depth = 0;                                // [m] that earlier wheels left where this one enters
  // What `before` may change:
  Soil soil;
  double sinkage = 0;                                  // [m] that the law is asked for
  double lateral_ratio = 0;                            // [-] as integrated
};

class WheelEffect {
 public:
  virtual ~WheelEffect() = default;
  virtual bool reads_ruts() const { return false; }
  virtual bool acts_on_rigid() const { return false; }  // its scrub and rolling torque are the wheel's own, on hard ground too
  virtual void before(WheelSite&) const {}
  virtual void after(const WheelSite&, SoilReaction&) const {}
  virtual void advance(const WheelSite&, double /*h*/) {}  // once a step
  // Steady rolling at this site: what a bench sees after a long time, on the mean over a turn.
  virtual void settle(const WheelSite&) {}
  // A run that starts in mid-motion at this site: memories as after steady rolling.
  virtual void begin(const WheelSite& site) { settle(site); }
  virtual void visit(Archive&) {}
};
using WheelEffects = std::vector<std::unique_ptr<WheelEffect>>;

// Reaction of the soil with all effects of a wheel. `site.sinkage` and `site.soil` are those of the base model on entry.
SoilReaction react_with(const WheelEffects& effects, WheelSoilLaw law, WheelSite& site);

// ---------------------------------------------------------------- joints and drives

struct JointMotion {
  double time = 0;          // [s] at the step's beginning; below zero while the mechanism settles
  double step = 0;          // [s] that its efforts act from then on
  double position = 0;      // [rad or m]
  double velocity = 0;      // [rad/s or m/s]
  double drive_effort = 0;  // [N m or N] of its drive in the last step
};

struct JointFriction {
  double dry = 0;      // [N m or N] largest dry friction
  double viscous = 0;  // [N m s/rad or N s/m]
};

// What stands between a command and the joint.
struct DriveLine {
  double gain = 1;                    // [-] set value per command
  double lag = 0;                     // [s] time constant of the set value
  double inverse_no_load_speed = 0;   // [s/rad] 1/w_0 of the torque-speed line
  double sag = 0;                     // [-] fraction of the supply that is lost at the largest effort
  double compliance = 0;              // [rad/(N m)] between motor and joint
  double damping = 0;                 // [N m s/rad] of the same
  double gap = 0;                     // [rad] full play between motor and joint
  double rotor_inertia = 0;           // [kg m^2] at the joint; counts for torque drives
};

class JointEffect {
 public:
  virtual ~JointEffect() = default;
  virtual void rub(const JointMotion&, JointFriction&) const {}
  virtual void shape(DriveLine&) const {}
  virtual double effort(const JointMotion&) const { return 0; }  // [N m or N] added to the joint
  virtual bool depends_on_velocity() const { return false; }     // then its slope is taken implicitly
};
using JointEffects = std::vector<std::unique_ptr<JointEffect>>;

// ---------------------------------------------------------------- bodies

struct BodyMotion {
  double time = 0;                                              // [s] as of a joint
  double mass = 0;                                              // [kg]
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();            // [m/s^2] in W
  Eigen::Vector3d com = Eigen::Vector3d::Zero();                // [m] in W
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();           // [m/s] of the centre of mass
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();   // [rad/s]
};

// Force along `direction` at the centre of mass (torque about it for `angular`): clamp(weight (target - velocity), lower, upper) / h.
struct BodyForce {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();
  bool angular = false;
  double weight = 0;  // [impulse per speed]
  double target = 0;  // [speed]
  double lower = -std::numeric_limits<double>::infinity();  // [impulse]
  double upper = std::numeric_limits<double>::infinity();
};

class BodyEffect {
 public:
  virtual ~BodyEffect() = default;
  virtual void push(const BodyMotion&, double h, std::vector<BodyForce>&) const = 0;
  // After the step: velocity of the centre of mass is the new one.
  virtual void advance(const BodyMotion&, double /*h*/) {}
  virtual void start(const BodyMotion&) {}
  virtual void carry(const Eigen::Vector3d& /*velocity*/) {}  // the body was put elsewhere, where it is faster by this
  virtual void visit(Archive&) {}
};
using BodyEffects = std::vector<std::unique_ptr<BodyEffect>>;

// A force that does not depend on the velocity [N or N m].
inline BodyForce given_force(const Eigen::Vector3d& force, double h, bool angular = false) {
  const double size = force.norm();
  return {.direction = size > 0 ? Eigen::Vector3d(force / size) : Eigen::Vector3d::UnitX(),
          .angular = angular, .weight = 1, .lower = h * size, .upper = h * size};
}

// ---------------------------------------------------------------- sensors

struct Reading {
  double time = 0;  // [s] by the sensor's clock
  std::vector<double> values;
  bool lost = false;
};

class SensorEffect {
 public:
  virtual ~SensorEffect() = default;
  virtual double delay() const { return 0; }  // [s] age of what is read
  virtual void distort(Reading&, long long /*number*/) const {}
};
using SensorEffects = std::vector<std::unique_ptr<SensorEffect>>;

// ---------------------------------------------------------------- all of a model

struct Effects {
  std::vector<WheelEffects> wheels;
  std::vector<JointEffects> joints;
  std::vector<BodyEffects> bodies;
  std::vector<SensorEffects> sensors;
  std::vector<double> command_delay;  // [s] by which commands reach each drive later than they are given
};

// What a law is given when it is attached: its numbers, and the model that it may change.
struct Attachment {
  const EffectRow& row;
  Model& model;
  Effects& effects;

  double operator[](const char* parameter) const { return row.parameter(parameter); }
  // Calls visit(index) for every target of the row.
  template <class Visit>
  void each(std::size_t count, Visit&& visit) const {
    for (std::size_t k = 0; k < count; ++k)
      if (row.index < 0 || row.index == static_cast<int>(k)) visit(k);
  }
  template <class Made, class... Values>
  void to_wheels(Values... values) const {
    each(effects.wheels.size(), [&](std::size_t k) { effects.wheels[k].push_back(std::make_unique<Made>(values...)); });
  }
  template <class Made, class... Values>
  void to_joints(Values... values) const {
    each(effects.joints.size(), [&](std::size_t k) {
      if (model.rover.joints[k].has_one_freedom()) effects.joints[k].push_back(std::make_unique<Made>(values...));
    });
  }
  template <class Made, class... Values>
  void to_bodies(Values... values) const {
    each(effects.bodies.size(), [&](std::size_t k) { effects.bodies[k].push_back(std::make_unique<Made>(values...)); });
  }
  template <class Made, class... Values>
  void to_sensors(Values... values) const {
    each(effects.sensors.size(), [&](std::size_t k) { effects.sensors[k].push_back(std::make_unique<Made>(values...)); });
  }
};

namespace effects {

// Both pressure-sinkage moduli, of Bekker and of Reece alike.
inline void scale_pressure(Soil& soil, double factor) {
  soil.cohesive_modulus *= factor;
  soil.frictional_modulus *= factor;
  if (soil.reece_cohesive_modulus) *soil.reece_cohesive_modulus *= factor;
  if (soil.reece_frictional_modulus) *soil.reece_frictional_modulus *= factor;
}

// Raises InputRefused for a smooth wheel.
inline void require_grousers(const Attachment& a, std::size_t wheel) {
  const Wheel& made = a.model.rover.wheels[wheel];
  if (made.grouser_count == 0)
    throw InputRefused("the effect '" + a.row.kind + "' needs grousers, but wheel '" + made.name + "' has none (table grouser)");
}

}  // namespace effects
}  // namespace rille
