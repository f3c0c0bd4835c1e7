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

}  // namespace rille
