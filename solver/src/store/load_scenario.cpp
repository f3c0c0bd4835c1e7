#include "store/parts.hpp"

#include <fmt/ranges.h>

#include <vector>

namespace rille {

std::int64_t find_scenario(Database& database, const std::optional<std::string>& name) {
  std::vector<std::string> names;
  std::int64_t id = 0;
  // Without a name, what was steered is not meant.
  Statement row(database, name ? "SELECT id, name FROM scenario ORDER BY id" : "SELECT id, name FROM scenario WHERE steered_from = '' ORDER BY id");
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

Scenario load_scenario(Database& database, std::int64_t id, const RoverKeys& keys, const Rover& rover) {
  Statement row(database, "SELECT * FROM scenario WHERE id = ?");
  row.bind(1, id);
  row.executeStep();
  Scenario scenario;
  scenario.id = id;
  scenario.name = row.getColumn("name").getString();
  const std::string subject = "scenario '" + scenario.name + "'";
  scenario.gravity = vector(row, "gravity_x", "gravity_y", "gravity_z", subject);
  scenario.duration = above_zero(row, "duration", subject);
  scenario.step = above_zero(row, "step", subject);
  scenario.output_interval = above_zero(row, "output_interval", subject);
  scenario.integrator = word_of<Integrator>(row, "integrator",
                                            {{"auto", Integrator::automatic},
                                             {"semi_implicit_euler", Integrator::semi_implicit_euler},
                                             {"rk4", Integrator::rk4}},
                                            subject);
  scenario.placement = word_of<Placement>(
      row, "placement", {{"on_terrain", Placement::on_terrain}, {"as_given", Placement::as_given}}, subject);
  scenario.settle_time = within(row, "settle_time", 0, 1e6, subject);
  scenario.start_position = vector(row, "start_x", "start_y", "start_z", subject);
  scenario.start_rotation = rotation(row, "start_qw", "start_qx", "start_qy", "start_qz", subject);
  scenario.start_velocity = vector(row, "start_vx", "start_vy", "start_vz", subject);
  scenario.start_angular_velocity = vector(row, "start_wx", "start_wy", "start_wz", subject);

  Statement initial(database, "SELECT * FROM initial_state WHERE scenario_id = ? ORDER BY joint_id");
  initial.bind(1, id);
  while (initial.executeStep()) {
    const int joint = index_of(keys.joints, initial.getColumn("joint_id"), "joint", subject);
    require_one_freedom(rover, joint, "an initial_state of " + subject);
    scenario.initial_states.push_back({joint, finite(initial, "position", subject), finite(initial, "velocity", subject)});
  }
  Statement command(database, "SELECT * FROM command WHERE scenario_id = ? ORDER BY time, drive_id");
  command.bind(1, id);
  while (command.executeStep())
    scenario.commands.push_back({index_of(keys.drives, command.getColumn("drive_id"), "drive", subject),
                                 finite(command, "time", subject), finite(command, "value", subject)});
  Statement change(database, "SELECT * FROM state_change WHERE scenario_id = ? ORDER BY number, component");
  change.bind(1, id);
  for (std::int64_t number = 0; change.executeStep();) {
    const double time = finite(change, "time", subject);
    if (change.getColumn("number").getInt64() != number) {
      if (!scenario.changes.empty() && time < scenario.changes.back().time)
        throw InputRefused(fmt::format("a state_change of {} at {:g} s comes after one at {:g} s; number them by their times", subject, time,
                                       scenario.changes.back().time));
      scenario.changes.push_back({time, change.getColumn("quantity").getString(), change.getColumn("target").getString(), {}});
      number = change.getColumn("number").getInt64();
    }
    scenario.changes.back().values.push_back(finite(change, "value", subject));
  }
  Statement watch(database, "SELECT * FROM watch WHERE scenario_id = ? ORDER BY id");
  watch.bind(1, id);
  while (watch.executeStep()) {
    Watch made;
    made.name = watch.getColumn("name").getString();
    const std::string who = "watch '" + made.name + "'";
    made.event = watch.getColumn("event").getString();
    made.quantity = watch.getColumn("quantity").getString();
    made.component = watch.getColumn("component").getInt();
    made.target = watch.getColumn("target").getString();
    if (!watch.getColumn("above").isNull()) made.above = finite(watch, "above", who);
    if (!watch.getColumn("below").isNull()) made.below = finite(watch, "below", who);
    made.hold = within(watch, "hold", 0, 1e9, who);
    made.action = word_of<WatchAction>(watch, "action",
                                       {{"mark", WatchAction::mark}, {"stop", WatchAction::stop}, {"command", WatchAction::command}}, who);
    if (made.action == WatchAction::command) {
      made.drive = index_of(keys.drives, watch.getColumn("drive_id"), "drive", who);
      made.value = finite(watch, "value", who);
    }
    scenario.watches.push_back(std::move(made));
  }
  return scenario;
}

}  // namespace rille
