#include "physics/sinkage.hpp"

#include <cmath>

namespace rille {

Equilibrium sinkage_under_load(WheelSoilLaw law, const Soil& soil, const WheelShape& wheel, WheelMotion motion,
                               double load) {
  constexpr int kMostSteps = 200;
  Equilibrium result;
  const auto excess = [&](double z) {
    motion.sinkage = z;
    result.reaction = react(law, soil, wheel, motion);
    result.sinkage = z;
    return result.reaction.normal_load - load;
  };
  double low = 0, f_low = -load;
  double high = wheel.radius, f_high = excess(high);
  if (!(f_high >= 0)) return result;
  if (motion.sinkage > 0 && motion.sinkage < wheel.radius) {
    const double f = excess(motion.sinkage);
    (f < 0 ? low : high) = motion.sinkage;
    (f < 0 ? f_low : f_high) = f;
  }
  // The load grows about as z^(n + 1/2), which is nearly straight in that power: interpolate there, not in z.
  const double power = soil.sinkage_exponent + 0.5;
  double a = std::pow(low, power), b = std::pow(high, power);
  int side = 0;
  for (int k = 0; k < kMostSteps; ++k) {
    const double guess = (a * f_high - b * f_low) / (f_high - f_low);
    const double z = std::pow(guess, 1 / power);
    const double f = excess(z);
    if (std::abs(f) <= 1e-14 * load || std::abs(b - a) <= 1e-15 * b) {
      result.found = true;
      return result;
    }
    if (f < 0) {
      a = guess;
      f_low = f;
      if (side == -1) f_high /= 2;
      side = -1;
    } else {
      b = guess;
      f_high = f;
      if (side == 1) f_low /= 2;
      side = 1;
    }
  }
  result.found = std::abs(result.reaction.normal_load - load) <= 1e-9 * load;
  return result;
}

}  // namespace rille
