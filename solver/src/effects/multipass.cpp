// Multipass: a wheel in the rut of an earlier one meets packed soil. Up to the depth z_u of the rut it follows the reloading line
//   k_u = unload_stiffness + stiffness_growth z_u,   then the virgin curve (see physics/packed.hpp);   z_u = memory x depth of the rut
// Source: J. Y. Wong, "Theory of Ground Vehicles" (2008), ch. 2.4.2, eq. 2.56 (k_u = k_0 + A_u z_u).
#include <algorithm>

#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class Multipass final : public WheelEffect {
 public:
  Multipass(double memory, double unload_stiffness, double stiffness_growth)
      : memory_(memory), unload_stiffness_(unload_stiffness), stiffness_growth_(stiffness_growth) {}
  bool reads_ruts() const override { return true; }
  void before(WheelSite& site) const override {
    site.soil.packed_depth = std::min(memory_ * site.rut_depth, 0.99 * site.wheel->radius);
    site.soil.packed_stiffness = unload_stiffness_ + stiffness_growth_ * site.soil.packed_depth;
  }

 private:
  double memory_;            // [-] 0: virgin soil, 1: the whole rut counts
  double unload_stiffness_;  // [Pa/m]
  double stiffness_growth_;  // [Pa/m^2]
};

}  // namespace

void attach_multipass(const Attachment& a) {
  a.to_wheels<Multipass>(a["memory"], a["unload_stiffness"], a["stiffness_growth"]);
}

}  // namespace rille::effects
