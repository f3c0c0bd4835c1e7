// Slip of a wheel from its velocities, and the ratios that the shear displacement needs.
//   driven, |r w| >= |v|:  s = 1 - v/(r w),   braked, |r w| < |v|:  s = (r w)/v - 1,   both in [-1, 1]
// seen in the direction of travel, which is the sign of the larger of the two velocities.
// Source: J. Y. Wong, "Theory of Ground Vehicles", ch. 1.3 and 2.
#pragma once

#include <algorithm>
#include <cmath>

#include "physics/wheel_soil.hpp"

namespace rille {

// Below this speed [m/s] a wheel counts as parked: the ratios are taken against it, so that shear builds up from zero
// continuously. It bounds the creep of a parked rover to a fraction of it: micrometres per minute on a 15 degree slope.
inline constexpr double kParkingSpeed = 1e-6;

// Below this speed [m/s] the normal load takes the slip against it. The stress integrals describe steady rolling over a whole contact
// length; a standing wheel that trembles by micrometres does not turn its shear stresses over, and if it did, its load would
// jump with each reversal and keep the tremble alive.
inline constexpr double kRollingSpeed = 5e-3;

struct Slip {
  double direction = 1;      // [-] +1 or -1: travel along t or against it
  double ratio = 0;          // [-] s
  double travel_ratio = 1;   // [-] kappa = v / (r w), bounded
  double lateral_ratio = 0;  // [-] |v_y| / (r w), bounded
  double sliding_speed = 0;  // [m/s] |u - v| that belongs to ratio, never zero
  double lateral_speed = 0;  // [m/s] |v_y| that belongs to lateral_ratio, never zero
};

// v: speed of the wheel's centre along t; u = r w: speed of the rim; v_y: lateral speed; floor: smallest reference [m/s].
inline Slip slip_of(double v, double u, double v_y, double floor = kParkingSpeed) {
  constexpr double kLargest = 1e3;   // beyond it shear is fully mobilised in any soil
  constexpr double kSmallest = 1e-8; // floor of the ratios, so that force per speed is defined at zero speed
  Slip slip;
  const bool driven = std::abs(u) >= std::abs(v);
  slip.direction = (driven ? u : v) < 0 ? -1 : 1;
  const double reference = std::max({std::abs(u), std::abs(v), floor});
  double ratio = slip.direction * (u - v) / reference;
  if (std::abs(ratio) < kSmallest) ratio = ratio < 0 ? -kSmallest : kSmallest;
  slip.sliding_speed = std::abs(ratio) * reference;
  slip.lateral_speed = std::max(std::abs(v_y), kSmallest * reference);
  slip.ratio = std::clamp(ratio, -1.0, 1.0);
  slip.travel_ratio = driven ? 1 - ratio : (1 + ratio > 1 / kLargest ? 1 / (1 + ratio) : kLargest);
  // The shear turns with v_y against u - v: where kappa is at its bound, v_y / (r w) is in proportion to it.
  slip.lateral_ratio = std::min(slip.lateral_speed / reference, kLargest) * (driven ? 1 : slip.travel_ratio);
  return slip;
}

}  // namespace rille
