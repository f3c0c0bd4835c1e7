// Physics beyond the base model, as read from the database: a law of the catalogue, what it acts on, its numbers.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "model/error.hpp"
#include "model/named.hpp"
#include "model/rover.hpp"

namespace rille {

enum class EffectTarget { wheel, joint, body, sensor, terrain, world };

struct Constant {
  double value = 0;
  std::string unit;  // SI unit of the constant: "N m s/rad"
};

// The catalogue, as far as a solver asks it: laws and their numbers (tables effect_kind, effect_parameter).
struct LawNumber {
  std::string name;
  std::string unit;
  bool amplitude = false;
  double lower = 0, upper = 0, typical = 0;
};
struct Law {
  std::string name;
  std::string target;   // word of table effect_kind
  bool memory = false;  // has a state that motion does not tell
  std::vector<LawNumber> numbers;
};
using Catalogue = std::vector<Law>;

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

// Says what the row acts on: target is a word of table effect_kind, or of `target_kind` where that is "any". Raises InputRefused for a target
// that the rover does not have or that the law cannot act on.
inline void aim(EffectRow& effect, const std::string& target, const Rover& rover) {
  static const std::map<std::string, EffectTarget> kTargets = {{"wheel", EffectTarget::wheel}, {"joint", EffectTarget::joint},
                                                               {"body", EffectTarget::body},   {"sensor", EffectTarget::sensor},
                                                               {"terrain", EffectTarget::terrain}, {"world", EffectTarget::world}};
  const auto known = kTargets.find(target);
  if (known == kTargets.end())
    throw InputRefused(fmt::format("the effect '{}' on '{}' needs target_kind 'wheel', 'joint' or 'body' among its parameters", effect.kind,
                                   effect.target_name));
  effect.target = known->second;
  effect.index = -1;
  if (effect.target_name == "*") return;
  const std::string whose = fmt::format("the effect '{}' acts on {}", effect.kind, target);
  switch (effect.target) {
    case EffectTarget::wheel: effect.index = find_named(rover.wheels, effect.target_name, whose); return;
    case EffectTarget::body: effect.index = find_named(rover.bodies, effect.target_name, whose); return;
    case EffectTarget::sensor: effect.index = find_named(rover.sensors, effect.target_name, whose); return;
    case EffectTarget::joint: {
      effect.index = find_named(rover.joints, effect.target_name, whose);
      if (!rover.joints[static_cast<std::size_t>(effect.index)].has_one_freedom())
        throw InputRefused(fmt::format("{} '{}', which neither turns on a hinge nor slides", whose, effect.target_name));
      return;
    }
    case EffectTarget::terrain:
    case EffectTarget::world: return;
  }
}

}  // namespace rille
