// Command delay: every command reaches the drive later than it was given. Source: transport delay, e.g. Astrom & Murray (2008), ch. 9.
#include "effects/effect.hpp"

namespace rille::effects {
void attach_command_delay(const Attachment& a) {
  const auto& drives = a.model.rover.drives;
  for (std::size_t d = 0; d < drives.size(); ++d)
    if (a.row.index < 0 || a.row.index == drives[d].joint) a.effects.command_delay[d] += a["delay"];
}

}  // namespace rille::effects
