// Soil that was packed before: below its old surface it is stiff until it meets the pressure that packed it.
//   z <= z_u:  p = k_u (z - z_e),  z_e = z_u - p_u/k_u    unloading and reloading line
//   z >  z_u:  p = p_virgin(z)
// What was packed before comes back elastically behind the wheel: the exit ratio is at least min(p(z), p_u) / (k_u z), 1 while the rut is not
// deepened, and nothing for soil that was hardly packed. How far fresh soil comes back is the soil's own exit ratio.
// z_u: depth it was packed to, p_u = p_virgin(z_u), k_u: stiffness of the line, never less than the secant p_u/z_u.
// Source: J. Y. Wong, "Theory of Ground Vehicles" (2008), ch. 2.4.2, response to repetitive loading.
#pragma once

#include <algorithm>

namespace rille {

template <class Virgin>
class PackedPressure {
 public:
  PackedPressure(const Virgin& virgin, double depth, double stiffness) : virgin_(virgin), depth_(depth) {
    pressure_ = virgin(depth);
    stiffness_ = std::max(stiffness, pressure_ / depth);
    rebound_ = stiffness_ > 0 ? depth - pressure_ / stiffness_ : 0;
  }

  double rebound_depth() const { return rebound_; }           // [m] z_e: where the unloaded rut's floor lies
  // lambda of theta_r = -acos(1 - lambda z/r) at a sinkage [m] below the floor
  double exit_ratio(double sinkage) const { return std::min(1.0, pressure_ / (stiffness_ * sinkage)); }
  double kink() const { return depth_ - rebound_; }           // [m] above the floor, where the virgin curve is met
  // [Pa] at a depth [m] below the floor
  double operator()(double depth) const {
    const double total = depth + rebound_;
    return total > depth_ ? virgin_(total) : std::max(0.0, stiffness_ * depth);
  }

 private:
  Virgin virgin_;
  double depth_;
  double pressure_ = 0;
  double stiffness_ = 0;
  double rebound_ = 0;
};

}  // namespace rille
