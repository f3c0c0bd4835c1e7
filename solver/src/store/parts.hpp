// The parts of a model, each read by a file of its own; load.hpp puts them together.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "model/model.hpp"
#include "store/read_row.hpp"

namespace rille {

// Keys of what scenarios and effects refer to.
struct RoverKeys {
  Index joints;
  Index drives;
};

Rover load_rover(Database& database, RoverKeys& keys);
Shape load_shape(Statement& row, const std::string& subject);  // columns that collision_shape and obstacle share
void require_one_freedom(const Rover& rover, int joint, const std::string& subject);

// gravity: [m/s^2] for the unit weight of the soils.
Terrain load_terrain(Database& database, std::int64_t id, double gravity, const Rover& rover);
Index load_soils(Database& database, double gravity, Terrain& terrain);

std::int64_t find_scenario(Database& database, const std::optional<std::string>& name);
Scenario load_scenario(Database& database, std::int64_t id, const RoverKeys& keys, const Rover& rover);

// The catalogue, and rows of table `effect`, completed by the catalogue; those without amplitude are left out. Needs the model's rover.
void load_effects(Database& database, Model& model);

}  // namespace rille
