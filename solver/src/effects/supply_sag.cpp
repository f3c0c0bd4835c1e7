// Supply sag: the voltage at a drive falls with its current, and its speed and largest effort with it:
//   w = set speed (1 - sag tau/max_torque),   |tau| <= max_torque/(1 + sag)
// A speed drive takes it implicitly, as a compliance in series with its servo. Source: internal resistance of a supply, V = V_0 - R I,
// with I in proportion to the effort.
#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class SupplySag final : public JointEffect {
 public:
  explicit SupplySag(double sag) : sag_(sag) {}
  void shape(DriveLine& line) const override { line.sag += sag_; }

 private:
  double sag_;  // [-]
};

}  // namespace

void attach_supply_sag(const Attachment& a) { a.to_joints<SupplySag>(a["sag"]); }

}  // namespace rille::effects
