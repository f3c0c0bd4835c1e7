#include "physics/wheel_soil.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "physics/bekker_wong.hpp"
#include "physics/packed.hpp"
#include "physics/reece.hpp"

namespace rille {
namespace {

// Gauss-Legendre nodes and weights on [0, 1] (Abramowitz & Stegun 1964, table 25.4).
constexpr std::array<double, 8> kNode8 = {0.01985507175123188, 0.10166676129318664, 0.23723379504183550, 0.40828267875217511,
                                          0.59171732124782489, 0.76276620495816450, 0.89833323870681336, 0.98014492824876812};
constexpr std::array<double, 8> kWeight8 = {0.05061426814518813, 0.11119051722668724, 0.15685332293894364, 0.18134189168918099,
                                            0.18134189168918099, 0.15685332293894364, 0.11119051722668724, 0.05061426814518813};
constexpr std::array<double, 16> kNode16 = {
    0.00529953250417503, 0.02771248846338370, 0.06718439880608412, 0.12229779582249850, 0.19106187779867811, 0.27099161117138632,
    0.35919822461037054, 0.45249374508118129, 0.54750625491881877, 0.64080177538962946, 0.72900838882861363, 0.80893812220132189,
    0.87770220417750155, 0.93281560119391593, 0.97228751153661630, 0.99470046749582497};
constexpr std::array<double, 16> kWeight16 = {
    0.01357622970587709, 0.03112676196932373, 0.04757925584124630, 0.06231448562776704, 0.07479799440828835, 0.08457825969750132,
    0.09130170752246182, 0.09472530522753432, 0.09472530522753432, 0.09130170752246182, 0.08457825969750132, 0.07479799440828835,
    0.06231448562776704, 0.04757925584124630, 0.03112676196932373, 0.01357622970587709};

// A contact over which shear displacement grows by more than this many moduli has layers that the plain rule would step over.
constexpr double kSteep = 15;

// (1 - exp(-e)) / e, the secant of the mobilisation curve; 1 at e = 0.
double mobilisation_secant(double e) { return e < 1e-8 ? 1 - 0.5 * e : -std::expm1(-e) / e; }

struct Angles {
  double entry = 0, peak = 0, exit = 0;  // [rad]
};

// The integrals of one contact, point by point.
template <class Pressure>
class Integrals {
 public:
  Integrals(const Pressure& pressure, const Soil& soil, const WheelShape& wheel, const WheelMotion& motion, const Angles& angles)
      : pressure_(pressure),
        cohesion_(soil.shear_gain * soil.cohesion),
        tan_phi_(soil.shear_gain * std::tan(soil.friction_angle)),
        radius_(wheel.radius),
        per_k_(wheel.radius / soil.shear_modulus),
        per_ky_(wheel.radius / soil.lateral_shear_modulus),
        travel_(motion.travel_ratio),
        lateral_(motion.lateral_ratio),
        lateral_0_(motion.lateral_ratio / std::max(motion.travel_ratio, 1.0)),
        angles_(angles),
        sin_entry_(std::sin(angles.entry)),
        cos_entry_(std::cos(angles.entry)) {}

  // [Pa] at the cosine of a point of the front zone
  double stress(double cos_front) const { return pressure_(radius_ * (cos_front - cos_entry_)); }

  void add(double theta, double sin_theta, double cos_theta, double sigma, double weight) {
    const double rolled = angles_.entry - theta;
    const double j_x = per_k_ * (rolled - travel_ * (sin_entry_ - sin_theta));
    const double j_y = per_ky_ * rolled * lateral_;
    const double j_x0 = per_k_ * (rolled - (sin_entry_ - sin_theta));
    const double j_y0 = per_ky_ * rolled * lateral_0_;
    const double strength = cohesion_ + sigma * tan_phi_;
    const double j = j_y == 0 ? std::abs(j_x) : std::sqrt(j_x * j_x + j_y * j_y);
    const double secant = strength * mobilisation_secant(j);
    const double tau_x = secant * j_x;
    const double tau_0 = strength * mobilisation_secant(j_y0 == 0 ? std::abs(j_x0) : std::sqrt(j_x0 * j_x0 + j_y0 * j_y0)) * j_x0;
    normal_ += weight * (sigma * cos_theta + tau_x * sin_theta);
    drawbar_ += weight * (tau_x * cos_theta - sigma * sin_theta);
    side_ += weight * secant * j_y;
    torque_ += weight * tau_x;
    rolling_ += weight * tau_0;
    strength_ += weight * strength;
  }

  // The stress vanishes at the ends of the contact as depth^n, with an infinite slope for n < 1. The substitution
  // theta = theta_end + (theta_m - theta_end) u^2 takes the square root out of it: 1e-8 relative at n = 1 with 8 points.
  // A point u of the rear zone is read at the same u of the front zone, so both zones share the stresses.
  void plain() {
    const auto [entry, peak, exit] = angles_;
    for (std::size_t i = 0; i < kNode8.size(); ++i) {
      const double u = kNode8[i];
      const double front = entry + (peak - entry) * u * u;
      const double cos_front = std::cos(front);
      const double sigma = stress(cos_front);
      const double weight = 2 * u * kWeight8[i];
      add(front, std::sin(front), cos_front, sigma, weight * (entry - peak));
      const double rear = exit + (peak - exit) * u * u;
      add(rear, std::sin(rear), std::cos(rear), sigma, weight * (peak - exit));
    }
  }

  // The same integrals over [a, b] inside one zone, with points that crowd at both ends.
  void between(double a, double b) {
    const auto [entry, peak, exit] = angles_;
    const bool is_front = a + b > 2 * peak;
    for (std::size_t i = 0; i < kNode16.size(); ++i) {
      const double u = kNode16[i];
      const double theta = a + (b - a) * u * u * (3 - 2 * u);
      const double front = is_front ? theta : entry - (theta - exit) / (peak - exit) * (entry - peak);
      const double cos_theta = std::cos(theta);
      add(theta, std::sin(theta), cos_theta, stress(is_front ? cos_theta : std::cos(front)), (b - a) * 6 * u * (1 - u) * kWeight16[i]);
    }
  }

  // Where soil that was packed before meets its virgin curve, as an angle of the front zone; nothing: outside.
  void split_at_kink(double kink) { kink_ = kink; }

  void integrate() {
    const auto [entry, peak, exit] = angles_;
    const double steepness = std::hypot(per_k_ * std::max(std::abs(1 - travel_), std::abs(1 - travel_ * cos_entry_)), per_ky_ * lateral_);
    const std::array<double, 2> turns = sign_changes();
    if (kink_ < 0 && std::isnan(turns[0]) && std::isnan(turns[1]) && steepness * (entry - exit) <= kSteep) {
      plain();
      return;
    }
    std::array<double, 16> ends = {exit, peak, entry};
    std::size_t n = 3;
    const auto cut = [&](double theta) {
      if (theta > exit && theta < entry) ends[n++] = theta;
    };
    const auto cut_layers = [&](double theta, double slope) {
      for (const double depth : {4.0, 20.0}) {
        cut(theta - depth / slope);
        if (theta < entry) cut(theta + depth / slope);
      }
    };
    const bool steep = steepness * (entry - exit) > kSteep;
    if (steep) cut_layers(entry, std::max(std::hypot(per_k_ * (1 - travel_ * cos_entry_), per_ky_ * lateral_), 1e-12));
    for (const double turn : turns) {
      if (std::isnan(turn)) continue;
      cut(turn);
      if (steep) cut_layers(turn, std::max(std::hypot(per_k_ * (1 - travel_ * std::cos(turn)), per_ky_ * lateral_), 1e-12));
    }
    if (kink_ >= 0) {
      const double front = std::acos(std::clamp(cos_entry_ + kink_ / radius_, -1.0, 1.0));
      if (front > peak) {
        cut(front);
        cut(exit + (entry - front) / (entry - peak) * (peak - exit));
      }
    }
    std::sort(ends.begin(), ends.begin() + static_cast<std::ptrdiff_t>(n));
    for (std::size_t k = 0; k + 1 < n; ++k)
      if (ends[k + 1] > ends[k]) between(ends[k], ends[k + 1]);
  }

  SoilReaction reaction(double width) const {
    const double area = radius_ * width;
    SoilReaction reaction;
    reaction.normal_load = area * normal_;
    reaction.drawbar_pull = area * drawbar_;
    reaction.side_force = area * side_;
    reaction.torque = area * radius_ * torque_;
    reaction.rolling_torque = area * radius_ * rolling_;
    reaction.shear_strength = area * strength_;
    reaction.contact_length = radius_ * (sin_entry_ - std::sin(angles_.exit));
    reaction.entry_angle = angles_.entry;
    reaction.peak_angle = angles_.peak;
    reaction.exit_angle = angles_.exit;
    reaction.peak_stress = stress(std::cos(angles_.peak));
    return reaction;
  }

 private:
  // Angles inside the contact where the longitudinal shear displacement of a braked wheel changes its sign; NaN: none.
  // With dj/dtheta = kappa cos theta - 1 it has a maximum at acos(1/kappa) and a minimum at -acos(1/kappa).
  std::array<double, 2> sign_changes() const {
    std::array<double, 2> changes = {std::nan(""), std::nan("")};
    if (travel_ <= 1) return changes;
    const auto j = [&](double theta) { return (angles_.entry - theta) - travel_ * (sin_entry_ - std::sin(theta)); };
    const auto root = [&](double low, double high) {  // j has opposite signs at low and high
      const bool rises = j(low) < 0;
      for (int k = 0; k < 60; ++k) {
        const double middle = 0.5 * (low + high);
        ((j(middle) < 0) == rises ? low : high) = middle;
      }
      return 0.5 * (low + high);
    };
    const double extremum = std::acos(1 / travel_);
    const double low = std::max(angles_.exit, -extremum);
    if (extremum < angles_.entry && low < extremum && j(low) < 0) changes[0] = root(low, extremum);
    if (angles_.exit < -extremum && j(-extremum) < 0 && j(angles_.exit) > 0) changes[1] = root(angles_.exit, -extremum);
    return changes;
  }

  Pressure pressure_;
  double cohesion_, tan_phi_, radius_, per_k_, per_ky_, travel_, lateral_, lateral_0_;
  Angles angles_;
  double sin_entry_, cos_entry_;
  double kink_ = -1;  // [m] above the entry's depth
  double normal_ = 0, drawbar_ = 0, side_ = 0, torque_ = 0, rolling_ = 0, strength_ = 0;
};

Angles angles_of(const Soil& soil, const WheelShape& wheel, double sinkage, double slip_ratio, bool one_zone) {
  const double ratio = std::clamp(sinkage / wheel.radius, 0.0, 1.0);
  Angles angles;
  angles.entry = std::acos(1 - ratio);
  if (one_zone) return angles;  // bekker: peak and exit at bottom dead centre
  angles.exit = -std::acos(std::max(-1.0, 1 - soil.exit_sinkage_ratio * ratio));
  angles.peak = std::clamp((soil.peak_angle_offset + soil.peak_angle_slip * slip_ratio) * angles.entry, angles.exit, angles.entry);
  return angles;
}

template <class Pressure>
SoilReaction react_with(const Pressure& virgin, const Soil& soil, const WheelShape& wheel, const WheelMotion& motion, bool one_zone) {
  if (soil.packed_depth <= 0) {
    Integrals integrals(virgin, soil, wheel, motion, angles_of(soil, wheel, motion.sinkage, motion.slip_ratio, one_zone));
    integrals.integrate();
    return integrals.reaction(wheel.width);
  }
  const PackedPressure packed(virgin, soil.packed_depth, soil.packed_stiffness);
  const double sinkage = motion.sinkage - packed.rebound_depth();
  if (sinkage <= 0) return {};
  Soil springy = soil;
  springy.exit_sinkage_ratio = std::max(soil.exit_sinkage_ratio, packed.exit_ratio(sinkage));
  Integrals integrals(packed, springy, wheel, motion, angles_of(springy, wheel, sinkage, motion.slip_ratio, one_zone));
  integrals.split_at_kink(packed.kink());
  integrals.integrate();
  return integrals.reaction(wheel.width);
}

}  // namespace

SoilReaction react(WheelSoilLaw law, const Soil& soil, const WheelShape& wheel, const WheelMotion& motion) {
  switch (law) {
    case WheelSoilLaw::bekker: return react_with(BekkerWongPressure(soil, wheel), soil, wheel, motion, true);
    case WheelSoilLaw::bekker_wong: return react_with(BekkerWongPressure(soil, wheel), soil, wheel, motion, false);
    case WheelSoilLaw::reece: return react_with(ReecePressure(soil, wheel), soil, wheel, motion, false);
    case WheelSoilLaw::rigid: break;  // has no soil; see simulate/rigid_contact.hpp
  }
  return {};
}

}  // namespace rille
