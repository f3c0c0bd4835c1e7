// Offset of the centre of mass: it lies elsewhere than CAD says, in the axes of M; the inertia about it stays.
#include "effects/effect.hpp"

namespace rille::effects {
void attach_com_offset(const Attachment& a) {
  a.each(a.model.rover.bodies.size(), [&](std::size_t k) { a.model.rover.bodies[k].com += Eigen::Vector3d(a["x"], a["y"], a["z"]); });
}

}  // namespace rille::effects
