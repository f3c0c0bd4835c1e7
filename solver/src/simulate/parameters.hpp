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

// get_ and set_parameter raise InputRefused for a name that the model does not have, set_parameter also for a value outside the parameter's bounds.
// Adds an effect to those that the model has: numbers by name, those that are not given as the catalogue says. Without amplitude nothing is
// added. Raises InputRefused for what catalogue or rover do not have, and for a number outside its bounds.
void add_effect(Model& model, EffectRow effect, const std::string& target_kind);
// Whether what the model does depends on what was before a motion: effects with a state of their own, drives that integrate.
bool has_memory(const Model& model);

double get_parameter(Model& model, const std::string& name);
void set_parameter(Model& model, const std::string& name, double value);

}  // namespace rille
