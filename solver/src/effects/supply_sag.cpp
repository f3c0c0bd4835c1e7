// Supply sag: the bus voltage falls with the current of all drives, and speeds and largest efforts with it:
//   factor = 1 - sag x mean over drives of |effort| / max_torque   (of the last step)
// Source: internal resistance of a battery, V = V_0 - R I, with I in proportion to effort.
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
