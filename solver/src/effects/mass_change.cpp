// Mass change: a body weighs more or less than its CAD says; its inertia scales with it.
//   m -> m + mass,   I -> I (m + mass)/m
#include "effects/effect.hpp"

namespace rille::effects {
void attach_mass_change(const Attachment& a) {
  a.each(a.model.rover.bodies.size(), [&](std::size_t k) {
    Body& body = a.model.rover.bodies[k];
    const double mass = body.mass + a["mass"];
    if (!(mass > 0)) throw InputRefused("mass_change leaves body '" + body.name + "' without mass; choose a larger value of mass");
    body.inertia *= mass / body.mass;
    body.mass = mass;
  });
}

}  // namespace rille::effects
