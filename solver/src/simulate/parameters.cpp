#include "simulate/parameters.hpp"

#include <fmt/format.h>

#include "model/soil_range.hpp"

namespace rille {
namespace {

Parameter find(Model& model, const std::string& name) {
  for (Parameter& known : parameters(model))
    if (known.name == name) return known;
  throw InputRefused(fmt::format("the model has no parameter '{}'; Model.parameters() lists them", name));
}

}  // namespace

std::vector<Parameter> parameters(Model& model) {
  std::vector<Parameter> list;
  const auto add = [&](const std::string& name, double& value, double lower = -kAny, double upper = kAny) {
    list.push_back({name, &value, lower, upper});
  };
  if (model.terrain)
    for (std::size_t k = 0; k < model.terrain->soils.size(); ++k) {
      Soil& soil = model.terrain->soils[k];
      const std::string name = "soil." + model.terrain->soil_names[k] + ".";
      for (const SoilNumber& number : kSoilNumbers) add(name + number.name, soil.*number.value, number.lower, number.upper);
      add(name + "unit_weight", soil.unit_weight, 0);
      if (soil.reece_cohesive_modulus) add(name + "reece_cohesive_modulus", *soil.reece_cohesive_modulus, -1e15, 1e15);
      if (soil.reece_frictional_modulus) add(name + "reece_frictional_modulus", *soil.reece_frictional_modulus, -1e15, 1e15);
    }
  for (Body& body : model.rover.bodies) {
    add("body." + body.name + ".mass", body.mass, kAboveZero);
    add("body." + body.name + ".com_x", body.com.x());
    add("body." + body.name + ".com_y", body.com.y());
    add("body." + body.name + ".com_z", body.com.z());
    add("body." + body.name + ".ixx", body.inertia(0, 0), kAboveZero);
    add("body." + body.name + ".iyy", body.inertia(1, 1), kAboveZero);
    add("body." + body.name + ".izz", body.inertia(2, 2), kAboveZero);
  }
  for (Wheel& wheel : model.rover.wheels) {
    add("wheel." + wheel.name + ".radius", wheel.radius, kSmallestWheel, kLargestWheel);
    add("wheel." + wheel.name + ".width", wheel.width, kSmallestWheel, kLargestWheel);
  }
  for (Drive& drive : model.rover.drives) {
    add("drive." + drive.name + ".max_torque", drive.max_torque, kAboveZero);
    add("drive." + drive.name + ".position_gain", drive.position_gain, kAboveZero);
    add("drive." + drive.name + ".integral_gain", drive.integral_gain, 0, 1e12);
    if (drive.speed_gain) add("drive." + drive.name + ".speed_gain", *drive.speed_gain, kAboveZero);
  }
  for (EffectRow& effect : model.effects)
    for (auto& [name, value] : effect.parameters) add("effect." + effect.kind + "." + effect.target_name + "." + name, value);
  add("gravity.x", model.scenario.gravity.x());
  add("gravity.y", model.scenario.gravity.y());
  add("gravity.z", model.scenario.gravity.z());
  return list;
}

double get_parameter(Model& model, const std::string& name) { return *find(model, name).place; }

void set_parameter(Model& model, const std::string& name, double value) {
  const Parameter parameter = find(model, name);
  require_within(value, parameter.lower, parameter.upper, "the parameter '" + name + "'");
  *parameter.place = value;
}

}  // namespace rille
