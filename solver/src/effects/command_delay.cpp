// Command delay: every command reaches the drive later than it was given. Source: transport delay, e.g. Astrom & Murray (2008), ch. 9.
#include <algorithm>

#include "effects/effect.hpp"

namespace rille::effects {
void attach_command_delay(const Attachment& a) {
  auto& commands = a.model.scenario.commands;
  for (Command& command : commands) {
    const int joint = a.model.rover.drives[static_cast<std::size_t>(command.drive)].joint;
    if (a.row.index < 0 || a.row.index == joint) command.time += a["delay"];
  }
  std::stable_sort(commands.begin(), commands.end(), [](const Command& x, const Command& y) { return x.time < y.time; });
}

}  // namespace rille::effects
