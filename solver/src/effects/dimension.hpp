// Dimensions of quantities: exponents of m, kg, s, A. Angles and numbers have none.
#pragma once

#include <array>
#include <string>

namespace rille {

struct Dimension {
  std::array<double, 4> exponent = {};  // m, kg, s, A

  friend Dimension operator*(Dimension a, const Dimension& b) {
    for (std::size_t k = 0; k < 4; ++k) a.exponent[k] += b.exponent[k];
    return a;
  }
  Dimension to_the(double power) const {
    Dimension d = *this;
    for (double& e : d.exponent) e *= power;
    return d;
  }
  friend bool operator==(const Dimension&, const Dimension&) = default;
};

// Dimension of an SI unit such as "N m s/rad", "kg/m^3", "Pa s^0.5", "1" or "". Everything behind a "/" up to the next space divides.
// Raises InputRefused for a unit that it does not know.
Dimension dimension_of(const std::string& unit);

}  // namespace rille
