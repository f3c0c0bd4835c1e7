// Normal stress under a rolling wheel after Wong & Reece (1967) with the pressure-sinkage moduli of Bekker (1956).
//   front, theta_m <= theta <= theta_f:  sigma = (kc/b + kphi) (r (cos theta - cos theta_f))^n
//   rear,  theta_r <= theta <= theta_m:  the same at theta_e = theta_f - (theta - theta_r)/(theta_m - theta_r) (theta_f - theta_m)
// Source: J.-Y. Wong & A. R. Reece, "Prediction of rigid wheel performance based on the analysis of soil-wheel stresses",
// J. Terramechanics 4 (1967) part I, eqs 3-6; M. G. Bekker, "Theory of Land Locomotion" (1956).
#pragma once

#include <cmath>

#include "model/terrain.hpp"
#include "physics/wheel_soil.hpp"

namespace rille {

class BekkerWongPressure {
 public:
  BekkerWongPressure(const Soil& soil, const WheelShape& wheel)
      : modulus_(soil.cohesive_modulus / wheel.width + soil.frictional_modulus), exponent_(soil.sinkage_exponent) {}

  // [Pa] at a depth [m]
  double operator()(double depth) const {
    if (depth <= 0) return 0;
    return exponent_ == 1.0 ? modulus_ * depth : modulus_ * std::pow(depth, exponent_);
  }

 private:
  double modulus_;   // [N/m^(n+2)] kc/b + kphi
  double exponent_;  // [-]
};

}  // namespace rille
