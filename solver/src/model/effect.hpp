// Physics beyond the base model, as read from the database: a law of the catalogue, what it acts on, its numbers.
#pragma once

#include <map>
#include <string>

#include "model/error.hpp"

namespace rille {

enum class EffectTarget { wheel, joint, body, sensor, terrain, world };

struct Constant {
  double value = 0;
  std::string unit;  // SI unit of the constant: "N m s/rad"
};

struct EffectRow {
  std::string kind;                          // name in the catalogue
  EffectTarget target = EffectTarget::wheel;
  std::string target_name;                   // for sentences
  int index = -1;                            // of the wheel, joint, body or sensor; -1 = every one
  std::map<std::string, double> parameters;  // every parameter of the catalogue, SI
  // expression only
  std::string formula;
  std::string output;                        // quantity that the formula adds to: "joint.effort"
  std::map<std::string, Constant> constants;

  double parameter(const std::string& name) const {
    const auto found = parameters.find(name);
    if (found == parameters.end())
      throw InputRefused("the catalogue of this database has no parameter '" + name + "' of the effect '" + kind + "'; run `rille db migrate`");
    return found->second;
  }
};

}  // namespace rille
