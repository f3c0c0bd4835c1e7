#include "store/parts.hpp"

#include <cstring>
#include <memory>
#include <vector>

#include "model/soil_range.hpp"

namespace rille {
namespace {

HeightGrid load_grid(Database& database, Statement& terrain, const std::string& subject) {
  HeightGrid grid;
  grid.n_rows = terrain.getColumn("n_rows").getInt();
  grid.n_cols = terrain.getColumn("n_cols").getInt();
  grid.posting_x = finite(terrain, "posting_x", subject);
  grid.posting_y = finite(terrain, "posting_y", subject);
  grid.x_west = finite(terrain, "x_west", subject);
  grid.y_north = finite(terrain, "y_north", subject);
  if (grid.n_rows < 2 || grid.n_cols < 2 || !(grid.posting_x > 0 && grid.posting_y > 0))
    throw InputRefused(fmt::format("{} has {} x {} heights at {:g} x {:g} m; it needs at least 2 x 2 and a posting above 0", subject, grid.n_rows,
                                   grid.n_cols, grid.posting_x, grid.posting_y));
  const auto cells = static_cast<std::size_t>(grid.n_rows) * static_cast<std::size_t>(grid.n_cols);
  if (cells > 400'000'000)
    throw InputRefused(fmt::format("{} has {} x {} heights, more than the 400 million that are read at once; extract a region",
                                   subject, grid.n_rows, grid.n_cols));
  Statement covered(database, "SELECT total(n_rows * n_cols) FROM terrain_tile WHERE terrain_id = ? AND layer = 'height' AND level = 0");
  covered.bind(1, terrain.getColumn("id").getInt64());
  covered.executeStep();
  if (covered.getColumn(0).getDouble() < 0.01 * static_cast<double>(cells))  // before memory is asked for
    throw InputRefused(fmt::format("{} has no heights for at least 99 % of its grid of {} x {}; build it with `rille terrain build`", subject,
                                   grid.n_rows, grid.n_cols));
  grid.heights.assign(cells, std::nan(""));
  Statement tile(database,
                 "SELECT row0, col0, n_rows, n_cols, dtype, data FROM terrain_tile WHERE terrain_id = ? AND layer = 'height' AND level = 0");
  tile.bind(1, terrain.getColumn("id").getInt64());
  while (tile.executeStep()) {
    const int row0 = tile.getColumn("row0").getInt();
    const int col0 = tile.getColumn("col0").getInt();
    const int n_rows = tile.getColumn("n_rows").getInt();
    const int n_cols = tile.getColumn("n_cols").getInt();
    const std::string dtype = tile.getColumn("dtype").getString();
    const bool single = dtype == "float32";
    if (!single && dtype != "float64")
      throw InputRefused(fmt::format("a tile of {} at row {}, column {} holds heights as '{}'; they must be float32 or float64", subject, row0, col0, dtype));
    const Column data = tile.getColumn("data");
    const auto expected = static_cast<std::int64_t>(n_rows) * n_cols * (single ? 4 : 8);
    if (row0 < 0 || col0 < 0 || n_rows < 1 || n_cols < 1 || row0 > grid.n_rows - n_rows || col0 > grid.n_cols - n_cols ||
        data.getBytes() != expected)
      throw InputRefused(fmt::format("a tile of {} at row {}, column {} ({} x {}, {} bytes) does not fit its grid of {} x {}; "
                                     "build the terrain again",
                                     subject, row0, col0, n_rows, n_cols, data.getBytes(), grid.n_rows, grid.n_cols));
    const auto* bytes = static_cast<const char*>(data.getBlob());
    for (int i = 0; i < n_rows; ++i) {
      double* out = grid.heights.data() + static_cast<std::size_t>(row0 + i) * grid.n_cols + col0;
      for (int j = 0; j < n_cols; ++j) {
        const auto k = static_cast<std::size_t>(i) * n_cols + j;
        if (single) {
          float value;
          std::memcpy(&value, bytes + 4 * k, 4);
          out[j] = value;
        } else {
          std::memcpy(&out[j], bytes + 8 * k, 8);
        }
      }
    }
  }
  grid.find_highest();
  return grid;
}

struct Response {
  WheelSoilLaw law = WheelSoilLaw::bekker_wong;
  RigidPair rigid;  // where the law is `rigid`
};

RigidPair rigid_pair(Statement& row, const std::string& subject) {
  return {within(row, "friction", 0, 10, subject), row.getColumn("restitution").isNull() ? 0 : within(row, "restitution", 0, 1, subject)};
}

// Law of a wheel on a soil: the pair of its own material, else the pair of any material.
Response response_of(Database& database, const Wheel& wheel, std::int64_t soil_id, const std::string& soil) {
  Statement row(database,
                "SELECT response, friction, restitution FROM material_pair WHERE soil_id = ?1 AND (material_id IS NULL OR material_id = ?2) "
                "ORDER BY material_id IS NULL LIMIT 1");
  row.bind(1, soil_id);
  if (wheel.material_id) row.bind(2, *wheel.material_id);
  if (!row.executeStep())
    throw InputRefused(fmt::format("no material_pair says how wheel '{}' responds to soil '{}'; add a row with this soil, "
                                   "material NULL and response 'bekker_wong'",
                                   wheel.name, soil));
  const std::string subject = fmt::format("the pair wheel '{}' - soil '{}'", wheel.name, soil);
  Response response;
  response.law = word_of<WheelSoilLaw>(row, "response", wheel_soil_laws(), subject);
  if (response.law == WheelSoilLaw::rigid) response.rigid = rigid_pair(row, subject);
  return response;
}

// Rigid pair of two surfaces: both materials named, else one, else the pair of any with any, else friction 0.5 without rebound.
RigidPair rigid_pair_of(Database& database, const std::optional<std::int64_t>& a, const std::optional<std::int64_t>& b) {
  Statement row(database,
                "SELECT friction, restitution, (material_id IS NOT NULL) + (other_material_id IS NOT NULL) AS named FROM material_pair "
                "WHERE response = 'rigid' AND soil_id IS NULL AND "
                "((material_id IS NULL OR material_id = ?1) AND (other_material_id IS NULL OR other_material_id = ?2) OR "
                " (material_id IS NULL OR material_id = ?2) AND (other_material_id IS NULL OR other_material_id = ?1)) "
                "ORDER BY named DESC, id LIMIT 1");
  if (a) row.bind(1, *a);
  if (b) row.bind(2, *b);
  if (!row.executeStep()) return {};
  return rigid_pair(row, "a rigid material_pair");
}

RigidPair ground_pair_of(Database& database, const std::optional<std::int64_t>& material, std::int64_t soil_id) {
  Statement row(database,
                "SELECT friction, restitution FROM material_pair WHERE response = 'rigid' AND soil_id = ?1 AND "
                "(material_id IS NULL OR material_id = ?2) ORDER BY material_id IS NULL LIMIT 1");
  row.bind(1, soil_id);
  if (material) row.bind(2, *material);
  if (row.executeStep()) return rigid_pair(row, "a rigid pair with a soil");
  return rigid_pair_of(database, material, std::nullopt);
}

void load_obstacles(Database& database, std::int64_t terrain_id, const Rover& rover, Terrain& terrain) {
  Statement row(database, "SELECT * FROM obstacle WHERE terrain_id = ? ORDER BY id");
  row.bind(1, terrain_id);
  while (row.executeStep()) {
    Obstacle obstacle;
    obstacle.name = row.getColumn("name").getString();
    obstacle.shape = load_shape(row, "obstacle '" + obstacle.name + "'");
    terrain.obstacles.push_back(std::move(obstacle));
  }
  const auto add = [&](const std::optional<std::int64_t>& material) {
    std::map<std::int64_t, RigidPair> known;  // many rocks are of few materials
    std::vector<RigidPair>& pairs = terrain.rigid.emplace_back();
    for (const Obstacle& obstacle : terrain.obstacles) {
      const auto [slot, fresh] = known.try_emplace(obstacle.shape.material_id.value_or(-1));
      if (fresh) slot->second = rigid_pair_of(database, material, obstacle.shape.material_id);
      pairs.push_back(slot->second);
    }
  };
  for (const Wheel& wheel : rover.wheels) add(wheel.material_id);
  for (const BodyShape& carried : rover.shapes) add(carried.shape.material_id);
}

}  // namespace

Index load_soils(Database& database, double gravity, Terrain& terrain) {
  Index index;
  Statement row(database, "SELECT * FROM soil ORDER BY id");
  while (row.executeStep()) {
    Soil soil;
    const std::string name = row.getColumn("name").getString();
    const std::string subject = "soil '" + name + "'";
    for (const SoilNumber& number : kSoilNumbers) soil.*number.value = finite(row, number.name, subject);
    soil.unit_weight = above_zero(row, "density", subject) * gravity;
    if (!row.getColumn("reece_cohesive_modulus").isNull())
      soil.reece_cohesive_modulus = finite(row, "reece_cohesive_modulus", subject);
    if (!row.getColumn("reece_frictional_modulus").isNull())
      soil.reece_frictional_modulus = finite(row, "reece_frictional_modulus", subject);
    require_valid(soil, subject);
    index[row.getColumn("id").getInt64()] = static_cast<int>(terrain.soils.size());
    terrain.soils.push_back(soil);
    terrain.soil_names.push_back(name);
  }
  return index;
}

Terrain load_terrain(Database& database, std::int64_t id, double gravity, const Rover& rover) {
  Statement row(database, "SELECT * FROM terrain WHERE id = ?");
  row.bind(1, id);
  if (!row.executeStep()) throw InputRefused(fmt::format("the scenario's terrain {} does not exist; run `rille db check`", id));
  Terrain terrain;
  terrain.name = row.getColumn("name").getString();
  const std::string subject = "terrain '" + terrain.name + "'";
  terrain.grid = std::make_shared<const HeightGrid>(load_grid(database, row, subject));
  const Index soils = load_soils(database, gravity, terrain);
  terrain.base_soil = index_of(soils, row.getColumn("soil_id"), "soil", subject);

  Statement patch(database, "SELECT id, soil_id, name FROM soil_patch WHERE terrain_id = ? ORDER BY id");
  patch.bind(1, id);
  std::vector<bool> used(terrain.soils.size(), false);
  used[static_cast<std::size_t>(terrain.base_soil)] = true;
  while (patch.executeStep()) {
    const std::string name = "soil patch '" + patch.getColumn("name").getString() + "'";
    SoilPatch region;
    region.soil = index_of(soils, patch.getColumn("soil_id"), "soil", name);
    used[static_cast<std::size_t>(region.soil)] = true;
    Statement corner(database,
                     "SELECT json_extract(value, '$[0]') AS x, json_extract(value, '$[1]') AS y FROM soil_patch, "
                     "json_each(polygon) WHERE soil_patch.id = ? ORDER BY json_each.key");
    corner.bind(1, patch.getColumn("id").getInt64());
    while (corner.executeStep()) region.polygon.emplace_back(finite(corner, "x", name), finite(corner, "y", name));
    if (region.polygon.size() < 3)
      throw InputRefused(fmt::format("{} has {} corners; a polygon needs at least 3", name, region.polygon.size()));
    terrain.patches.push_back(region);
  }
  for (const Wheel& wheel : rover.wheels) {
    std::vector<WheelSoilLaw> laws(terrain.soils.size(), WheelSoilLaw::bekker_wong);
    std::vector<RigidPair> pairs(terrain.soils.size());
    for (const auto& [soil_id, soil] : soils) {
      const auto k = static_cast<std::size_t>(soil);
      if (!used[k]) continue;
      const Response response = response_of(database, wheel, soil_id, terrain.soil_names[k]);
      laws[k] = response.law;
      if (response.law != WheelSoilLaw::rigid)
        require_carries(terrain.soils[k], response.law, wheel.width, "soil '" + terrain.soil_names[k] + "'", "wheel '" + wheel.name + "'");
      pairs[k] = response.rigid;
    }
    terrain.response.push_back(std::move(laws));
    terrain.rigid_ground.push_back(std::move(pairs));
  }
  for (const BodyShape& carried : rover.shapes) {
    std::vector<RigidPair> pairs(terrain.soils.size());
    for (const auto& [soil_id, soil] : soils)
      if (used[static_cast<std::size_t>(soil)])
        pairs[static_cast<std::size_t>(soil)] = ground_pair_of(database, carried.shape.material_id, soil_id);
    terrain.rigid_ground.push_back(std::move(pairs));
  }
  load_obstacles(database, id, rover, terrain);
  return terrain;
}

}  // namespace rille
