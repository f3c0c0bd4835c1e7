#include "store/load.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <Eigen/Eigenvalues>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>

#include "model/error.hpp"
#include "store/contract.hpp"

namespace rille {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using SQLite::Column;
using SQLite::Database;
using SQLite::Statement;
using Index = std::map<std::int64_t, int>;  // key in the database -> index in the model

// SQLite keeps infinities; nothing in a model may be one.
double finite(Statement& row, const char* column, const std::string& subject) {
  const double value = row.getColumn(column).getDouble();
  if (!std::isfinite(value))
    throw InputRefused(fmt::format("{} of {} is {}; give a finite value", column, subject, value));
  return value;
}

Vector3d vector(Statement& row, const char* x, const char* y, const char* z, const std::string& subject) {
  return {finite(row, x, subject), finite(row, y, subject), finite(row, z, subject)};
}

int index_of(const Index& index, const Column& key, const char* what, const std::string& subject) {
  const auto found = index.find(key.getInt64());
  if (found == index.end())
    throw InputRefused(fmt::format("{} refers to {} {}, which does not exist; run `rille db check`", subject, what, key.getInt64()));
  return found->second;
}

template <class Word>
Word word_of(Statement& row, const char* column, const std::map<std::string, Word>& words, const std::string& subject) {
  const std::string text = row.getColumn(column).getString();
  const auto found = words.find(text);
  if (found == words.end())
    throw InputRefused(fmt::format("{} of {} is '{}', which this solver does not know", column, subject, text));
  return found->second;
}

void require_empty(Database& database, const char* table, const char* meaning) {
  Statement count(database, fmt::format("SELECT count(*) FROM {}", table));
  count.executeStep();
  if (count.getColumn(0).getInt() > 0)
    throw InputRefused(fmt::format("the model has {} rows in table '{}' ({}), which this solver does not simulate yet; "
                                   "remove them rather than have them ignored",
                                   count.getColumn(0).getInt(), table, meaning));
}

Index load_bodies(Database& database, Rover& rover) {
  Index index;
  Statement row(database, "SELECT * FROM body ORDER BY id");
  while (row.executeStep()) {
    Body body;
    body.id = row.getColumn("id").getInt64();
    body.name = row.getColumn("name").getString();
    const std::string subject = "body '" + body.name + "'";
    body.frame = vector(row, "frame_x", "frame_y", "frame_z", subject);
    body.mass = finite(row, "mass", subject);
    body.com = vector(row, "com_x", "com_y", "com_z", subject);
    const double ixy = finite(row, "ixy", subject);
    const double ixz = finite(row, "ixz", subject);
    const double iyz = finite(row, "iyz", subject);
    body.inertia << finite(row, "ixx", subject), ixy, ixz, ixy, finite(row, "iyy", subject), iyz, ixz, iyz,
        finite(row, "izz", subject);
    if (!(body.mass > 0)) throw InputRefused(fmt::format("mass of {} is {:g} kg; it must be above 0", subject, body.mass));
    const Vector3d moments = body.inertia.selfadjointView<Eigen::Lower>().eigenvalues();
    if (!(moments[0] > 0))
      throw InputRefused(fmt::format("inertia of {} has the principal moment {:g} kg m^2; all must be above 0", subject, moments[0]));
    if (moments[2] > (moments[0] + moments[1]) * (1 + 1e-6))
      throw InputRefused(fmt::format("inertia of {} breaks the triangle inequality: {:g} > {:g} + {:g} kg m^2; no body has such "
                                     "moments, correct the inertia",
                                     subject, moments[2], moments[0], moments[1]));
    index[body.id] = static_cast<int>(rover.bodies.size());
    rover.bodies.push_back(body);
  }
  return index;
}

Index load_joints(Database& database, const Index& bodies, Rover& rover) {
  Index index;
  Statement row(database,
                "SELECT joint.*, lower, upper FROM joint LEFT JOIN joint_limit ON joint_limit.joint_id = joint.id ORDER BY id");
  while (row.executeStep()) {
    Joint joint;
    joint.id = row.getColumn("id").getInt64();
    joint.name = row.getColumn("name").getString();
    const std::string subject = "joint '" + joint.name + "'";
    joint.kind = word_of<JointKind>(row, "kind",
                                    {{"hinge", JointKind::hinge},
                                     {"prismatic", JointKind::prismatic},
                                     {"fixed", JointKind::fixed},
                                     {"spherical", JointKind::spherical}},
                                    subject);
    if (!row.getColumn("parent_body_id").isNull())
      joint.parent = index_of(bodies, row.getColumn("parent_body_id"), "body", subject);
    joint.child = index_of(bodies, row.getColumn("child_body_id"), "body", subject);
    joint.point = vector(row, "x", "y", "z", subject);
    joint.axis = vector(row, "axis_x", "axis_y", "axis_z", subject).normalized();
    if (!row.getColumn("lower").isNull()) {
      if (joint.kind != JointKind::hinge && joint.kind != JointKind::prismatic)
        throw InputRefused(fmt::format("{} has a limit, but only hinges and prismatic joints can; remove the limit", subject));
      joint.limit = Limit{finite(row, "lower", subject), finite(row, "upper", subject)};
    }
    index[joint.id] = static_cast<int>(rover.joints.size());
    rover.joints.push_back(joint);
  }
  return index;
}

void require_one_freedom(const Rover& rover, int joint, const std::string& subject) {
  const Joint& carried = rover.joints[joint];
  if (carried.kind != JointKind::hinge && carried.kind != JointKind::prismatic)
    throw InputRefused(fmt::format("{} acts on joint '{}', which is neither a hinge nor prismatic", subject, carried.name));
}

Index load_drives(Database& database, const Index& joints, Rover& rover) {
  Index index;
  Statement row(database, "SELECT * FROM drive ORDER BY id");
  while (row.executeStep()) {
    Drive drive;
    drive.id = row.getColumn("id").getInt64();
    drive.name = row.getColumn("name").getString();
    const std::string subject = "drive '" + drive.name + "'";
    drive.joint = index_of(joints, row.getColumn("joint_id"), "joint", subject);
    drive.mode = word_of<DriveMode>(
        row, "mode",
        {{"speed", DriveMode::speed}, {"torque", DriveMode::torque}, {"position", DriveMode::position}}, subject);
    drive.max_torque = finite(row, "max_torque", subject);
    if (!row.getColumn("max_speed").isNull()) drive.max_speed = finite(row, "max_speed", subject);
    drive.position_gain = finite(row, "position_gain", subject);
    require_one_freedom(rover, drive.joint, subject);
    index[drive.id] = static_cast<int>(rover.drives.size());
    rover.drives.push_back(drive);
  }
  return index;
}

void load_couplings(Database& database, const Index& bodies, const Index& joints, Rover& rover) {
  Statement row(database, "SELECT * FROM differential ORDER BY id");
  while (row.executeStep()) {
    Differential differential;
    differential.name = row.getColumn("name").getString();
    const std::string subject = "differential '" + differential.name + "'";
    differential.carrier = index_of(bodies, row.getColumn("carrier_body_id"), "body", subject);
    differential.joint_a = index_of(joints, row.getColumn("joint_a_id"), "joint", subject);
    differential.joint_b = index_of(joints, row.getColumn("joint_b_id"), "joint", subject);
    rover.differentials.push_back(differential);
  }
  Statement pair(database, "SELECT * FROM gear ORDER BY id");
  while (pair.executeStep()) {
    Gear gear;
    gear.name = pair.getColumn("name").getString();
    const std::string subject = "gear '" + gear.name + "'";
    gear.joint_a = index_of(joints, pair.getColumn("joint_a_id"), "joint", subject);
    gear.joint_b = index_of(joints, pair.getColumn("joint_b_id"), "joint", subject);
    gear.ratio = finite(pair, "ratio", subject);
    require_one_freedom(rover, gear.joint_a, subject);
    require_one_freedom(rover, gear.joint_b, subject);
    rover.gears.push_back(gear);
  }
}

void load_wheels(Database& database, const Index& joints, Rover& rover) {
  Statement row(database, "SELECT * FROM wheel ORDER BY id");
  while (row.executeStep()) {
    Wheel wheel;
    wheel.id = row.getColumn("id").getInt64();
    wheel.name = row.getColumn("name").getString();
    const std::string subject = "wheel '" + wheel.name + "'";
    wheel.joint = index_of(joints, row.getColumn("joint_id"), "joint", subject);
    if (rover.joints[wheel.joint].kind != JointKind::hinge)
      throw InputRefused(fmt::format("{} turns on joint '{}', which is not a hinge", subject, rover.joints[wheel.joint].name));
    if (!row.getColumn("material_id").isNull()) wheel.material_id = row.getColumn("material_id").getInt64();
    wheel.center = vector(row, "x", "y", "z", subject);
    wheel.radius = finite(row, "radius", subject);
    wheel.width = finite(row, "width", subject);
    rover.wheels.push_back(wheel);
  }
}

// Corners of the shapes of bodies that are no wheels; round shapes by the box around them.
void load_outlines(Database& database, const Index& bodies, Rover& rover) {
  Statement row(database,
                "SELECT * FROM collision_shape WHERE body_id NOT IN "
                "(SELECT child_body_id FROM wheel JOIN joint ON joint.id = wheel.joint_id) ORDER BY id");
  while (row.executeStep()) {
    Outline outline;
    const std::string subject = "a collision shape";
    outline.body = index_of(bodies, row.getColumn("body_id"), "body", subject);
    const Vector3d center = vector(row, "x", "y", "z", subject);
    const Eigen::Quaterniond rotation(finite(row, "qw", subject), finite(row, "qx", subject), finite(row, "qy", subject),
                                      finite(row, "qz", subject));
    const std::string kind = row.getColumn("kind").getString();
    if (kind == "hull") {
      const Column data = row.getColumn("vertices");
      const int count = data.getBytes() / 24;
      for (int k = 0; k < count; ++k) {
        Vector3d vertex;
        std::memcpy(vertex.data(), static_cast<const char*>(data.getBlob()) + 24 * k, 24);
        if (vertex.allFinite()) outline.corners.push_back(center + rotation * vertex);
      }
    } else {
      const double x = finite(row, "size_x", subject);
      const double y = kind == "box" ? finite(row, "size_y", subject) : 2 * x;
      const double z = kind == "sphere" ? 2 * x : finite(row, "size_z", subject);
      const Vector3d half = 0.5 * Vector3d(kind == "box" ? x : 2 * x, y, z);
      for (int k = 0; k < 8; ++k)
        outline.corners.push_back(center + rotation * half.cwiseProduct(Vector3d(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1)));
    }
    rover.outlines.push_back(std::move(outline));
  }
}

Rover load_rover(Database& database, Index& drives, Index& joints) {
  Rover rover;
  const Index bodies = load_bodies(database, rover);
  joints = load_joints(database, bodies, rover);
  drives = load_drives(database, joints, rover);
  load_couplings(database, bodies, joints, rover);
  load_wheels(database, joints, rover);
  load_outlines(database, bodies, rover);
  return rover;
}

HeightGrid load_grid(Database& database, Statement& terrain, const std::string& subject) {
  HeightGrid grid;
  grid.n_rows = terrain.getColumn("n_rows").getInt();
  grid.n_cols = terrain.getColumn("n_cols").getInt();
  grid.posting_x = finite(terrain, "posting_x", subject);
  grid.posting_y = finite(terrain, "posting_y", subject);
  grid.x_west = finite(terrain, "x_west", subject);
  grid.y_north = finite(terrain, "y_north", subject);
  const auto cells = static_cast<std::size_t>(grid.n_rows) * static_cast<std::size_t>(grid.n_cols);
  if (cells > 400'000'000)
    throw InputRefused(fmt::format("{} has {} x {} heights, more than the 400 million that are read at once; extract a region",
                                   subject, grid.n_rows, grid.n_cols));
  grid.heights.assign(cells, std::nan(""));
  Statement tile(database,
                 "SELECT row0, col0, n_rows, n_cols, dtype, data FROM terrain_tile WHERE terrain_id = ? AND layer = 'height'");
  tile.bind(1, terrain.getColumn("id").getInt64());
  bool any = false;
  while (tile.executeStep()) {
    any = true;
    const int row0 = tile.getColumn("row0").getInt();
    const int col0 = tile.getColumn("col0").getInt();
    const int n_rows = tile.getColumn("n_rows").getInt();
    const int n_cols = tile.getColumn("n_cols").getInt();
    const bool single = tile.getColumn("dtype").getString() == "float32";
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
  if (!any) throw InputRefused(fmt::format("{} has no heights; build it with `rille terrain build`", subject));
  return grid;
}

Index load_soils(Database& database, double gravity, std::vector<Soil>& soils) {
  Index index;
  Statement row(database, "SELECT * FROM soil ORDER BY id");
  while (row.executeStep()) {
    Soil soil;
    soil.name = row.getColumn("name").getString();
    const std::string subject = "soil '" + soil.name + "'";
    soil.sinkage_exponent = finite(row, "sinkage_exponent", subject);
    soil.cohesive_modulus = finite(row, "cohesive_modulus", subject);
    soil.frictional_modulus = finite(row, "frictional_modulus", subject);
    soil.cohesion = finite(row, "cohesion", subject);
    soil.friction_angle = finite(row, "friction_angle", subject);
    soil.shear_modulus = finite(row, "shear_modulus", subject);
    soil.lateral_shear_modulus = finite(row, "lateral_shear_modulus", subject);
    soil.peak_angle_offset = finite(row, "peak_angle_offset", subject);
    soil.peak_angle_slip = finite(row, "peak_angle_slip", subject);
    soil.exit_sinkage_ratio = finite(row, "exit_sinkage_ratio", subject);
    soil.damping = finite(row, "damping", subject);
    soil.unit_weight = finite(row, "density", subject) * gravity;
    if (!row.getColumn("reece_cohesive_modulus").isNull())
      soil.reece_cohesive_modulus = finite(row, "reece_cohesive_modulus", subject);
    if (!row.getColumn("reece_frictional_modulus").isNull())
      soil.reece_frictional_modulus = finite(row, "reece_frictional_modulus", subject);
    index[row.getColumn("id").getInt64()] = static_cast<int>(soils.size());
    soils.push_back(soil);
  }
  return index;
}

// Law of a wheel on a soil: the pair of its own material, else the pair of any material.
WheelSoilLaw law_of(Database& database, const Wheel& wheel, std::int64_t soil_id, const std::string& soil) {
  Statement row(database,
                "SELECT response FROM material_pair WHERE soil_id = ?1 AND (material_id IS NULL OR material_id = ?2) "
                "ORDER BY material_id IS NULL LIMIT 1");
  row.bind(1, soil_id);
  if (wheel.material_id) row.bind(2, *wheel.material_id);
  if (!row.executeStep())
    throw InputRefused(fmt::format("no material_pair says how wheel '{}' responds to soil '{}'; add a row with this soil, "
                                   "material NULL and response 'bekker_wong'",
                                   wheel.name, soil));
  return word_of<WheelSoilLaw>(row, "response", {{"bekker", WheelSoilLaw::bekker},
                                {"bekker_wong", WheelSoilLaw::bekker_wong},
                                {"reece", WheelSoilLaw::reece}},
                               fmt::format("the pair wheel '{}' - soil '{}'", wheel.name, soil));
}

Terrain load_terrain(Database& database, std::int64_t id, double gravity, const Rover& rover) {
  Statement row(database, "SELECT * FROM terrain WHERE id = ?");
  row.bind(1, id);
  if (!row.executeStep()) throw InputRefused(fmt::format("the scenario's terrain {} does not exist; run `rille db check`", id));
  Terrain terrain;
  terrain.name = row.getColumn("name").getString();
  const std::string subject = "terrain '" + terrain.name + "'";
  terrain.grid = load_grid(database, row, subject);
  const Index soils = load_soils(database, gravity, terrain.soils);
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
    for (const auto& [soil_id, soil] : soils)
      if (used[static_cast<std::size_t>(soil)])
        laws[static_cast<std::size_t>(soil)] = law_of(database, wheel, soil_id, terrain.soils[static_cast<std::size_t>(soil)].name);
    terrain.response.push_back(std::move(laws));
  }
  return terrain;
}

std::int64_t find_scenario(Database& database, const std::optional<std::string>& name) {
  std::vector<std::string> names;
  std::int64_t id = 0;
  Statement row(database, "SELECT id, name FROM scenario ORDER BY id");
  while (row.executeStep()) {
    names.push_back("'" + row.getColumn("name").getString() + "'");
    if (!name || row.getColumn("name").getString() == *name) id = row.getColumn("id").getInt64();
    if (name && row.getColumn("name").getString() == *name) return id;
  }
  if (names.empty())
    throw InputRefused("the database has no scenario; give one: `rille run MODEL.db --scenario FILE.toml`");
  if (name) throw InputRefused(fmt::format("there is no scenario '{}'; the database has {}", *name, fmt::join(names, ", ")));
  if (names.size() > 1)
    throw InputRefused(fmt::format("the database has {} scenarios; name one of {}", names.size(), fmt::join(names, ", ")));
  return id;
}

Scenario load_scenario(Database& database, std::int64_t id, const Index& joints, const Index& drives, const Rover& rover) {
  Statement row(database, "SELECT * FROM scenario WHERE id = ?");
  row.bind(1, id);
  row.executeStep();
  Scenario scenario;
  scenario.id = id;
  scenario.name = row.getColumn("name").getString();
  const std::string subject = "scenario '" + scenario.name + "'";
  scenario.gravity = vector(row, "gravity_x", "gravity_y", "gravity_z", subject);
  scenario.duration = finite(row, "duration", subject);
  scenario.step = finite(row, "step", subject);
  scenario.output_interval = finite(row, "output_interval", subject);
  scenario.integrator = word_of<Integrator>(row, "integrator",
                                            {{"auto", Integrator::automatic},
                                             {"semi_implicit_euler", Integrator::semi_implicit_euler},
                                             {"rk4", Integrator::rk4}},
                                            subject);
  scenario.placement = word_of<Placement>(
      row, "placement", {{"on_terrain", Placement::on_terrain}, {"as_given", Placement::as_given}}, subject);
  scenario.settle_time = finite(row, "settle_time", subject);
  scenario.start_position = vector(row, "start_x", "start_y", "start_z", subject);
  scenario.start_rotation = Eigen::Quaterniond(finite(row, "start_qw", subject), finite(row, "start_qx", subject),
                                               finite(row, "start_qy", subject), finite(row, "start_qz", subject))
                                .normalized();
  scenario.start_velocity = vector(row, "start_vx", "start_vy", "start_vz", subject);
  scenario.start_angular_velocity = vector(row, "start_wx", "start_wy", "start_wz", subject);

  Statement initial(database, "SELECT * FROM initial_state WHERE scenario_id = ? ORDER BY joint_id");
  initial.bind(1, id);
  while (initial.executeStep()) {
    const int joint = index_of(joints, initial.getColumn("joint_id"), "joint", subject);
    require_one_freedom(rover, joint, "an initial_state of " + subject);
    scenario.initial_states.push_back({joint, finite(initial, "position", subject), finite(initial, "velocity", subject)});
  }
  Statement command(database, "SELECT * FROM command WHERE scenario_id = ? ORDER BY time, drive_id");
  command.bind(1, id);
  while (command.executeStep())
    scenario.commands.push_back({index_of(drives, command.getColumn("drive_id"), "drive", subject),
                                 finite(command, "time", subject), finite(command, "value", subject)});
  return scenario;
}

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
  require_empty(database, "effect", "physics beyond the base model");
  require_empty(database, "loop_closure", "closed kinematic loops");
  Model model;
  Index joints;
  Index drives;
  model.rover = load_rover(database, drives, joints);
  const std::int64_t id = find_scenario(database, scenario);
  model.scenario = load_scenario(database, id, joints, drives, model.rover);
  Statement terrain(database, "SELECT terrain_id FROM scenario WHERE id = ?");
  terrain.bind(1, id);
  terrain.executeStep();
  if (!terrain.getColumn(0).isNull())
    model.terrain = load_terrain(database, terrain.getColumn(0).getInt64(), model.scenario.gravity.norm(), model.rover);
  return model;
} catch (const SQLite::Exception& error) {
  throw InputRefused(fmt::format("the model cannot be read ({}); run `rille db check`", error.what()));
}

}  // namespace rille
