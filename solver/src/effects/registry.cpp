#include "effects/registry.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace rille {

// Order as in schema/effects.sql. A law is added here, in a file of its own, in the catalogue and with a test (CONTRIBUTING.md).
#define RILLE_EFFECTS(X) \
  X(slip_sinkage) \
  X(sinkage_transient) \
  X(grouser_thrust) \
  X(grouser_ripple) \
  X(bulldozing) \
  X(lateral_bulldozing) \
  X(multipass) \
  X(exit_angle) \
  X(rate_dependence) \
  X(plate_size) \
  X(soil_change) \
  X(rolling_resistance) \
  X(skid_scrub) \
  X(coulomb_friction) \
  X(viscous_friction) \
  X(stribeck_friction) \
  X(load_friction) \
  X(backlash) \
  X(joint_elasticity) \
  X(motor_saturation) \
  X(motor_lag) \
  X(torque_ripple) \
  X(command_delay) \
  X(command_gain) \
  X(supply_sag) \
  X(joint_pulse) \
  X(mass_change) \
  X(com_offset) \
  X(payload_slosh) \
  X(linear_drag) \
  X(quadratic_drag) \
  X(tether_pull) \
  X(external_pulse) \
  X(gravity_tilt) \
  X(bias) \
  X(scale) \
  X(delay) \
  X(drift) \
  X(dropout) \
  X(clock_skew) \
  X(saturation) \
  X(wrong_sign) \
  X(expression)

namespace effects {
#define DECLARE(name) void attach_##name(const Attachment&);
RILLE_EFFECTS(DECLARE)
#undef DECLARE
}  // namespace effects

namespace {

struct Entry {
  const char* name;
  void (*attach)(const Attachment&);
};

constexpr Entry kEntries[] = {
#define ENTRY(name) {#name, effects::attach_##name},
    RILLE_EFFECTS(ENTRY)
#undef ENTRY
};

// Whether any of its amplitudes is there; they may have been set to 0 since the row was read.
bool acts(const EffectRow& row, const Catalogue* catalogue) {
  if (!catalogue) return true;
  const auto law = std::find_if(catalogue->begin(), catalogue->end(), [&](const Law& known) { return known.name == row.kind; });
  return law == catalogue->end() || std::any_of(law->numbers.begin(), law->numbers.end(), [&](const LawNumber& number) {
           const auto value = row.parameters.find(number.name);
           return number.amplitude && value != row.parameters.end() && value->second != 0;
         });
}

}  // namespace

Effects attach_effects(Model& model) {
  Effects effects;
  effects.wheels.resize(model.rover.wheels.size());
  effects.joints.resize(model.rover.joints.size());
  effects.bodies.resize(model.rover.bodies.size());
  effects.sensors.resize(model.rover.sensors.size());
  effects.command_delay.resize(model.rover.drives.size());
  for (const EffectRow& row : model.effects) {
    if (!acts(row, model.catalogue.get())) continue;
    const auto* entry = std::find_if(std::begin(kEntries), std::end(kEntries), [&](const Entry& e) { return row.kind == e.name; });
    if (entry == std::end(kEntries))
      throw InputRefused(fmt::format("the effect '{}' on '{}' is in the catalogue but not in this solver; see `rille effects list`", row.kind,
                                     row.target_name));
    entry->attach({row, model, effects});
  }
  if (std::any_of(effects.command_delay.begin(), effects.command_delay.end(), [](double delay) { return delay != 0; })) {
    auto& commands = model.scenario.commands;
    for (Command& command : commands) command.time += effects.command_delay[static_cast<std::size_t>(command.drive)];
    std::stable_sort(commands.begin(), commands.end(), [](const Command& x, const Command& y) { return x.time < y.time; });
  }
  return effects;
}

double longest_command_delay(const Model& model) {
  if (model.effects.empty()) return 0;
  Model probe{.rover = model.rover, .terrain = model.terrain, .scenario = {}, .effects = model.effects, .catalogue = model.catalogue};
  double longest = 0;
  for (const double delay : attach_effects(probe).command_delay) longest = std::max(longest, delay);
  return longest;
}

std::vector<std::string> known_effects() {
  std::vector<std::string> names;
  for (const Entry& entry : kEntries) names.emplace_back(entry.name);
  return names;
}

SoilReaction react_with(const WheelEffects& effects, WheelSoilLaw law, WheelSite& site) {
  const WheelShape shape{site.wheel->radius, site.wheel->width};
  for (const auto& effect : effects) effect->before(site);
  if (site.sinkage <= 0) return {};
  SoilReaction reaction = react(law, site.soil, shape, {site.sinkage, site.slip.ratio, site.slip.travel_ratio, site.lateral_ratio});
  if (reaction.normal_load != 0)
    for (const auto& effect : effects) effect->after(site, reaction);
  return reaction;
}

}  // namespace rille
