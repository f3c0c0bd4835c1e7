// Everything that one run needs.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "model/effect.hpp"
#include "model/rover.hpp"
#include "model/scenario.hpp"
#include "model/terrain.hpp"

namespace rille {

struct Model {
  Rover rover;
  std::optional<Terrain> terrain;
  Scenario scenario;
  std::vector<EffectRow> effects;  // those with amplitude only
  std::shared_ptr<const Catalogue> catalogue;  // of the database that it was read from
};

}  // namespace rille
