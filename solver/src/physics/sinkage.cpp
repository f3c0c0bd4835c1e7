#include "physics/sinkage.hpp"

#include <cmath>

namespace rille {

Equilibrium sinkage_under_load(const std::function<SoilReaction(double)>& reaction_at, double radius, double exponent, double load, double guess) {
  constexpr int kMostSteps = 200;
  Equilibrium result;
  const auto excess = [&](double z) {
    result.reaction = reaction_at(z);
    result.sinkage = z;
    return result.reaction.normal_load - load;
  };
  double low = 0, f_low = -load;
  double high = radius, f_high = excess(high);
  if (!(f_high >= 0)) return result;
  // A good guess brackets the root tightly between a little less and a little more.
  for (const double z : {0.9 * guess, 1.1 * guess}) {
    if (!(z > low && z < high)) continue;
    const double f = excess(z);
    (f < 0 ? low : high) = z;
    (f < 0 ? f_low : f_high) = f;
  }
  // The load grows about as z^(n + 1/2), which is nearly straight in that power: interpolate there, not in z.
  const double power = exponent + 0.5;
  double a = std::pow(low, power), b = std::pow(high, power);
  int side = 0;
  for (int k = 0; k < kMostSteps; ++k) {
    const double next = (a * f_high - b * f_low) / (f_high - f_low);
    const double z = std::pow(next, 1 / power);
    const double f = excess(z);
    if (std::abs(f) <= 1e-14 * load || std::abs(b - a) <= 1e-15 * b) {
      result.found = true;
      return result;
    }
    if (f < 0) {
      a = next;
      f_low = f;
      if (side == -1) f_high /= 2;
      side = -1;
    } else {
      b = next;
      f_high = f;
      if (side == 1) f_low /= 2;
      side = 1;
    }
  }
  result.found = std::abs(result.reaction.normal_load - load) <= 1e-9 * load;
  return result;
}

Equilibrium sinkage_under_load(WheelSoilLaw law, const Soil& soil, const WheelShape& wheel, WheelMotion motion, double load) {
  const auto reaction_at = [&](double z) {
    motion.sinkage = z;
    return react(law, soil, wheel, motion);
  };
  return sinkage_under_load(reaction_at, wheel.radius, soil.sinkage_exponent, load, motion.sinkage);
}

}  // namespace rille
