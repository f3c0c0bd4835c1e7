#include "world/mechanism.hpp"

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <stdexcept>

#include "model/error.hpp"
#include "world/bullet.hpp"

#ifndef BT_USE_DOUBLE_PRECISION
#error "Bullet headers are in single precision: configure with the package bullet-float64"
#endif

namespace rille {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;

Matrix3d skew(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

// Bullet wants diagonal inertia in the frame of the centre of mass, so each link's frame is turned to principal axes.
struct PrincipalFrame {
  Quaterniond rotation = Quaterniond::Identity();  // principal axes -> M
  Vector3d moments = Vector3d::Ones();             // [kg m^2]
};

PrincipalFrame principal_frame(const Body& body) {
  const Matrix3d& inertia = body.inertia;
  const double off_diagonal = std::abs(inertia(0, 1)) + std::abs(inertia(0, 2)) + std::abs(inertia(1, 2));
  if (off_diagonal <= 1e-14 * inertia.trace()) return {Quaterniond::Identity(), inertia.diagonal()};
  Eigen::SelfAdjointEigenSolver<Matrix3d> solver(inertia);
  Matrix3d axes = solver.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) *= -1;
  return {Quaterniond(axes).normalized(), solver.eigenvalues()};
}

// Bodies so that each comes after its carrier; refuses circles and second free roots.
struct Tree {
  std::vector<int> joint_of_link;  // link -> joint that carries it
  int root = -1;                   // free root body, -1 = the world
};

Tree make_tree(const Rover& rover) {
  const int n_bodies = static_cast<int>(rover.bodies.size());
  if (n_bodies == 0) throw InputRefused("the model has no bodies; build it with `rille cad build` first");
  std::vector<int> joint_of_body(n_bodies, -1);
  for (int j = 0; j < static_cast<int>(rover.joints.size()); ++j) {
    int& slot = joint_of_body[rover.joints[j].child];
    if (slot >= 0)
      throw InputRefused(fmt::format("body '{}' is the child of two joints, '{}' and '{}'; close loops with a loop_closure",
                                     rover.bodies[rover.joints[j].child].name, rover.joints[slot].name,
                                     rover.joints[j].name));
    slot = j;
  }
  Tree tree;
  bool held = false;
  for (int b = 0; b < n_bodies; ++b) {
    if (joint_of_body[b] >= 0) {
      held = held || rover.joints[joint_of_body[b]].parent < 0;
      continue;
    }
    if (tree.root >= 0)
      throw InputRefused(fmt::format("bodies '{}' and '{}' both hang on nothing; join all but one by joints",
                                     rover.bodies[tree.root].name, rover.bodies[b].name));
    tree.root = b;
  }
  if (held && tree.root >= 0)
    throw InputRefused(fmt::format("body '{}' floats beside a mechanism that is held by the world; join it by a joint",
                                   rover.bodies[tree.root].name));
  std::vector<bool> placed(n_bodies, false);
  if (tree.root >= 0) placed[tree.root] = true;
  for (bool progress = true; progress;) {
    progress = false;
    for (int b = 0; b < n_bodies; ++b) {
      if (placed[b]) continue;
      const int parent = rover.joints[joint_of_body[b]].parent;
      if (parent >= 0 && !placed[parent]) continue;
      placed[b] = progress = true;
      tree.joint_of_link.push_back(joint_of_body[b]);
    }
  }
  for (int b = 0; b < n_bodies; ++b)
    if (!placed[b])
      throw InputRefused(fmt::format("body '{}' is carried by a circle of joints; cut one and add a loop_closure",
                                     rover.bodies[b].name));
  return tree;
}

// Motion of one dof in W: angular velocity, and velocity of the material point at the reference.
struct Axis {
  Vector3d angular = Vector3d::Zero();
  Vector3d linear = Vector3d::Zero();
};

struct Link {
  int body = -1;
  int joint = -1;
  int parent = -1;     // link, -1 = root
  int first_dof = 0;   // index in v
  int n_dofs = 0;
  int first_position = 0;  // index in MechanismState::joint_position
  int n_positions = 0;
};

}  // namespace

struct Mechanism::Impl {
  Rover rover;
  Vector3d gravity;
  Tree tree;
  int n_dofs = 6;
  int n_positions = 0;
  std::vector<Link> links;
  std::vector<int> link_of_body;  // -1 = root
  std::vector<int> link_of_joint;
  std::vector<PrincipalFrame> frames;  // by body
  std::unique_ptr<btMultiBody> multibody;

  // Scratch that Bullet wants to be handed.
  btAlignedObjectArray<btScalar> scratch_r;
  btAlignedObjectArray<btVector3> scratch_v;
  btAlignedObjectArray<btMatrix3x3> scratch_m;
  btAlignedObjectArray<btQuaternion> world_to_local;  // by link + 1
  btAlignedObjectArray<btVector3> local_origin;       // by link + 1

  std::vector<Matrix3d> R_WL;      // by link + 1, principal axes -> W
  std::vector<Vector3d> p_WC;      // by link + 1, centre of mass
  std::vector<Axis> axes;          // by dof, reference: centre of mass of the root
  std::vector<double> masses;      // by link + 1
  std::vector<Vector3d> moments;   // by link + 1, principal
  std::vector<Vector3d> omega;     // by link + 1, angular velocity in W
  std::vector<Vector3d> velocity_C;  // by link + 1, of the centre of mass in W
  std::vector<std::vector<int>> ancestor_dofs;  // by link + 1, ascending, joint dofs only
  VectorXd velocity;
  VectorXd free_velocity;
  MatrixXd mass_matrix;
  std::vector<double> composite_mass;
  std::vector<Vector3d> composite_moment;   // mass times centre, from the reference
  std::vector<Matrix3d> composite_inertia;  // about the reference

  int slot(int body) const { return link_of_body[body] + 1; }
  bool floating() const { return tree.root >= 0; }

  void read_velocity() {
    const btScalar* v = multibody->getVelocityVector();
    for (int i = 0; i < n_dofs; ++i) velocity[i] = v[i];
  }

  void write_velocity(const VectorXd& v) {
    if (floating()) {
      multibody->setBaseOmega({v[0], v[1], v[2]});
      multibody->setBaseVel({v[3], v[4], v[5]});
    }
    for (int i = 0; i < static_cast<int>(links.size()); ++i)
      if (links[i].n_dofs > 0) multibody->setJointVelMultiDof(i, v.data() + links[i].first_dof);
  }

  // Acceleration times h, added to the velocity by Bullet; the caller restores the velocity.
  void accelerate(double h, const VectorXd& effort) {
    multibody->clearForcesAndTorques();
    if (floating()) multibody->addBaseForce(bt(Vector3d(gravity * masses[0])));
    for (int i = 0; i < static_cast<int>(links.size()); ++i) {
      multibody->addLinkForce(i, bt(Vector3d(gravity * masses[i + 1])));
      for (int d = 0; d < links[i].n_dofs; ++d)
        multibody->addJointTorqueMultiDof(i, d, effort[links[i].first_dof + d]);
    }
    multibody->computeAccelerationsArticulatedBodyAlgorithmMultiDof(h, scratch_r, scratch_v, scratch_m, false, false,
                                                                    false);
  }
};

Mechanism::Mechanism(const Rover& rover, const Vector3d& gravity) : impl_(std::make_unique<Impl>()) {
  Impl& m = *impl_;
  m.rover = rover;
  m.gravity = gravity;
  m.tree = make_tree(rover);
  const int n_links = static_cast<int>(m.tree.joint_of_link.size());
  m.frames.reserve(rover.bodies.size());
  for (const Body& body : rover.bodies) m.frames.push_back(principal_frame(body));

  const bool floating = m.floating();
  const Body world_body{.name = "world", .mass = 1, .inertia = Matrix3d::Identity()};
  const PrincipalFrame world_frame;
  const Body& base = floating ? rover.bodies[m.tree.root] : world_body;
  const PrincipalFrame& base_frame = floating ? m.frames[m.tree.root] : world_frame;
  m.multibody = std::make_unique<btMultiBody>(n_links, base.mass, bt(base_frame.moments), !floating, false);
  m.link_of_body.assign(rover.bodies.size(), -1);
  m.link_of_joint.assign(rover.joints.size(), -1);
  m.masses.push_back(base.mass);
  m.moments.push_back(base_frame.moments);
  m.ancestor_dofs.emplace_back();

  for (int i = 0; i < n_links; ++i) {
    const Joint& joint = rover.joints[m.tree.joint_of_link[i]];
    const Body& body = rover.bodies[joint.child];
    const PrincipalFrame& frame = m.frames[joint.child];
    const bool on_base = joint.parent < 0 || joint.parent == m.tree.root;
    Link link;
    link.body = joint.child;
    link.joint = m.tree.joint_of_link[i];
    link.parent = on_base ? -1 : m.link_of_body[joint.parent];
    const Body& parent = joint.parent < 0 ? world_body : rover.bodies[joint.parent];
    const Quaterniond R_MP = joint.parent < 0 ? Quaterniond::Identity() : m.frames[joint.parent].rotation;
    const Quaterniond R_LM = frame.rotation.conjugate();
    const btQuaternion parent_to_this = bt(Quaterniond(R_LM * R_MP));
    const btVector3 parent_to_pivot = bt(Vector3d(R_MP.conjugate() * (joint.point - parent.com)));
    const btVector3 pivot_to_com = bt(Vector3d(R_LM * (body.com - joint.point)));
    const btVector3 axis = bt(Vector3d(R_LM * joint.axis));
    const btVector3 moments = bt(frame.moments);
    switch (joint.kind) {
      case JointKind::hinge:
        m.multibody->setupRevolute(i, body.mass, moments, link.parent, parent_to_this, axis, parent_to_pivot,
                                   pivot_to_com, true);
        break;
      case JointKind::prismatic:
        m.multibody->setupPrismatic(i, body.mass, moments, link.parent, parent_to_this, axis, parent_to_pivot,
                                    pivot_to_com, true);
        break;
      case JointKind::fixed:
        m.multibody->setupFixed(i, body.mass, moments, link.parent, parent_to_this, parent_to_pivot, pivot_to_com);
        break;
      case JointKind::spherical:
        m.multibody->setupSpherical(i, body.mass, moments, link.parent, parent_to_this, parent_to_pivot, pivot_to_com,
                                    true);
        break;
    }
    const btMultibodyLink& made = m.multibody->getLink(i);
    link.first_dof = m.n_dofs;
    link.n_dofs = made.m_dofCount;
    link.first_position = m.n_positions;
    link.n_positions = made.m_posVarCount;
    m.n_dofs += link.n_dofs;
    m.n_positions += link.n_positions;
    m.links.push_back(link);
    m.link_of_body[joint.child] = i;
    m.link_of_joint[link.joint] = i;
    m.masses.push_back(body.mass);
    m.moments.push_back(frame.moments);
    m.ancestor_dofs.push_back(m.ancestor_dofs[link.parent + 1]);
    for (int d = 0; d < link.n_dofs; ++d) m.ancestor_dofs.back().push_back(link.first_dof + d);
  }

  btMultiBody& mb = *m.multibody;
  mb.finalizeMultiDof();
  mb.setLinearDamping(0);  // Bullet's default is 0.04
  mb.setAngularDamping(0);
  mb.setUseGyroTerm(true);
  mb.setMaxCoordinateVelocity(1e12);  // Bullet clamps silently at 100
  mb.setMaxAppliedImpulse(1e12);
  mb.setCanSleep(false);

  const auto slots = static_cast<std::size_t>(n_links) + 1;
  m.world_to_local.resize(n_links + 1);
  m.local_origin.resize(n_links + 1);
  m.R_WL.resize(slots);
  m.p_WC.resize(slots);
  m.omega.resize(slots);
  m.velocity_C.resize(slots);
  m.composite_mass.resize(slots);
  m.composite_moment.resize(slots);
  m.composite_inertia.resize(slots);
  m.axes.resize(static_cast<std::size_t>(m.n_dofs));
  m.velocity.setZero(m.n_dofs);
  m.free_velocity.setZero(m.n_dofs);
  m.mass_matrix.setZero(m.n_dofs, m.n_dofs);
  set_root(BodyState{.position = floating ? base.frame : Vector3d::Zero()});
  update_kinematics();
}

Mechanism::~Mechanism() = default;
Mechanism::Mechanism(Mechanism&&) noexcept = default;
Mechanism& Mechanism::operator=(Mechanism&&) noexcept = default;

int Mechanism::dofs() const { return impl_->n_dofs; }
bool Mechanism::held_by_world() const { return !impl_->floating(); }

int Mechanism::dof_of(int joint) const {
  const Link& link = impl_->links[impl_->link_of_joint[joint]];
  return link.n_dofs == 1 ? link.first_dof : -1;
}

MechanismState Mechanism::state() const {
  const Impl& m = *impl_;
  MechanismState state;
  state.base_position = eigen(m.multibody->getBasePos());
  state.base_rotation = eigen(m.multibody->getWorldToBaseRot()).conjugate();
  state.joint_position.resize(m.n_positions);
  for (std::size_t i = 0; i < m.links.size(); ++i)
    for (int k = 0; k < m.links[i].n_positions; ++k)
      state.joint_position[m.links[i].first_position + k] =
          m.multibody->getJointPosMultiDof(static_cast<int>(i))[k];
  state.velocity = m.velocity;
  return state;
}

void Mechanism::set_state(const MechanismState& state) {
  Impl& m = *impl_;
  m.multibody->setBasePos(bt(state.base_position));
  m.multibody->setWorldToBaseRot(bt(state.base_rotation.conjugate()));
  for (std::size_t i = 0; i < m.links.size(); ++i)
    if (m.links[i].n_positions > 0)
      m.multibody->setJointPosMultiDof(static_cast<int>(i), state.joint_position.data() + m.links[i].first_position);
  set_velocity(state.velocity);
}

void Mechanism::set_joint(int joint, double position, double velocity) {
  Impl& m = *impl_;
  const int link = m.link_of_joint[joint];
  m.multibody->setJointPos(link, position);
  m.multibody->setJointVel(link, velocity);
  m.read_velocity();
}

void Mechanism::set_root(const BodyState& root) {
  Impl& m = *impl_;
  if (!m.floating()) return;
  const Body& body = m.rover.bodies[m.tree.root];
  const Vector3d p_BC_W = root.rotation * (body.com - body.frame);
  m.multibody->setBasePos(bt(Vector3d(root.position + p_BC_W)));
  m.multibody->setWorldToBaseRot(bt(Quaterniond(root.rotation * m.frames[m.tree.root].rotation).normalized().conjugate()));
  m.multibody->setBaseOmega(bt(root.angular_velocity));
  m.multibody->setBaseVel(bt(Vector3d(root.velocity + root.angular_velocity.cross(p_BC_W))));
  m.read_velocity();
}

void Mechanism::update_kinematics() const {
  Impl& m = *impl_;
  m.world_to_local[0] = m.multibody->getWorldToBaseRot();
  m.local_origin[0] = m.multibody->getBasePos();
  m.R_WL[0] = eigen(m.world_to_local[0]).conjugate().toRotationMatrix();
  m.p_WC[0] = eigen(m.local_origin[0]);
  const Vector3d reference = m.p_WC[0];
  m.omega[0] = m.velocity.segment<3>(0);
  m.velocity_C[0] = m.velocity.segment<3>(3);
  for (std::size_t i = 0; i < m.links.size(); ++i) {
    const Link& link = m.links[i];
    const auto self = i + 1;
    const auto up = static_cast<std::size_t>(link.parent + 1);
    const int index = static_cast<int>(i);
    m.world_to_local[index + 1] = m.multibody->getParentToLocalRot(index) * m.world_to_local[link.parent + 1];
    m.R_WL[self] = eigen(m.world_to_local[index + 1]).conjugate().toRotationMatrix();
    m.p_WC[self] = m.p_WC[up] + m.R_WL[self] * eigen(m.multibody->getRVector(index));
    m.omega[self] = m.omega[up];
    m.velocity_C[self] = m.velocity_C[up] + m.omega[up].cross(m.p_WC[self] - m.p_WC[up]);
    for (int d = 0; d < link.n_dofs; ++d) {
      const btMultibodyLink& made = m.multibody->getLink(index);
      Axis& axis = m.axes[static_cast<std::size_t>(link.first_dof + d)];
      axis.angular = m.R_WL[self] * eigen(made.getAxisTop(d));
      const Vector3d at_com = m.R_WL[self] * eigen(made.getAxisBottom(d));
      axis.linear = at_com + axis.angular.cross(reference - m.p_WC[self]);
      const double rate = m.velocity[link.first_dof + d];
      m.omega[self] += rate * axis.angular;
      m.velocity_C[self] += rate * at_com;
    }
  }
}

BodyState Mechanism::body_state(int body) const {
  const Impl& m = *impl_;
  const int slot = m.slot(body);
  BodyState state;
  const Matrix3d R_WB = m.R_WL[slot] * m.frames[body].rotation.conjugate().toRotationMatrix();
  state.rotation = Quaterniond(R_WB).normalized();
  if (state.rotation.w() < 0) state.rotation.coeffs() *= -1;
  const Vector3d p_CB_W = R_WB * (m.rover.bodies[body].frame - m.rover.bodies[body].com);
  state.position = m.p_WC[slot] + p_CB_W;
  state.angular_velocity = m.omega[slot];
  state.velocity = m.velocity_C[slot] + m.omega[slot].cross(p_CB_W);
  return state;
}

double Mechanism::joint_position(int joint) const { return impl_->multibody->getJointPos(impl_->link_of_joint[joint]); }
double Mechanism::joint_velocity(int joint) const {
  const int dof = dof_of(joint);
  return dof < 0 ? 0 : impl_->velocity[dof];
}

Vector3d Mechanism::to_world(int body, const Vector3d& p_M) const {
  return impl_->p_WC[impl_->slot(body)] + rotate_to_world(body, p_M - impl_->rover.bodies[body].com);
}

Vector3d Mechanism::rotate_to_world(int body, const Vector3d& d_M) const {
  return impl_->R_WL[impl_->slot(body)] * (impl_->frames[body].rotation.conjugate() * d_M);
}

Quaterniond Mechanism::rotation_from_model(int body) const {
  return Quaterniond(Matrix3d(impl_->R_WL[impl_->slot(body)] * impl_->frames[body].rotation.conjugate().toRotationMatrix()));
}

Vector3d Mechanism::velocity_at(int body, const Vector3d& p_W) const {
  const int slot = impl_->slot(body);
  return impl_->velocity_C[slot] + impl_->omega[slot].cross(p_W - impl_->p_WC[slot]);
}

Vector3d Mechanism::angular_velocity(int body) const { return impl_->omega[impl_->slot(body)]; }

Vector3d Mechanism::com(int body) const { return impl_->p_WC[impl_->slot(body)]; }
Vector3d Mechanism::com_velocity_with(int body, const VectorXd& v) const {
  const Impl& m = *impl_;
  const Vector3d arm = m.p_WC[m.slot(body)] - m.p_WC[0];
  Vector3d result = m.floating() ? Vector3d(v.segment<3>(3) + v.segment<3>(0).cross(arm)) : Vector3d::Zero();
  for (const int dof : m.ancestor_dofs[m.slot(body)]) {
    const Axis& axis = m.axes[static_cast<std::size_t>(dof)];
    result += v[dof] * (axis.linear + axis.angular.cross(arm));
  }
  return result;
}
Vector3d Mechanism::com_velocity(int body) const { return impl_->velocity_C[impl_->slot(body)]; }

const VectorXd& Mechanism::velocity() const { return impl_->velocity; }

const VectorXd& Mechanism::free_velocity(double h, const VectorXd& effort) {
  Impl& m = *impl_;
  m.accelerate(h, effort);
  const btScalar* v = m.multibody->getVelocityVector();
  for (int i = 0; i < m.n_dofs; ++i) m.free_velocity[i] = v[i];
  m.write_velocity(m.velocity);
  return m.free_velocity;
}

const MatrixXd& Mechanism::mass_matrix() const { return impl_->mass_matrix; }

void Mechanism::update_mass_matrix() const {
  Impl& m = *impl_;
  const std::size_t n_slots = m.masses.size();
  const Vector3d reference = m.p_WC[0];
  for (std::size_t s = 0; s < n_slots; ++s) {
    const Vector3d c = m.p_WC[s] - reference;
    m.composite_mass[s] = m.masses[s];
    m.composite_moment[s] = m.masses[s] * c;
    m.composite_inertia[s] = m.R_WL[s] * m.moments[s].asDiagonal() * m.R_WL[s].transpose() +
                             m.masses[s] * (c.squaredNorm() * Matrix3d::Identity() - c * c.transpose());
  }
  for (std::size_t i = m.links.size(); i-- > 0;) {
    const auto self = i + 1;
    const auto up = static_cast<std::size_t>(m.links[i].parent + 1);
    for (int d = 0; d < m.links[i].n_dofs; ++d) {
      const int dof = m.links[i].first_dof + d;
      const Axis& axis = m.axes[static_cast<std::size_t>(dof)];
      // Wrench about the reference that moves the composite body with unit rate of this dof.
      const Vector3d torque = m.composite_inertia[self] * axis.angular + m.composite_moment[self].cross(axis.linear);
      const Vector3d force = m.composite_mass[self] * axis.linear - m.composite_moment[self].cross(axis.angular);
      for (const int other : m.ancestor_dofs[self]) {
        if (other > dof) break;
        const Axis& a = m.axes[static_cast<std::size_t>(other)];
        m.mass_matrix(dof, other) = a.angular.dot(torque) + a.linear.dot(force);
      }
      if (m.floating()) {
        m.mass_matrix.row(dof).segment<3>(0) = torque.transpose();
        m.mass_matrix.row(dof).segment<3>(3) = force.transpose();
      }
    }
    m.composite_mass[up] += m.composite_mass[self];
    m.composite_moment[up] += m.composite_moment[self];
    m.composite_inertia[up] += m.composite_inertia[self];
  }
  if (m.floating()) {
    m.mass_matrix.block<3, 3>(0, 0) = m.composite_inertia[0];
    m.mass_matrix.block<3, 3>(3, 0) = -skew(m.composite_moment[0]);
    m.mass_matrix.block<3, 3>(3, 3) = m.composite_mass[0] * Matrix3d::Identity();
  } else {
    m.mass_matrix.block<6, 6>(0, 0).setIdentity();
  }
}

void Mechanism::add_jacobian(int body, const Vector3d& p_W, const Vector3d& linear, const Vector3d& angular,
                             RowSet& rows) const {
  const Impl& m = *impl_;
  rows.add_wrench({rows.size() - 1, body, p_W, linear, angular});
  const Vector3d arm = p_W - m.p_WC[0];
  const Vector3d moment = arm.cross(linear) + angular;
  if (m.floating()) {
    for (int k = 0; k < 3; ++k) rows.add(k, moment[k]);
    for (int k = 0; k < 3; ++k) rows.add(3 + k, linear[k]);
  }
  for (const int dof : m.ancestor_dofs[m.slot(body)]) {
    const Axis& axis = m.axes[static_cast<std::size_t>(dof)];
    rows.add(dof, axis.linear.dot(linear) + axis.angular.dot(moment));
  }
}

void Mechanism::add_relative_jacobian(int body_a, int body_b, const Vector3d& p_a_W, const Vector3d& p_b_W, const Vector3d& direction,
                                      RowSet& rows) const {
  const Impl& m = *impl_;
  VectorXd dense = VectorXd::Zero(m.n_dofs);
  const int row = rows.size() - 1;
  const auto add = [&](int body, const Vector3d& point, double sign) {
    if (body < 0) return;
    const Vector3d moment = (point - m.p_WC[0]).cross(direction);
    if (m.floating()) {
      dense.segment<3>(0) += sign * moment;
      dense.segment<3>(3) += sign * direction;
    }
    for (const int dof : m.ancestor_dofs[m.slot(body)]) {
      const Axis& axis = m.axes[static_cast<std::size_t>(dof)];
      dense[dof] += sign * (axis.linear.dot(direction) + axis.angular.dot(moment));
    }
    rows.add_wrench({row, body, point, sign * direction, Vector3d::Zero()});
  };
  add(body_a, p_a_W, 1);
  add(body_b, p_b_W, -1);
  for (int dof = 0; dof < m.n_dofs; ++dof)
    if (dense[dof] != 0) rows.add(dof, dense[dof]);
}

std::vector<JointReaction> Mechanism::reactions(const VectorXd& velocity, const VectorXd& acceleration, const RowSet& rows,
                                                const VectorXd& impulse, double h) const {
  const Impl& m = *impl_;
  const std::size_t n_slots = m.masses.size();
  std::vector<Vector3d> alpha(n_slots, Vector3d::Zero()), a(n_slots, Vector3d::Zero());  // [rad/s^2], [m/s^2] of the centre of mass
  std::vector<Vector3d> pivot(n_slots, Vector3d::Zero());
  alpha[0] = acceleration.segment<3>(0);
  a[0] = acceleration.segment<3>(3);
  for (std::size_t i = 0; i < m.links.size(); ++i) {
    const Link& link = m.links[i];
    const auto self = i + 1;
    const auto up = static_cast<std::size_t>(link.parent + 1);
    const Joint& joint = m.rover.joints[link.joint];
    pivot[self] = to_world(link.body, joint.point);
    alpha[self] = alpha[up];
    Vector3d turning = Vector3d::Zero(), sliding = Vector3d::Zero(), pulled = Vector3d::Zero();
    for (int d = 0; d < link.n_dofs; ++d) {
      const Axis& axis = m.axes[static_cast<std::size_t>(link.first_dof + d)];
      if (joint.kind == JointKind::prismatic) {
        sliding += velocity[link.first_dof + d] * axis.linear;
        pulled += acceleration[link.first_dof + d] * axis.linear;
      } else {
        turning += velocity[link.first_dof + d] * axis.angular;
        alpha[self] += acceleration[link.first_dof + d] * axis.angular;
      }
    }
    alpha[self] += m.omega[up].cross(turning);
    // Through the pivot, which is fixed in the carried body, and in the carrier too unless the joint slides.
    const Vector3d e = pivot[self] - m.p_WC[up], d = m.p_WC[self] - pivot[self];
    const Vector3d at_pivot = a[up] + alpha[up].cross(e) + m.omega[up].cross(m.omega[up].cross(e)) + 2 * m.omega[up].cross(sliding) + pulled;
    a[self] = at_pivot + alpha[self].cross(d) + m.omega[self].cross(m.omega[self].cross(d));
  }
  std::vector<Vector3d> force(n_slots), torque(n_slots);  // needed by each body, torque about its centre of mass
  for (std::size_t s = 0; s < n_slots; ++s) {
    const Matrix3d inertia = m.R_WL[s] * m.moments[s].asDiagonal() * m.R_WL[s].transpose();
    force[s] = m.masses[s] * (a[s] - m.gravity);
    torque[s] = inertia * alpha[s] + m.omega[s].cross(inertia * m.omega[s]);
  }
  for (const RowWrench& wrench : rows.wrenches()) {
    const auto s = static_cast<std::size_t>(m.slot(wrench.body));
    const double size = impulse[wrench.row] / h;
    force[s] -= size * wrench.linear;
    torque[s] -= size * ((wrench.point - m.p_WC[s]).cross(wrench.linear) + wrench.angular);
  }
  std::vector<JointReaction> result(m.rover.joints.size());
  for (std::size_t i = m.links.size(); i-- > 0;) {
    const Link& link = m.links[i];
    const auto self = i + 1;
    const auto up = static_cast<std::size_t>(link.parent + 1);
    JointReaction& reaction = result[static_cast<std::size_t>(link.joint)];
    reaction.force = force[self];
    reaction.torque = torque[self] + (m.p_WC[self] - pivot[self]).cross(force[self]);
    force[up] += force[self];
    torque[up] += torque[self] + (m.p_WC[self] - m.p_WC[up]).cross(force[self]);
  }
  return result;
}

void Mechanism::set_velocity(const VectorXd& v) {
  impl_->velocity = v;
  impl_->write_velocity(v);
}

void Mechanism::advance_position(double h) { impl_->multibody->stepPositionsMultiDof(h); }

void Mechanism::advance_rk4(double h, const VectorXd& effort) {
  Impl& m = *impl_;
  const MechanismState start = state();
  struct Slope {
    Vector3d base_velocity;
    Eigen::Vector4d base_rotation;  // x y z w
    VectorXd velocity;              // joint rates are its tail
    VectorXd acceleration;
  };
  const auto slope_at = [&](const MechanismState& at) {
    Slope slope;
    slope.velocity = at.velocity;
    const Vector3d w = at.velocity.segment<3>(0);
    slope.base_velocity = at.velocity.segment<3>(3);
    slope.base_rotation = 0.5 * (Quaterniond(0, w.x(), w.y(), w.z()) * at.base_rotation).coeffs();
    m.accelerate(1.0, effort);
    const btScalar* v = m.multibody->getVelocityVector();
    slope.acceleration.resize(m.n_dofs);
    for (int i = 0; i < m.n_dofs; ++i) slope.acceleration[i] = v[i] - at.velocity[i];
    return slope;
  };
  const auto moved = [&](const Slope& slope, double dt) {
    MechanismState next = start;
    next.base_position += dt * slope.base_velocity;
    next.base_rotation.coeffs() += dt * slope.base_rotation;
    next.base_rotation.normalize();
    for (const Link& link : m.links)
      if (link.n_dofs == 1) next.joint_position[link.first_position] += dt * slope.velocity[link.first_dof];
    next.velocity += dt * slope.acceleration;
    return next;
  };
  const auto visit = [&](const MechanismState& at) {
    set_state(at);
    return slope_at(at);
  };
  const Slope k1 = visit(start);
  const Slope k2 = visit(moved(k1, h / 2));
  const Slope k3 = visit(moved(k2, h / 2));
  const Slope k4 = visit(moved(k3, h));
  Slope mean;
  mean.base_velocity = (k1.base_velocity + 2 * k2.base_velocity + 2 * k3.base_velocity + k4.base_velocity) / 6;
  mean.base_rotation = (k1.base_rotation + 2 * k2.base_rotation + 2 * k3.base_rotation + k4.base_rotation) / 6;
  mean.velocity = (k1.velocity + 2 * k2.velocity + 2 * k3.velocity + k4.velocity) / 6;
  mean.acceleration = (k1.acceleration + 2 * k2.acceleration + 2 * k3.acceleration + k4.acceleration) / 6;
  set_state(moved(mean, h));
}

double Mechanism::kinetic_energy() const {
  const VectorXd product = impl_->mass_matrix.selfadjointView<Eigen::Lower>() * impl_->velocity;
  return 0.5 * impl_->velocity.dot(product);
}

double Mechanism::potential_energy() const {
  const Impl& m = *impl_;
  double energy = 0;
  for (std::size_t s = m.floating() ? 0 : 1; s < m.masses.size(); ++s) energy -= m.masses[s] * m.gravity.dot(m.p_WC[s]);
  return energy;
}

Eigen::Matrix<double, 6, 1> Mechanism::momentum() const {
  const Impl& m = *impl_;
  Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero();
  for (std::size_t s = m.floating() ? 0 : 1; s < m.masses.size(); ++s) {
    const Vector3d linear = m.masses[s] * m.velocity_C[s];
    const Vector3d spin = m.R_WL[s] * m.moments[s].asDiagonal() * m.R_WL[s].transpose() * m.omega[s];
    sum.head<3>() += linear;
    sum.tail<3>() += spin + m.p_WC[s].cross(linear);
  }
  return sum;
}

void require_double_precision() {
  // Double headers link silently against single-precision libraries; then positions come back as garbage.
  btMultiBody probe(1, 2.0, btVector3(1, 1, 1), false, false);
  probe.setupRevolute(0, 1.0, btVector3(1, 2, 3), -1, btQuaternion::getIdentity(), btVector3(0, 1, 0),
                      btVector3(0, 0, 0), btVector3(0.25, 0, 0));
  probe.finalizeMultiDof();
  probe.setBaseVel(btVector3(1.0 / 3.0, 0, 0));
  probe.setBasePos(btVector3(0, 0, 0));
  probe.stepPositionsMultiDof(0.75);
  if (std::abs(probe.getBasePos().x() - 0.25) > 1e-15)
    throw std::runtime_error("the Bullet libraries that were loaded are not the double-precision ones (bullet-float64)");
}

}  // namespace rille
