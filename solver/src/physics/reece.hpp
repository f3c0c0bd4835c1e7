// Normal stress under a rolling wheel after Wong & Reece (1967) with the pressure-sinkage relation of Reece (1965), which scales with the
// width of the plate:
//   p = (c kc' + gamma b kphi') (z/b)^n,  gamma: unit weight of the soil
// read at z = r (cos theta - cos theta_f) in the front zone; the rear zone is the front zone read through theta_e (see bekker_wong.hpp).
// A soil that gives Bekker moduli only is converted at the wheel's own width, c kc' = kc b^(n-1), gamma kphi' = kphi b^(n-1): then the law equals
// bekker_wong for this wheel (at n = 1 for every wheel). The laws differ in how they carry measured moduli over to other widths.
// Source: A. R. Reece, "Principles of soil-vehicle mechanics", Proc. Inst. Mech. Engrs 180 (1965) 2A; J.-Y. Wong & A. R. Reece, J. Terramechanics 4
// (1967) part I.
#pragma once

#include <cmath>

#include "model/terrain.hpp"
#include "physics/wheel_soil.hpp"

namespace rille {

class ReeceStress {
 public:
  ReeceStress(const Soil& soil, const WheelShape& wheel, double cos_entry)
      : exponent_(soil.sinkage_exponent), radius_per_width_(wheel.radius / wheel.width), cos_entry_(cos_entry) {
    const double conversion = std::pow(wheel.width, soil.sinkage_exponent - 1);
    const double cohesive = soil.reece_cohesive_modulus ? soil.cohesion * *soil.reece_cohesive_modulus
                                                        : soil.cohesive_modulus * conversion;
    const double frictional = soil.reece_frictional_modulus ? soil.unit_weight * *soil.reece_frictional_modulus
                                                            : soil.frictional_modulus * conversion;
    pressure_ = cohesive + frictional * wheel.width;
  }

  // [Pa] from cos theta of a point of the front zone
  double operator()(double cos_theta) const {
    const double depth = radius_per_width_ * (cos_theta - cos_entry_);
    if (depth <= 0) return 0;
    return exponent_ == 1.0 ? pressure_ * depth : pressure_ * std::pow(depth, exponent_);
  }

 private:
  double pressure_ = 0;      // [Pa] at a sinkage of one width
  double exponent_;          // [-]
  double radius_per_width_;  // [-]
  double cos_entry_;         // [-]
};

}  // namespace rille
