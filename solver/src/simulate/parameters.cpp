#include "simulate/parameters.hpp"

#include <fmt/format.h>

#include "model/error.hpp"

namespace rille {

std::vector<std::pair<std::string, double*>> parameters(Model& model) {
  std::vector<std::pair<std::string, double*>> list;
  const auto add = [&](const std::string& name, double& value) { list.emplace_back(name, &value); };
  if (model.terrain)
    for (std::size_t k = 0; k < model.terrain->soils.size(); ++k) {
      Soil& soil = model.terrain->soils[k];
      const std::string name = "soil." + model.terrain->soil_names[k] + ".";
      add(name + "sinkage_exponent", soil.sinkage_exponent);
      add(name + "cohesive_modulus", soil.cohesive_modulus);
      add(name + "frictional_modulus", soil.frictional_modulus);
      add(name + "cohesion", soil.cohesion);
      add(name + "friction_angle", soil.friction_angle);
      add(name + "shear_modulus", soil.shear_modulus);
      add(name + "lateral_shear_modulus", soil.lateral_shear_modulus);
      add(name + "peak_angle_offset", soil.peak_angle_offset);
      add(name + "peak_angle_slip", soil.peak_angle_slip);
      add(name + "exit_sinkage_ratio", soil.exit_sinkage_ratio);
      add(name + "damping", soil.damping);
      add(name + "unit_weight", soil.unit_weight);
      if (soil.reece_cohesive_modulus) add(name + "reece_cohesive_modulus", *soil.reece_cohesive_modulus);
      if (soil.reece_frictional_modulus) add(name + "reece_frictional_modulus", *soil.reece_frictional_modulus);
    }
  for (Body& body : model.rover.bodies) {
    add("body." + body.name + ".mass", body.mass);
    add("body." + body.name + ".com_x", body.com.x());
    add("body." + body.name + ".com_y", body.com.y());
    add("body." + body.name + ".com_z", body.com.z());
    add("body." + body.name + ".ixx", body.inertia(0, 0));
    add("body." + body.name + ".iyy", body.inertia(1, 1));
    add("body." + body.name + ".izz", body.inertia(2, 2));
  }
  for (Wheel& wheel : model.rover.wheels) {
    add("wheel." + wheel.name + ".radius", wheel.radius);
    add("wheel." + wheel.name + ".width", wheel.width);
  }
  for (Drive& drive : model.rover.drives) {
    add("drive." + drive.name + ".max_torque", drive.max_torque);
    add("drive." + drive.name + ".position_gain", drive.position_gain);
    add("drive." + drive.name + ".integral_gain", drive.integral_gain);
    if (drive.speed_gain) add("drive." + drive.name + ".speed_gain", *drive.speed_gain);
  }
  for (EffectRow& effect : model.effects)
    for (auto& [name, value] : effect.parameters) add("effect." + effect.kind + "." + effect.target_name + "." + name, value);
  add("gravity.x", model.scenario.gravity.x());
  add("gravity.y", model.scenario.gravity.y());
  add("gravity.z", model.scenario.gravity.z());
  return list;
}

double& parameter(Model& model, const std::string& name) {
  for (const auto& [known, place] : parameters(model))
    if (known == name) return *place;
  throw InputRefused(fmt::format("the model has no parameter '{}'; Model.parameters() lists them", name));
}

}  // namespace rille
