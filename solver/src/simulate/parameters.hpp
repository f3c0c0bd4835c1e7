// Numbers of a model by name, for studies and fits: "soil.lunar.cohesion", "body.chassis.mass", "effect.coulomb_friction.hub.torque".
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "model/model.hpp"

namespace rille {

// Every parameter that may be read and set, with the place where it lives in the model (valid while the model is not changed otherwise).
std::vector<std::pair<std::string, double*>> parameters(Model& model);

// Raises InputRefused for a name that the model does not have.
double& parameter(Model& model, const std::string& name);

}  // namespace rille
