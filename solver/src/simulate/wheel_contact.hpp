// A wheel on soft soil as implicit constraint rows.
//
// Soft soil is no collision: the stress integrals give forces N, D, F_y and a torque T. They are stiff in the velocities
// (the slip law at 4 cm/s would need steps below 0.2 ms if taken explicitly), so they enter the next velocity implicitly.
// With rim speed u = r w and centre speed v along the heading the longitudinal law is split into parts that each vanish with
// one velocity, which makes every row dissipative and lets a parked rover stand still:
//   shear     S = (T - T_0)/r       against u - v, secant S/|u - v|; S + T_0/r bounded by the soil's shear strength
//   rolling   T_0/r                 against u, like dry friction
//   rut       R = S - D             against v, like dry friction
// where T_0 is the torque of the same normal stresses at zero slip. Their sum gives back D and T exactly:
// S - R = D,  r S + T_0 = T. Normal: N(z) with its stiffness dN/dz = (n + 1/2) N/z and the soil's damping. Side: secant
// F_y/|v_y|, bounded by the shear strength. The secants are taken at the beginning of the step; a steady state therefore
// obeys the soil law exactly, whatever the step.
// Effects may add a sixth row: a scrub torque about the ground's normal.
// On ground that is as hard as rock (response `rigid`) there is no soil law; the contact is handed to RigidContacts.
#pragma once

#include <array>

#include "effects/effect.hpp"
#include "model/model.hpp"
#include "model/result.hpp"
#include "physics/rows.hpp"
#include "physics/wheel_soil.hpp"
#include "simulate/rigid_contact.hpp"
#include "world/ground.hpp"
#include "world/mechanism.hpp"
#include "world/ruts.hpp"

namespace rille {

enum class ContactStatus { in_air, on_soil, on_rigid, off_terrain, buried };

class WheelContact {
 public:
  WheelContact(const Rover& rover, const Terrain& terrain, int wheel, WheelEffects& effects);

  // Reads the wheel's place and appends its rows for a step h [s]. Needs update_kinematics().
  ContactStatus open_rows(const Mechanism& mechanism, double time, double h, RowSet& rows, RigidContacts& rigid, Ruts* ruts);
  // Reads forces back from the solved impulses.
  void close_rows(const RowSet& rows, const Eigen::VectorXd& impulse, double h);
  // Adds the force of obstacles and hard ground on the wheel [N] in W to what the state shows.
  void add_rigid(const Eigen::Vector3d& force);

  const WheelState& state() const { return state_; }
  int body() const { return body_; }
  // The next step marks the rut, wherever the wheel is.
  void forget_mark() { marked_at_ = Eigen::Vector2d::Constant(1e30); }
  // The next step takes memories of effects from steady rolling as the wheel moves then: a window that starts in mid-run.
  void assume_steady() { assume_steady_ = true; }
  void visit(Archive& archive) {
    archive(assume_steady_, sides_, marked_at_, marked_sinkage_, rigid_load_);
    for (auto& effect : *effects_) effect->visit(archive);
  }

 private:
  static constexpr int kRows = 6;  // normal, shear, rolling, rut, side, scrub

  void open_rigid_effects(const Mechanism& mechanism, const WheelSite& site, double load, double h, RowSet& rows);
  Row& open_row(const Mechanism& mechanism, RowKind kind, const Eigen::Vector3d& point, const Eigen::Vector3d& linear,
                const Eigen::Vector3d& angular, double weight, RowSet& rows);
  void report_slip(const Slip& slip, double v, double u, double v_y);
  void mark(Ruts& ruts, double sinkage, double pressure, const Eigen::Vector2d& left);

  const Wheel* wheel_;
  const Terrain* terrain_;
  Ground ground_;
  int index_;
  int body_ = -1;
  Eigen::Vector3d axle_in_model_;             // to the left of the machine, whichever way the joint's axis points: heads forward
  WheelState state_;
  WheelEffects* effects_;
  Eigen::Vector3d up_, ahead_, axle_;         // frame of the wheel in this step
  int first_row_ = -1;                        // -1: no rows in this step
  int n_rows_ = 0;
  Eigen::Vector2d marked_at_ = Eigen::Vector2d::Constant(1e30);  // [m] where the rut was marked last
  double marked_sinkage_ = 0;                 // [m]
  bool assume_steady_ = false;
  bool on_rigid_ = false;                     // in this step
  int rigid_torque_row_ = -1;                 // of rolling resistance there; -1: none
  double rigid_load_ = 0;                     // [N] normal load on hard ground in the last step
  std::array<RowSide, kRows> sides_ = {};     // sides of the last step, where the active set starts
};

}  // namespace rille
