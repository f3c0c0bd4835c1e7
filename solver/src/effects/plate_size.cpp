// Plate-size law: wide plates meet more resistance than Bekker's (kc/b + kphi) says, since weight of soil beside them bears too:
//   both pressure-sinkage moduli are multiplied by (b / reference_width)^exponent
// exponent 1 is the 1/2 gamma b N_gamma term of bearing capacity; 0 is Bekker. Source: K. Terzaghi, "Theoretical Soil Mechanics" (1943), ch. 8;
// G. G. Meyerhof, Geotechnique 2 (1951).
#include <cmath>

#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class PlateSize final : public WheelEffect {
 public:
  PlateSize(double exponent, double reference_width) : exponent_(exponent), reference_width_(reference_width) {}
  void before(WheelSite& site) const override { scale_pressure(site.soil, std::pow(site.wheel->width / reference_width_, exponent_)); }

 private:
  double exponent_;         // [-]
  double reference_width_;  // [m]
};

}  // namespace

void attach_plate_size(const Attachment& a) { a.to_wheels<PlateSize>(a["exponent"], a["reference_width"]); }

}  // namespace rille::effects
