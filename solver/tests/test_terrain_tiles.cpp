// The heights that wheels stand on come from the tiles of the finest level alone, and tiles that do not fit are refused.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>

#include "store/load.hpp"
#include "store/parts.hpp"

using namespace rille;

namespace {

template <class Value>
void put_tile(Database& database, const char* layer, int level, int row0, int col0, int n_rows, int n_cols, const char* dtype,
              const std::vector<Value>& values) {
  Statement tile(database, "INSERT INTO terrain_tile VALUES (1, ?, ?, ?, ?, ?, ?, ?, ?)");
  tile.bind(1, layer);
  tile.bind(2, level);
  tile.bind(3, row0);
  tile.bind(4, col0);
  tile.bind(5, n_rows);
  tile.bind(6, n_cols);
  tile.bind(7, dtype);
  tile.bind(8, values.data(), static_cast<int>(values.size() * sizeof(Value)));
  tile.exec();
}

// Ground of 3 x 5 values, z = 10 row + column, in two tiles of which the second is in single precision.
Database ground() {
  Database database(":memory:", SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  std::ifstream file(RILLE_SCHEMA_FILE);
  REQUIRE(file.good());
  database.exec(std::string(std::istreambuf_iterator<char>(file), {}));
  database.exec("INSERT INTO soil (id, name, sinkage_exponent, cohesive_modulus, frictional_modulus, cohesion, friction_angle, shear_modulus, "
                "lateral_shear_modulus, peak_angle_offset, peak_angle_slip, exit_sinkage_ratio, density, damping, provenance) "
                "VALUES (1, 's', 1, 1400, 820000, 170, 0.6, 0.018, 0.018, 0.4, 0.15, 0, 1500, 30000, 'stated')");
  database.exec("INSERT INTO terrain (id, name, soil_id, n_rows, n_cols, posting_x, posting_y, x_west, y_north) "
                "VALUES (1, 't', 1, 3, 5, 0.5, 0.25, -1, 2)");
  put_tile<double>(database, "height", 0, 0, 0, 3, 3, "float64", {0, 1, 2, 10, 11, 12, 20, 21, 22});
  put_tile<float>(database, "height", 0, 0, 3, 3, 2, "float32", {3, 4, 13, 14, 23, 24});
  return database;
}

std::string refusal(Database& database) {
  try {
    load_terrain(database, 1, 9.81, Rover());
  } catch (const InputRefused& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("only heights of level 0 become ground") {
  Database database = ground();
  put_tile<double>(database, "height", 1, 0, 0, 2, 3, "float64", {900, 901, 902, 903, 904, 905});  // coarser: wrong on purpose
  put_tile<std::uint8_t>(database, "soil", 0, 0, 0, 3, 5, "uint8", std::vector<std::uint8_t>(15, 1));
  put_tile<std::uint8_t>(database, "filled", 0, 0, 0, 3, 5, "uint8", std::vector<std::uint8_t>(15, 1));
  const Terrain terrain = load_terrain(database, 1, 9.81, Rover());
  REQUIRE(terrain.grid->heights.size() == 15);
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 5; ++column) CHECK(terrain.grid->heights[static_cast<std::size_t>(row * 5 + column)] == 10 * row + column);
}

TEST_CASE("coarser levels and other layers do not stand in for missing heights") {
  Database database = ground();
  database.exec("DELETE FROM terrain_tile");
  put_tile<double>(database, "height", 1, 0, 0, 2, 3, "float64", {0, 0, 0, 0, 0, 0});
  put_tile<std::uint8_t>(database, "soil", 0, 0, 0, 3, 5, "uint8", std::vector<std::uint8_t>(15, 1));
  CHECK(refusal(database).find("no heights") != std::string::npos);
}

TEST_CASE("tiles that do not fit are refused") {
  Database database = ground();
  database.exec("PRAGMA ignore_check_constraints = ON");
  SUBCASE("outside the grid") {
    database.exec("UPDATE terrain_tile SET row0 = 1 WHERE col0 = 0");
    CHECK(refusal(database).find("does not fit") != std::string::npos);
  }
  SUBCASE("fewer bytes than values") {
    database.exec("UPDATE terrain_tile SET data = x'0000' WHERE col0 = 3");
    CHECK(refusal(database).find("does not fit") != std::string::npos);
  }
  SUBCASE("heights that are no numbers with a fraction") {
    database.exec("UPDATE terrain_tile SET dtype = 'int32' WHERE col0 = 3");
    CHECK(refusal(database).find("float32 or float64") != std::string::npos);
  }
}

TEST_CASE("a checkpoint belongs to the heights of its scenario, not to what is derived from them or to what others have") {
  Database database = ground();
  database.exec("INSERT INTO scenario (id, name, terrain_id, gravity_z, duration, step, output_interval, placement) "
                "VALUES (1, 's', 1, -9.81, 1, 0.001, 0.01, 'on_terrain')");
  const std::string before = model_digest(database, 1);
  put_tile<double>(database, "height", 1, 0, 0, 2, 3, "float64", {0, 2, 4, 20, 22, 24});
  CHECK(model_digest(database, 1) == before);
  database.exec("INSERT INTO terrain (id, name, soil_id, n_rows, n_cols, posting_x, posting_y, x_west, y_north) "
                "VALUES (2, 'other', 1, 3, 5, 0.5, 0.25, -1, 2)");
  database.exec("INSERT INTO scenario (id, name, terrain_id, gravity_z, duration, step, output_interval, placement) "
                "VALUES (2, 'other', 2, -9.81, 1, 0.001, 0.01, 'on_terrain')");
  CHECK(model_digest(database, 1) == before);
  database.exec("UPDATE terrain_tile SET data = zeroblob(length(data)) WHERE level = 0 AND col0 = 3");
  CHECK(model_digest(database, 1) != before);
}
