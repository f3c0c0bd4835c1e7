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

// Stress at the front angle theta; the rear zone is the front zone read through theta_e.
class BekkerWongStress {
 public:
  BekkerWongStress(const Soil& soil, const WheelShape& wheel, double cos_entry)
      : modulus_(soil.cohesive_modulus / wheel.width + soil.frictional_modulus),
        exponent_(soil.sinkage_exponent),
        radius_(wheel.radius),
        cos_entry_(cos_entry) {}

  // [Pa] from cos theta of a point of the front zone
  double operator()(double cos_theta) const {
    const double depth = radius_ * (cos_theta - cos_entry_);
    if (depth <= 0) return 0;
    return exponent_ == 1.0 ? modulus_ * depth : modulus_ * std::pow(depth, exponent_);
  }

 private:
  double modulus_;    // [N/m^(n+2)] kc/b + kphi
  double exponent_;   // [-]
  double radius_;     // [m]
  double cos_entry_;  // [-]
};

}  // namespace rille
