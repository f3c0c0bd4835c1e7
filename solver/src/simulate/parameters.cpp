#include "simulate/parameters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/soil_range.hpp"

namespace rille {
namespace {

Parameter find(Model& model, const std::string& name) {
  for (Parameter& known : parameters(model))
    if (known.name == name) return known;
  throw InputRefused(fmt::format("the model has no parameter '{}'; Model.parameters() lists them", name));
}

std::pair<double, double> effect_bounds(const Model& model, const std::string& kind, const std::string& name) {
  if (model.catalogue)
    for (const Law& law : *model.catalogue)
      if (law.name == kind)
        for (const LawNumber& number : law.numbers)
          if (number.name == name) return {number.lower, number.upper};
  return {-kAny, kAny};
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
  if (model.rover.track_width > 0) add("track_width", model.rover.track_width, 1e-3, 1e3);
  for (Drive& drive : model.rover.drives) {
    add("drive." + drive.name + ".max_torque", drive.max_torque, kAboveZero);
    add("drive." + drive.name + ".position_gain", drive.position_gain, kAboveZero);
    add("drive." + drive.name + ".integral_gain", drive.integral_gain, 0, 1e12);
    if (drive.speed_gain) add("drive." + drive.name + ".speed_gain", *drive.speed_gain, kAboveZero);
  }
  for (EffectRow& effect : model.effects)
    for (auto& [name, value] : effect.parameters) {
      const auto bounds = effect_bounds(model, effect.kind, name);
      add("effect." + effect.kind + "." + effect.target_name + "." + name, value, bounds.first, bounds.second);
    }
  add("gravity.x", model.scenario.gravity.x());
  add("gravity.y", model.scenario.gravity.y());
  add("gravity.z", model.scenario.gravity.z());
  return list;
}

void add_effect(Model& model, EffectRow effect, const std::string& target_kind) {
  if (!model.catalogue) throw InputRefused("this model was not read from a database and knows no effects");
  const auto known = std::find_if(model.catalogue->begin(), model.catalogue->end(), [&](const Law& law) { return law.name == effect.kind; });
  if (known == model.catalogue->end()) throw InputRefused(fmt::format("there is no effect '{}'; see `rille effects list`", effect.kind));
  aim(effect, known->target == "any" ? target_kind : known->target, model.rover);
  std::map<std::string, double> given;
  std::swap(given, effect.parameters);
  bool present = false;
  for (const LawNumber& number : known->numbers) {
    const auto found = given.find(number.name);
    const double value = found != given.end() ? found->second : number.amplitude ? 0 : number.typical;
    if (!(value >= number.lower && value <= number.upper) && !(number.amplitude && value == 0))
      throw InputRefused(fmt::format("the parameter '{}' of effect '{}' on '{}' is {:g} {}; it must lie in {:g} to {:g}", number.name, effect.kind,
                                     effect.target_name, value, number.unit, number.lower, number.upper));
    effect.parameters[number.name] = value;
    present = present || (number.amplitude && value != 0);
    if (found != given.end()) given.erase(found);
  }
  if (!given.empty())
    throw InputRefused(fmt::format("the effect '{}' has no parameter '{}'; see `rille effects show {}`", effect.kind, given.begin()->first, effect.kind));
  if (present) model.effects.push_back(std::move(effect));
}

bool has_memory(const Model& model) {
  const auto remembers = [&](const EffectRow& effect) {
    return model.catalogue && std::any_of(model.catalogue->begin(), model.catalogue->end(), [&](const Law& law) { return law.memory && law.name == effect.kind; });
  };
  const auto integrates = [](const Drive& drive) { return drive.speed_gain && drive.integral_gain > 0; };
  return std::any_of(model.effects.begin(), model.effects.end(), remembers) ||
         std::any_of(model.rover.drives.begin(), model.rover.drives.end(), integrates);
}

double get_parameter(Model& model, const std::string& name) { return *find(model, name).place; }

void set_parameter(Model& model, const std::string& name, double value) {
  const Parameter parameter = find(model, name);
  require_within(value, parameter.lower, parameter.upper, "the parameter '" + name + "'");
  *parameter.place = value;
}

}  // namespace rille
