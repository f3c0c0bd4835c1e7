// The laws that this solver knows, by their names in the catalogue (schema/effects.sql).
#pragma once

#include <string>
#include <vector>

#include "effects/effect.hpp"

namespace rille {

// Applies the model's effects in their order: some change the model, others come back as objects that act in every step.
// Raises InputRefused for a law that this solver does not have, or one that does not fit its target.
Effects attach_effects(Model& model);

// Longest time [s] by which effects make a command reach its drive later than it was given.
double longest_command_delay(const Model& model);

std::vector<std::string> known_effects();

}  // namespace rille
