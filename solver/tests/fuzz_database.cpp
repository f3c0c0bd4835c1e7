// Feeds mutated databases to the solver: every one must be refused in a sentence or be simulated; nothing may crash, hang or leak.
// Usage: rille-fuzz SEED.db SECONDS [RANDOM_SEED]     Built with the sanitizers (make sanitize).
#include <fmt/format.h>
#include <sqlite3.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "model/error.hpp"
#include "simulate/simulation.hpp"
#include "store/load.hpp"

namespace {

using Random = std::mt19937_64;

std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void write_file(const std::string& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }

std::vector<std::string> names(sqlite3* database, const std::string& sql) {
  std::vector<std::string> result;
  sqlite3_exec(database, sql.c_str(), [](void* list, int, char** values, char**) {
    if (values[0] != nullptr) static_cast<std::vector<std::string>*>(list)->emplace_back(values[0]);
    return 0;
  }, &result, nullptr);
  return result;
}

template <class List>
const auto& any_of(const List& list, Random& random) {
  return list[random() % list.size()];
}

// A value that a careless program or a damaged disk might leave.
std::string strange_value(Random& random) {
  static const std::vector<std::string> kValues = {
      "NULL", "0", "-1", "1", "2", "9e999", "-9e999", "1e308", "-1e308", "1e-308", "1e-9", "1e9", "-1e9", "9223372036854775807", "-9223372036854775808",
      "''", "'x'", "'*'", "'{}'", "'[[0,0]]'", "'null'", "x''", "x'00'", "zeroblob(23)", "zeroblob(96)", "0.5", "3.14159", "1e5"};
  return any_of(kValues, random);
}

void mutate_values(const std::string& path, Random& random) {
  sqlite3* database = nullptr;
  sqlite3_open(path.c_str(), &database);
  sqlite3_exec(database, "PRAGMA ignore_check_constraints = ON; PRAGMA foreign_keys = OFF; PRAGMA journal_mode = DELETE", nullptr, nullptr, nullptr);
  static const std::vector<std::string> kTables = {"body", "joint", "joint_limit", "drive", "gear", "loop_closure", "wheel", "sensor", "soil",
                                                   "material_pair", "collision_shape", "terrain", "terrain_tile", "soil_patch", "obstacle", "effect",
                                                   "effect_parameter", "scenario", "initial_state", "command", "watch"};
  const int changes = 1 + static_cast<int>(random() % 4);
  for (int k = 0; k < changes; ++k) {
    const std::string& table = any_of(kTables, random);
    const std::string where = fmt::format(" WHERE rowid = (SELECT rowid FROM {} ORDER BY rowid LIMIT 1 OFFSET {})", table, random() % 6);
    if (random() % 8 == 0) {
      sqlite3_exec(database, fmt::format("DELETE FROM {}{}", table, where).c_str(), nullptr, nullptr, nullptr);
      continue;
    }
    const auto columns = names(database, fmt::format("SELECT name FROM pragma_table_info('{}')", table));
    if (columns.empty()) continue;
    const std::string& column = any_of(columns, random);
    const std::string value = random() % 3 == 0 ? fmt::format("{} * {}", column, std::ldexp(1.0, static_cast<int>(random() % 41) - 20)) : strange_value(random);
    sqlite3_exec(database, fmt::format("UPDATE {} SET {} = {}{}", table, column, value, random() % 3 == 0 ? std::string() : where).c_str(), nullptr, nullptr,
                 nullptr);
  }
  sqlite3_close(database);
}

std::string mutate_bytes(std::string bytes, Random& random) {
  const int changes = 1 + static_cast<int>(random() % 24);
  for (int k = 0; k < changes; ++k) bytes[random() % bytes.size()] = static_cast<char>(random());
  if (random() % 8 == 0) bytes.resize(random() % bytes.size());
  return bytes;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    fmt::print(stderr, "usage: rille-fuzz SEED.db SECONDS [RANDOM_SEED]\n");
    return 2;
  }
  const std::string seed = read_file(argv[1]);
  const double seconds = std::atof(argv[2]);
  const auto random_seed = argc > 3 ? std::strtoull(argv[3], nullptr, 10) : std::random_device{}();
  Random random(random_seed);
  fmt::print("random seed {}: give it again as the third argument to repeat a finding\n", random_seed);
  std::fflush(stdout);
  const auto folder = std::filesystem::temp_directory_path() / fmt::format("rille-fuzz-{}", random());
  std::filesystem::create_directories(folder);
  const std::string path = (folder / "mutated.db").string();
  const auto start = std::chrono::steady_clock::now();
  long long refused = 0, simulated = 0, ended = 0;
  std::string state;  // of the unchanged model, for mutated checkpoints
  while (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() < seconds) {
    write_file(path, seed);
    if (random() % 4 == 0) {
      write_file(path, mutate_bytes(seed, random));
    } else {
      mutate_values(path, random);
    }
    try {
      SQLite::Database database = rille::open_database(path);
      rille::Model model = rille::load_model(database, std::nullopt);
      model.scenario.settle_time = std::min(model.scenario.settle_time, 20 * model.scenario.step);
      rille::Simulation simulation(std::move(model));
      simulation.settle();
      rille::Outcome outcome = simulation.outcome();
      for (int k = 0; k < 40 && outcome == rille::Outcome::running; ++k) outcome = simulation.step();
      static_cast<void>(simulation.snapshot());
      if (state.empty()) state = simulation.save();
      try {
        simulation.restore(mutate_bytes(state, random));
        simulation.step();
      } catch (const rille::InputRefused&) {
      }
      ++(outcome == rille::Outcome::running ? simulated : ended);
    } catch (const rille::InputRefused& error) {
      if (std::string(error.what()).size() < 10) std::abort();  // a sentence, not a grunt
      ++refused;
    } catch (const SQLite::Exception&) {
      ++refused;
    }
  }
  std::filesystem::remove_all(folder);
  fmt::print("{} mutated databases: {} refused, {} simulated, {} ended by an outcome; no crash\n", refused + simulated + ended, refused, simulated, ended);
  return simulated > 0 && refused > 0 ? 0 : 1;  // else the mutations are too tame or too wild to say anything
}
