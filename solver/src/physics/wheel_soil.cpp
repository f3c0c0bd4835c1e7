#include "physics/wheel_soil.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "physics/bekker_wong.hpp"
#include "physics/reece.hpp"

namespace rille {
namespace {

// Gauss-Legendre nodes and weights on [0, 1], 8 points (Abramowitz & Stegun 1964, table 25.4).
constexpr std::array<double, 8> kNode = {0.01985507175123188, 0.10166676129318664, 0.23723379504183550,
                                         0.40828267875217511, 0.59171732124782489, 0.76276620495816450,
                                         0.89833323870681336, 0.98014492824876812};
constexpr std::array<double, 8> kWeight = {0.05061426814518813, 0.11119051722668724, 0.15685332293894364,
                                           0.18134189168918099, 0.18134189168918099, 0.15685332293894364,
                                           0.11119051722668724, 0.05061426814518813};

// (1 - exp(-e)) / e, the secant of the mobilisation curve; 1 at e = 0.
double mobilisation_secant(double e) { return e < 1e-8 ? 1 - 0.5 * e : -std::expm1(-e) / e; }

// Sums of the integrands over one zone.
struct Sums {
  double normal = 0, drawbar = 0, side = 0, torque = 0, rolling = 0, strength = 0;
};

// The stress vanishes at the ends of the contact as depth^n, with an infinite slope for n < 1. The substitution
// theta = theta_end + (theta_m - theta_end) u^2 takes the square root out of it: 1e-8 relative at n = 1 with 8 points.
// A point u of the rear zone is read at the same u of the front zone, so both zones share the stresses.
template <class Stress>
SoilReaction integrate(const Stress& stress, const Soil& soil, const WheelShape& wheel, const WheelMotion& motion,
                       double entry, double peak, double exit) {
  const double tan_phi = std::tan(soil.friction_angle);
  const double sin_entry = std::sin(entry);
  const double per_k = wheel.radius / soil.shear_modulus;
  const double per_ky = wheel.radius / soil.lateral_shear_modulus;

  const auto add = [&](double theta, double sin_theta, double cos_theta, double sigma, double weight, Sums& sums) {
    const double rolled = entry - theta;
    const double j_x = per_k * (rolled - motion.travel_ratio * (sin_entry - sin_theta));
    const double j_y = per_ky * rolled * motion.lateral_ratio;
    const double j_0 = per_k * (rolled - (sin_entry - sin_theta));
    const double strength = soil.cohesion + sigma * tan_phi;
    const double j = j_y == 0 ? std::abs(j_x) : std::sqrt(j_x * j_x + j_y * j_y);
    const double secant = strength * mobilisation_secant(j);
    const double tau_x = secant * j_x;
    const double tau_y = secant * j_y;
    const double tau_0 = strength * mobilisation_secant(j_y == 0 ? std::abs(j_0) : std::sqrt(j_0 * j_0 + j_y * j_y)) * j_0;
    sums.normal += weight * (sigma * cos_theta + tau_x * sin_theta);
    sums.drawbar += weight * (tau_x * cos_theta - sigma * sin_theta);
    sums.side += weight * tau_y;
    sums.torque += weight * tau_x;
    sums.rolling += weight * tau_0;
    sums.strength += weight * strength;
  };

  Sums sums;
  for (std::size_t i = 0; i < kNode.size(); ++i) {
    const double u = kNode[i];
    const double front = entry + (peak - entry) * u * u;
    const double cos_front = std::cos(front);
    const double sigma = stress(cos_front);
    const double weight = 2 * u * kWeight[i];
    add(front, std::sin(front), cos_front, sigma, weight * (entry - peak), sums);
    const double rear = exit + (peak - exit) * u * u;
    add(rear, std::sin(rear), std::cos(rear), sigma, weight * (peak - exit), sums);
  }

  const double area = wheel.radius * wheel.width;
  SoilReaction reaction;
  reaction.normal_load = area * sums.normal;
  reaction.drawbar_pull = area * sums.drawbar;
  reaction.side_force = area * sums.side;
  reaction.torque = area * wheel.radius * sums.torque;
  reaction.rolling_torque = area * wheel.radius * sums.rolling;
  reaction.shear_strength = area * sums.strength;
  reaction.contact_length = wheel.radius * (sin_entry - std::sin(exit));
  reaction.entry_angle = entry;
  reaction.peak_angle = peak;
  reaction.exit_angle = exit;
  return reaction;
}

}  // namespace

SoilReaction react(WheelSoilLaw law, const Soil& soil, const WheelShape& wheel, const WheelMotion& motion) {
  const double ratio = std::clamp(motion.sinkage / wheel.radius, 0.0, 1.0);
  const double cos_entry = 1 - ratio;
  const double entry = std::acos(cos_entry);
  const double exit = -std::acos(std::max(-1.0, 1 - soil.exit_sinkage_ratio * ratio));
  const double peak =
      std::clamp((soil.peak_angle_offset + soil.peak_angle_slip * motion.slip_ratio) * entry, exit, entry);
  switch (law) {
    case WheelSoilLaw::bekker:  // one zone, peak at bottom dead centre
      return integrate(BekkerWongStress(soil, wheel, cos_entry), soil, wheel, motion, entry, 0, 0);
    case WheelSoilLaw::reece:
      return integrate(ReeceStress(soil, wheel, cos_entry), soil, wheel, motion, entry, peak, exit);
    case WheelSoilLaw::bekker_wong:
      return integrate(BekkerWongStress(soil, wheel, cos_entry), soil, wheel, motion, entry, peak, exit);
  }
  return {};
}

}  // namespace rille
