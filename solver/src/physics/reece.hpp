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

class ReecePressure {
 public:
  ReecePressure(const Soil& soil, const WheelShape& wheel) : exponent_(soil.sinkage_exponent), per_width_(1 / wheel.width) {
    const double conversion = std::pow(wheel.width, soil.sinkage_exponent - 1);
    const double cohesive = soil.reece_cohesive_modulus ? soil.cohesion * *soil.reece_cohesive_modulus
                                                        : soil.cohesive_modulus * conversion;
    const double frictional = soil.reece_frictional_modulus ? soil.unit_weight * *soil.reece_frictional_modulus
                                                            : soil.frictional_modulus * conversion;
    pressure_ = cohesive + frictional * wheel.width;
  }

  // [Pa] at a depth [m]
  double operator()(double depth) const {
    if (depth <= 0) return 0;
    const double ratio = per_width_ * depth;
    return exponent_ == 1.0 ? pressure_ * ratio : pressure_ * std::pow(ratio, exponent_);
  }

 private:
  double pressure_ = 0;  // [Pa] at a sinkage of one width
  double exponent_;      // [-]
  double per_width_;     // [1/m]
};

}  // namespace rille
