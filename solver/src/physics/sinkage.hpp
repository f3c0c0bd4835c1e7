// Sinkage at which a wheel carries a given load: the root of N(z) = W.
#pragma once

#include <functional>

#include "physics/wheel_soil.hpp"

namespace rille {

struct Equilibrium {
  bool found = false;
  double sinkage = 0;  // [m]
  SoilReaction reaction;
};

// Bracketed root by the method of Illinois (Dowell & Jarratt 1971) on z in (0, radius), to 1e-14 of the load. Not found if the soil does not
// carry the load before the wheel is buried to its axle. exponent: n of the soil, a hint for the interpolation; guess [m]: start, 0: none.
Equilibrium sinkage_under_load(const std::function<SoilReaction(double sinkage)>& reaction_at, double radius, double exponent, double load,
                               double guess = 0);

// The same for a bare law. `motion.sinkage` is the first guess.
Equilibrium sinkage_under_load(WheelSoilLaw law, const Soil& soil, const WheelShape& wheel, WheelMotion motion, double load);

}  // namespace rille
