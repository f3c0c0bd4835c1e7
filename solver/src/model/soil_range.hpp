// What the numbers of a soil may be; asked wherever a soil comes in: from a database, from Python, from a fit.
#pragma once

#include <fmt/format.h>

#include <limits>
#include <string>

#include "model/error.hpp"
#include "model/terrain.hpp"

namespace rille {

struct SoilNumber {
  const char* name;  // as in table soil
  double Soil::*value;
  double lower, upper;
};

inline constexpr double kAboveZero = std::numeric_limits<double>::min();
inline constexpr double kAny = std::numeric_limits<double>::max();

inline constexpr SoilNumber kSoilNumbers[] = {
    {"sinkage_exponent", &Soil::sinkage_exponent, 0.3, 3},
    {"cohesive_modulus", &Soil::cohesive_modulus, -1e15, 1e15},
    {"frictional_modulus", &Soil::frictional_modulus, 0, 1e15},
    {"cohesion", &Soil::cohesion, 0, 1e9},
    {"friction_angle", &Soil::friction_angle, 0, 1.5707},
    {"shear_modulus", &Soil::shear_modulus, kAboveZero, kAny},
    {"lateral_shear_modulus", &Soil::lateral_shear_modulus, kAboveZero, kAny},
    {"peak_angle_offset", &Soil::peak_angle_offset, 0, 1},
    {"peak_angle_slip", &Soil::peak_angle_slip, -1, 1},
    {"exit_sinkage_ratio", &Soil::exit_sinkage_ratio, 0, 2},
    {"damping", &Soil::damping, 0, 1e12},
};

// Raises InputRefused unless lower <= value <= upper; a value that is not finite never is.
inline void require_within(double value, double lower, double upper, const std::string& what) {
  if (value >= lower && value <= upper) return;
  if (lower == kAboveZero && upper == kAny) throw InputRefused(fmt::format("{} is {:g}; it must be above 0", what, value));
  if (upper == kAny) throw InputRefused(fmt::format("{} is {:g}; it must be {}", what, value, lower == -kAny ? "finite" : fmt::format("at least {:g}", lower)));
  throw InputRefused(fmt::format("{} is {:g}; it must lie in {:g} to {:g}", what, value, lower, upper));
}

inline void require_valid(const Soil& soil, const std::string& subject) {
  for (const SoilNumber& number : kSoilNumbers) require_within(soil.*number.value, number.lower, number.upper, std::string(number.name) + " of " + subject);
  require_within(soil.unit_weight, 0, kAny, "unit weight (density times gravity) of " + subject);
  if (soil.reece_cohesive_modulus) require_within(*soil.reece_cohesive_modulus, -1e15, 1e15, "reece_cohesive_modulus of " + subject);
  if (soil.reece_frictional_modulus) require_within(*soil.reece_frictional_modulus, -1e15, 1e15, "reece_frictional_modulus of " + subject);
}

// Moduli may be negative one by one, but under a wheel the pressure must grow with sinkage. (`reece` with moduli of its own needs a unit
// weight, which a free-floating study may not have: there, what does not carry is an outcome.)
inline void require_carries(const Soil& soil, WheelSoilLaw law, double width, const std::string& subject, const std::string& wheel) {
  const bool own = law == WheelSoilLaw::reece && (soil.reece_cohesive_modulus || soil.reece_frictional_modulus);
  const double modulus = soil.cohesive_modulus / width + soil.frictional_modulus;
  if (own || modulus > 0) return;
  throw InputRefused(fmt::format("cohesive_modulus / width + frictional_modulus of {} is {:g} under {}; it must be above 0", subject, modulus, wheel));
}

}  // namespace rille
