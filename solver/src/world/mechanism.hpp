// The mechanism as a btMultiBody: state, kinematics, unconstrained motion, mass matrix. The only file pair that knows Bullet.
//
// Generalised velocity v, length n = 6 + joint dofs: root angular velocity and velocity of its centre of mass in W (zero for
// a mechanism that is held by the world), then the joint rates in the order of the tree.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "model/result.hpp"
#include "model/rover.hpp"
#include "physics/rows.hpp"

namespace rille {

// Configuration and velocity; plain numbers, so that a state can be kept, compared and restored bit by bit.
struct MechanismState {
  Eigen::Vector3d base_position = Eigen::Vector3d::Zero();            // [m] centre of mass of the root in W
  Eigen::Quaterniond base_rotation = Eigen::Quaterniond::Identity();  // principal axes of the root -> W
  Eigen::VectorXd joint_position;                                     // [rad, m or quaternion x y z w] by joint, stacked
  Eigen::VectorXd velocity;                                           // (n) v

  template <class Archive>
  void visit(Archive& archive) {
    archive(base_position, base_rotation, joint_position, velocity);
  }
};

class Mechanism {
 public:
  // Raises InputRefused for bodies that form a circle or more than one free root.
  Mechanism(const Rover& rover, const Eigen::Vector3d& gravity);
  ~Mechanism();
  Mechanism(Mechanism&&) noexcept;
  Mechanism& operator=(Mechanism&&) noexcept;

  int dofs() const;            // n
  bool held_by_world() const;  // no free root
  int dof_of(int joint) const; // index in v of a hinge or prismatic joint, -1 for others

  MechanismState state() const;
  void set_state(const MechanismState& state);
  void set_joint(int joint, double position, double velocity);
  // Places the body frame of the free root. Does nothing to a mechanism that is held by the world.
  void set_root(const BodyState& root);

  // Recomputes world poses and motion axes (a cache of the state); the queries below read them.
  void update_kinematics() const;
  BodyState body_state(int body) const;
  double joint_position(int joint) const;
  double joint_velocity(int joint) const;
  Eigen::Vector3d to_world(int body, const Eigen::Vector3d& p_M) const;        // point given in M at the zero pose
  Eigen::Vector3d rotate_to_world(int body, const Eigen::Vector3d& d_M) const; // direction given in M at the zero pose
  Eigen::Quaterniond rotation_from_model(int body) const;                      // R_WB: M at the zero pose -> W
  Eigen::Vector3d velocity_at(int body, const Eigen::Vector3d& p_W) const;     // [m/s] of the body's material point
  Eigen::Vector3d angular_velocity(int body) const;                            // [rad/s] in W
  Eigen::Vector3d com(int body) const;                                         // [m] centre of mass in W
  Eigen::Vector3d com_velocity(int body) const;                                // [m/s] of it in W
  // The same as if the generalised velocity were v, at the poses as last updated.
  Eigen::Vector3d com_velocity_with(int body, const Eigen::VectorXd& v) const;

  // Velocity after h under gravity, gyroscopic forces and joint efforts (n, first six ignored), without rows.
  // Articulated-body algorithm of Bullet (Featherstone 1987; Mirtich 1996). Leaves the state as it was.
  const Eigen::VectorXd& free_velocity(double h, const Eigen::VectorXd& effort);
  const Eigen::VectorXd& velocity() const;
  // Joint-space inertia by composite bodies in W (Featherstone 1987, ch. 7); lower triangle. Fixed root: unit block.
  void update_mass_matrix() const;
  const Eigen::MatrixXd& mass_matrix() const;

  // Appends to the open row the Jacobian of  scale_linear (velocity of p_W . direction) + scale_angular (omega . axis).
  void add_jacobian(int body, const Eigen::Vector3d& p_W, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular,
                    RowSet& rows) const;

  // The same for the velocity of a common point of two bodies (b = -1: the world) along `direction`: v_a - v_b.
  void add_relative_jacobian(int body_a, int body_b, const Eigen::Vector3d& p_a_W, const Eigen::Vector3d& p_b_W,
                             const Eigen::Vector3d& direction, RowSet& rows) const;

  // Force and torque of the carrier on the carried body of every joint, about the joint's point, by the recursive Newton-Euler
  // algorithm (Luh, Walker & Paul 1980) from the accelerations (n) at the kinematics as last updated and the wrenches of the rows.
  // impulse: of each row over the step h.
  // velocity: (n) at those kinematics.
  std::vector<JointReaction> reactions(const Eigen::VectorXd& velocity, const Eigen::VectorXd& acceleration, const RowSet& rows,
                                       const Eigen::VectorXd& impulse, double h) const;

  void set_velocity(const Eigen::VectorXd& v);
  void advance_position(double h);  // semi-implicit Euler: q += h v
  // One step of the classical Runge-Kutta scheme (order 4) under the given efforts. No spherical joints.
  void advance_rk4(double h, const Eigen::VectorXd& effort);

  double kinetic_energy() const;    // [J] from the mass matrix as last updated
  double potential_energy() const;  // [J] against z = 0 along gravity
  // Momentum [N s] and angular momentum about the origin of W [N m s], stacked. Needs update_kinematics().
  Eigen::Matrix<double, 6, 1> momentum() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Raises std::runtime_error if the Bullet libraries that were loaded are not double precision.
void require_double_precision();

}  // namespace rille
