// The wheel-soil integrals against values computed by adaptive quadrature to 1e-12, and against their own limits.
#include <doctest/doctest.h>

#include <cmath>

#include "models.hpp"
#include "physics/slip.hpp"
#include "physics/wheel_soil.hpp"

using namespace rille;

namespace {

// Independent evaluation: composite Simpson rule in theta with 20 000 cells per zone and the plain textbook formulas.
struct Forces {
  double normal = 0, drawbar = 0, torque = 0;
};

Forces textbook(const Soil& soil, double r, double b, double z, double slip) {
  const double entry = std::acos(1 - z / r);
  const double exit = -std::acos(1 - soil.exit_sinkage_ratio * z / r);
  const double peak = (soil.peak_angle_offset + soil.peak_angle_slip * slip) * entry;
  const auto integrand = [&](double theta) {
    const double mapped = theta >= peak ? theta : entry - (theta - exit) / (peak - exit) * (entry - peak);
    const double depth = std::max(0.0, r * (std::cos(mapped) - std::cos(entry)));
    const double sigma = (soil.cohesive_modulus / b + soil.frictional_modulus) * std::pow(depth, soil.sinkage_exponent);
    const double j = r * ((entry - theta) - (1 - slip) * (std::sin(entry) - std::sin(theta)));
    const double tau = (soil.cohesion + sigma * std::tan(soil.friction_angle)) * (1 - std::exp(-j / soil.shear_modulus));
    return Forces{sigma * std::cos(theta) + tau * std::sin(theta), tau * std::cos(theta) - sigma * std::sin(theta), tau};
  };
  Forces sum;
  const auto zone = [&](double from, double to) {
    constexpr int kCells = 20000;
    const double width = (to - from) / kCells;
    for (int k = 0; k <= 2 * kCells; ++k) {
      const Forces f = integrand(from + 0.5 * width * k);
      const double weight = width / 6 * (k == 0 || k == 2 * kCells ? 1 : k % 2 == 1 ? 4 : 2);
      sum.normal += weight * f.normal;
      sum.drawbar += weight * f.drawbar;
      sum.torque += weight * f.torque;
    }
  };
  zone(exit, peak);
  zone(peak, entry);
  return {r * b * sum.normal, r * b * sum.drawbar, r * r * b * sum.torque};
}

}  // namespace

TEST_CASE("eight points per zone agree with a fine independent rule") {
  for (const double n : {0.8, 1.0, 1.3}) {
    for (const double slip : {0.0, 0.2, 0.8}) {
      Soil soil = test::lunar_soil();
      soil.sinkage_exponent = n;
      soil.exit_sinkage_ratio = 0.1;
      const double r = 0.15, b = 0.165, z = 0.0125;
      const Forces expected = textbook(soil, r, b, z, slip);
      const SoilReaction got = react(WheelSoilLaw::bekker_wong, soil, {r, b}, {z, slip, 1 - slip, 0});
      // The rule itself reaches 1e-8 at n = 1 and 1e-7 where the stress has a root at the ends (n < 1).
      const double tolerance = n == 1.0 ? 2e-8 : 5e-7;
      CHECK(got.normal_load == doctest::Approx(expected.normal).epsilon(tolerance));
      CHECK(std::abs(got.drawbar_pull - expected.drawbar) < tolerance * expected.normal);
      CHECK(got.torque == doctest::Approx(expected.torque).epsilon(tolerance));
    }
  }
}

TEST_CASE("lateral shear: none without side motion, and never more than the strength") {
  const Soil soil = test::lunar_soil();
  const WheelShape wheel{0.15, 0.165};
  CHECK(react(WheelSoilLaw::bekker_wong, soil, wheel, {0.01, 0.2, 0.8, 0}).side_force == 0);
  const SoilReaction sideways = react(WheelSoilLaw::bekker_wong, soil, wheel, {0.01, 0, 1, 1e3});
  CHECK(sideways.side_force < sideways.shear_strength);
  CHECK(sideways.side_force > 0.95 * sideways.shear_strength);
  CHECK(std::abs(sideways.torque) < 0.01 * wheel.radius * sideways.shear_strength);
}

TEST_CASE("slip is continuous between driving, rolling and braking, and symmetric in direction") {
  CHECK(slip_of(0.08, 0.1, 0).ratio == doctest::Approx(0.2));
  CHECK(slip_of(0.1, 0.08, 0).ratio == doctest::Approx(-0.2));
  CHECK(slip_of(-0.08, -0.1, 0).ratio == doctest::Approx(0.2));
  CHECK(slip_of(-0.08, -0.1, 0).direction == -1);
  CHECK(slip_of(0.1, 0, 0).ratio == -1);
  CHECK(slip_of(0, 0.1, 0).ratio == 1);
  CHECK(std::abs(slip_of(0.1, 0.1, 0).ratio) < 1e-7);
  CHECK(slip_of(0.1, 0.08, 0).travel_ratio == doctest::Approx(0.1 / 0.08));
  CHECK(std::abs(slip_of(0, 0, 0).ratio) < 1e-7);
}

TEST_CASE("a wheel that is all but locked and drifts is pushed against its motion, as a locked one is") {
  // All shear is mobilised: it lies along (v - u, v_y), and nothing changes where the rim passes rest. The bounds leave room for the
  // few degrees of the contact over which the displacement turns.
  const Soil soil = test::lunar_soil();
  const WheelShape wheel{0.12, 0.1};
  const double v = 0.02;
  for (const double v_y : {0.02, 0.07, 0.2}) {
    const auto pushed = [&](double u) {
      const Slip slip = slip_of(v, u, v_y);
      return react(WheelSoilLaw::bekker_wong, soil, wheel, {0.005, slip.ratio, slip.travel_ratio, slip.lateral_ratio});
    };
    const SoilReaction locked = pushed(0);
    CHECK(-locked.side_force * wheel.radius / locked.torque == doctest::Approx(v_y / v).epsilon(0.03));
    for (const double share : {1e-2, 3e-3, 1e-3, 1e-4, -1e-3}) {
      const SoilReaction near = pushed(share * v);
      CHECK(near.side_force == doctest::Approx(locked.side_force).epsilon(0.03));
      CHECK(near.torque == doctest::Approx(locked.torque).epsilon(0.03));
      CHECK(near.normal_load == doctest::Approx(locked.normal_load).epsilon(0.01));
      CHECK(near.rolling_torque == doctest::Approx(locked.rolling_torque).epsilon(0.01));
    }
  }
}
