// Reads a model from a database of rille.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <optional>
#include <string>

#include "model/model.hpp"

namespace rille {

// Opens a database for reading and writing results. Raises InputRefused with one sentence for a missing file, a file that is
// no database, a database of another program, and a schema version that is not this program's. Never changes what it refuses.
SQLite::Database open_database(const std::string& path);

// Reads rover, terrain and the named scenario (absent: the only one). Raises InputRefused for values that cannot be simulated.
Model load_model(SQLite::Database& database, const std::optional<std::string>& scenario);

// Rover and effects alone, and the soils alone (no heights): what a bench needs. gravity: [m/s^2] for the soils' unit weight.
Model load_vehicle(SQLite::Database& database);
Terrain load_soil_table(SQLite::Database& database, double gravity);

// Digest of everything that a run of a scenario depends on, so that a checkpoint is not resumed with another model.
std::string model_digest(SQLite::Database& database, std::int64_t scenario);

// Digest of rover, effects and the ground of a scenario, so that a state is not loaded into another world. Other grounds and what
// scenarios ask leave it as it is.
std::string world_digest(SQLite::Database& database, std::int64_t scenario);

}  // namespace rille
