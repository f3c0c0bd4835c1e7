// Interface of the wheel-soil laws: stresses under a rolling rigid wheel, integrated to forces.
//
// Frame of the wheel: t along its heading in its own plane, e "up" in its own plane, a along its axle (left).
// Angles from the downward vertical, positive towards the direction of travel:
//   entry angle  theta_f = acos(1 - z/r)
//   exit angle   theta_r = -acos(1 - lambda z/r)
//   peak angle   theta_m = (a0 + a1 s) theta_f, kept inside [theta_r, theta_f]
// Shear displacement of the soil at theta, from the rolling kinematics (Janosi & Hanamoto 1961; Wong & Reece 1967):
//   j_x = r [(theta_f - theta) - kappa (sin theta_f - sin theta)],  kappa = v / (r w) = 1 - s for a driven wheel
//   j_y = r (theta_f - theta) v_y / (r w)
// Shear stress, Mohr-Coulomb with the exponential mobilisation, isotropic in (j_x/K, j_y/ky):
//   |tau| = (c + sigma tan phi) (1 - exp(-|j|)),  along j;   with j_y = 0 this is Janosi-Hanamoto exactly.
// A braked wheel (kappa > 1) has two shear zones: j_x changes its sign inside the contact, and the integrals are split there.
// Forces (Wong & Reece 1967, eqs 7-9):
//   N = r b Int(sigma cos + tau_x sin),  D = r b Int(tau_x cos - sigma sin),  T = r^2 b Int tau_x,  F_y = r b Int tau_y
#pragma once

#include "model/terrain.hpp"

namespace rille {

struct WheelShape {
  double radius = 0;  // [m]
  double width = 0;   // [m]
};

// Motion of the wheel over the soil, seen in its direction of travel.
struct WheelMotion {
  double sinkage = 0;         // [m] z, 0 < z < r
  double slip_ratio = 0;      // [-] s, in [-1, 1]; moves the peak-stress angle
  double travel_ratio = 1;    // [-] kappa = v / (r w)
  double lateral_ratio = 0;   // [-] v_y / (r w), >= 0
};

struct SoilReaction {
  double normal_load = 0;       // [N] N
  double drawbar_pull = 0;      // [N] D
  double side_force = 0;        // [N] F_y, magnitude, against the lateral motion
  double torque = 0;            // [N m] T, resists the drive
  double rolling_torque = 0;    // [N m] T of the same normal stresses at zero slip (kappa = 1), of a wheel that drifts as fast
  double shear_strength = 0;    // [N] r b Int(c + sigma tan phi): bound of T/r and F_y
  double scrub_torque = 0;      // [N m] about the ground's normal, resists turning on the spot; 0 in the base model
  double peak_stress = 0;       // [Pa] normal stress at theta_m
  double contact_length = 0;    // [m] chord of the contact
  double entry_angle = 0;       // [rad] theta_f
  double peak_angle = 0;        // [rad] theta_m
  double exit_angle = 0;        // [rad] theta_r
};

SoilReaction react(WheelSoilLaw law, const Soil& soil, const WheelShape& wheel, const WheelMotion& motion);

}  // namespace rille
