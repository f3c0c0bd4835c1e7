// Everything that one run needs.
#pragma once

#include <optional>

#include "model/rover.hpp"
#include "model/scenario.hpp"
#include "model/terrain.hpp"

namespace rille {

struct Model {
  Rover rover;
  std::optional<Terrain> terrain;
  Scenario scenario;
};

}  // namespace rille
