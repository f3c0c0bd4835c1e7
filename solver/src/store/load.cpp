#include "store/load.hpp"

#include <sqlite3.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>
#include <vector>

#include "model/track_width.hpp"
#include "store/contract.hpp"
#include "store/parts.hpp"

namespace rille {
namespace {

bool has_header(const std::string& path) {
  char header[16] = {};
  std::ifstream(path, std::ios::binary).read(header, sizeof header);
  return std::memcmp(header, "SQLite format 3", 16) == 0;
}

}  // namespace

Database open_database(const std::string& path) {
  if (!std::filesystem::is_regular_file(path))
    throw InputRefused(fmt::format("there is no file '{}'; build a model first: `rille cad build SHEET.toml -o {}`", path, path));
  if (!has_header(path)) throw InputRefused(fmt::format("'{}' is not an SQLite database", path));
  try {
    // Read first, so that a file that is refused keeps every byte.
    Database probe(path, SQLite::OPEN_READONLY);
    probe.setBusyTimeout(5000);
    const int application = probe.execAndGet("PRAGMA application_id").getInt();
    const int version = probe.execAndGet("PRAGMA user_version").getInt();
    if (application != contract::kApplicationId)
      throw InputRefused(fmt::format("'{}' is a database of another program (application_id {}, rille's is {})", path,
                                     application, contract::kApplicationId));
    if (version > contract::kSchemaVersion)
      throw InputRefused(fmt::format("'{}' has schema version {}, newer than this solver's {}; upgrade rille", path, version,
                                     contract::kSchemaVersion));
    if (version < contract::kSchemaVersion)
      throw InputRefused(fmt::format("'{}' has schema version {}, older than this solver's {}; run `rille db migrate {}`", path,
                                     version, contract::kSchemaVersion, path));
    const std::string health = probe.execAndGet("PRAGMA quick_check(1)").getString();
    if (health != "ok") throw InputRefused(fmt::format("'{}' is damaged ({}); restore it from a copy", path, health));
    Database database(path, SQLite::OPEN_READWRITE);
    database.setBusyTimeout(5000);
    database.exec("PRAGMA foreign_keys = ON");
    return database;
  } catch (const SQLite::Exception& error) {
    throw InputRefused(fmt::format("'{}' cannot be read ({}); it is locked, not writable, or damaged: then restore it from a copy", path, error.what()));
  }
}

Model load_model(Database& database, const std::optional<std::string>& scenario) try {
  Model model;
  RoverKeys keys;
  model.rover = load_rover(database, keys);
  model.rover.track_width = drawn_track_width(model.rover);
  const std::int64_t id = find_scenario(database, scenario);
  model.scenario = load_scenario(database, id, keys, model.rover);
  Statement terrain(database, "SELECT terrain_id FROM scenario WHERE id = ?");
  terrain.bind(1, id);
  terrain.executeStep();
  if (!terrain.getColumn(0).isNull())
    model.terrain = load_terrain(database, terrain.getColumn(0).getInt64(), model.scenario.gravity.norm(), model.rover);
  load_effects(database, model);
  return model;
} catch (const SQLite::Exception& error) {
  throw InputRefused(fmt::format("the model cannot be read ({}); run `rille db check`", error.what()));
}

Model load_vehicle(Database& database) try {
  Model model;
  RoverKeys keys;
  model.rover = load_rover(database, keys);
  model.rover.track_width = drawn_track_width(model.rover);
  load_effects(database, model);
  return model;
} catch (const SQLite::Exception& error) {
  throw InputRefused(fmt::format("the model cannot be read ({}); run `rille db check`", error.what()));
}

Terrain load_soil_table(Database& database, double gravity) try {
  Terrain terrain;
  load_soils(database, gravity, terrain);
  return terrain;
} catch (const SQLite::Exception& error) {
  throw InputRefused(fmt::format("the soils cannot be read ({}); run `rille db check`", error.what()));
}

namespace {

// FNV-1a over every value of the rows that a query returns, from a digest so far.
std::uint64_t digest_of(Statement& rows, std::uint64_t digest) {
  const auto add = [&](const void* data, std::size_t size) {
    for (std::size_t k = 0; k < size; ++k) digest = (digest ^ static_cast<const unsigned char*>(data)[k]) * 1099511628211ULL;
  };
  while (rows.executeStep())
    for (int c = 0; c < rows.getColumnCount(); ++c) {
      const Column column = rows.getColumn(c);
      const int type = column.getType();
      add(&type, sizeof type);
      if (type == SQLITE_INTEGER) {
        const std::int64_t value = column.getInt64();
        add(&value, sizeof value);
      } else if (type == SQLITE_FLOAT) {
        const double value = column.getDouble();
        add(&value, sizeof value);
      } else if (type != SQLITE_NULL) {
        const int size = column.getBytes();
        add(column.getBlob(), static_cast<std::size_t>(size));
      }
    }
  return digest;
}

constexpr std::uint64_t kNothing = 14695981039346656037ULL;

// What a run of a scenario depends on. where: condition, ?1 being the key of the scenario. The first three columns give the order.
struct Part {
  const char* table;
  std::string where;
  const char* columns = "*";
};
using Parts = std::vector<Part>;

// Of the tiles, those that the solver reads.
Parts world_of_scenario() {
  const std::string ground = "(SELECT terrain_id FROM scenario WHERE id = ?1)";
  const std::string soils = fmt::format("(SELECT soil_id FROM terrain WHERE id = {0} UNION SELECT soil_id FROM soil_patch WHERE terrain_id = {0})", ground);
  return {
      {"material", ""},
      {"soil", "WHERE id IN " + soils},
      // Without its key: pairs without a soil are written anew, as they were, with every ground.
      {"material_pair", "WHERE soil_id IS NULL OR soil_id IN " + soils, "material_id, other_material_id, soil_id, response, friction, restitution"},
      {"body", ""}, {"collision_shape", ""}, {"joint", ""}, {"joint_limit", ""}, {"drive", ""}, {"differential", ""}, {"gear", ""},
      {"loop_closure", ""}, {"wheel", ""}, {"grouser", ""}, {"sensor", ""}, {"effect", ""},
      {"terrain", "WHERE id = " + ground},
      {"terrain_tile", "WHERE layer = 'height' AND level = 0 AND terrain_id = " + ground},
      {"soil_patch", "WHERE terrain_id = " + ground},
      {"obstacle", "WHERE terrain_id = " + ground},
  };
}

std::string digest_of(Database& database, const Parts& parts, std::int64_t scenario) {
  std::uint64_t digest = kNothing;
  for (const auto& [table, where, columns] : parts) {
    Statement rows(database, fmt::format("SELECT {} FROM {} {} ORDER BY 1, 2, 3", columns, table, where));
    if (where.find('?') != std::string::npos) rows.bind(1, scenario);
    digest = digest_of(rows, digest);
  }
  return fmt::format("{:016x}", digest);
}

}  // namespace

std::string model_digest(Database& database, std::int64_t scenario) {
  Parts parts = world_of_scenario();
  parts.push_back({"scenario", "WHERE id = ?1"});
  for (const char* table : {"initial_state", "command", "state_change", "watch"}) parts.push_back({table, "WHERE scenario_id = ?1"});
  return digest_of(database, parts, scenario);
}

std::string world_digest(Database& database, std::int64_t scenario) { return digest_of(database, world_of_scenario(), scenario); }

}  // namespace rille
