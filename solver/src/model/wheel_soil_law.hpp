// The wheel-soil laws and the words for them, the same in database, Python and on the command line.
#pragma once

#include <fmt/format.h>

#include <map>
#include <string>

#include "model/error.hpp"

namespace rille {

// `rigid`: ground as hard as rock, no soil law at all.
enum class WheelSoilLaw { bekker, bekker_wong, reece, rigid };

inline const std::map<std::string, WheelSoilLaw>& wheel_soil_laws() {
  static const std::map<std::string, WheelSoilLaw> laws = {{"bekker", WheelSoilLaw::bekker},
                                                           {"bekker_wong", WheelSoilLaw::bekker_wong},
                                                           {"reece", WheelSoilLaw::reece},
                                                           {"rigid", WheelSoilLaw::rigid}};
  return laws;
}

inline std::string word(WheelSoilLaw law) {
  for (const auto& [name, value] : wheel_soil_laws())
    if (value == law) return name;
  return "";
}

// A law of soft soil by its word. Raises InputRefused.
inline WheelSoilLaw soft_soil_law(const std::string& name) {
  const auto found = wheel_soil_laws().find(name);
  if (found == wheel_soil_laws().end() || found->second == WheelSoilLaw::rigid)
    throw InputRefused(fmt::format("the wheel-soil law '{}' is unknown; known: bekker, bekker_wong, reece", name));
  return found->second;
}

}  // namespace rille
