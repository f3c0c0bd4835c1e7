// Numbers of a model by name, for studies and fits: "soil.lunar.cohesion", "body.chassis.mass", "effect.coulomb_friction.hub.torque".
#pragma once

#include <string>
#include <vector>

#include "model/model.hpp"

namespace rille {

struct Parameter {
  std::string name;
  double* place;  // in the model; valid while the model is not changed otherwise
  double lower, upper;
};

// Every parameter that may be read and set.
std::vector<Parameter> parameters(Model& model);

// Both raise InputRefused for a name that the model does not have, set_parameter also for a value outside the parameter's bounds.
double get_parameter(Model& model, const std::string& name);
void set_parameter(Model& model, const std::string& name, double value);

}  // namespace rille
