#include "store/parts.hpp"

namespace rille {
namespace {

Catalogue load_catalogue(Database& database) {
  Catalogue catalogue;
  Statement law(database, "SELECT id, name, target, memory FROM effect_kind ORDER BY id");
  while (law.executeStep()) {
    catalogue.push_back({.name = law.getColumn("name").getString(), .target = law.getColumn("target").getString(),
                         .memory = law.getColumn("memory").getInt() == 1, .numbers = {}});
    Statement number(database, "SELECT name, unit, amplitude, lower, upper, typical FROM effect_parameter WHERE effect_kind_id = ? ORDER BY rowid");
    number.bind(1, law.getColumn("id").getInt64());
    while (number.executeStep())
      catalogue.back().numbers.push_back({.name = number.getColumn("name").getString(), .unit = number.getColumn("unit").getString(),
                                          .amplitude = number.getColumn("amplitude").getInt() == 1,
                                          .lower = number.getColumn("lower").getDouble(), .upper = number.getColumn("upper").getDouble(),
                                          .typical = number.getColumn("typical").getDouble()});
  }
  return catalogue;
}

}  // namespace

void load_effects(Database& database, Model& model) {
  model.catalogue = std::make_shared<const Catalogue>(load_catalogue(database));
  Statement row(database,
                "SELECT effect.id AS id, name, effect_kind.target AS kind_target, effect.target AS target, parameters, effect_kind_id, "
                "json_extract(parameters, '$.formula') AS formula, json_extract(parameters, '$.output') AS output, "
                "json_extract(parameters, '$.target_kind') AS target_kind FROM effect JOIN effect_kind ON effect_kind.id = effect_kind_id ORDER BY effect.id");
  while (row.executeStep()) {
    EffectRow effect;
    effect.kind = row.getColumn("name").getString();
    effect.target_name = row.getColumn("target").getString();
    std::string target = row.getColumn("kind_target").getString();
    if (target == "any") target = row.getColumn("target_kind").getString();
    aim(effect, target, model.rover);
    const std::int64_t id = row.getColumn("id").getInt64();
    // Names that are no parameter of the law are mistakes, not comments.
    Statement stranger(database,
                       "SELECT key FROM effect, json_each(effect.parameters) WHERE effect.id = ?1 AND key NOT IN "
                       "(SELECT name FROM effect_parameter WHERE effect_kind_id = effect.effect_kind_id) "
                       "AND NOT (?2 = 'expression' AND key IN ('formula', 'output', 'constants', 'target_kind')) LIMIT 1");
    stranger.bind(1, id);
    stranger.bind(2, effect.kind);
    if (stranger.executeStep())
      throw InputRefused(fmt::format("the effect '{}' on '{}' has no parameter '{}'; see `rille effects show {}`", effect.kind, effect.target_name,
                                     stranger.getColumn(0).getString(), effect.kind));
    Statement value(database,
                    "SELECT name, unit, amplitude, lower, upper, typical, json_type(parameters, '$.' || name) AS type, "
                    "json_extract(parameters, '$.' || name) AS value FROM effect JOIN effect_parameter USING (effect_kind_id) WHERE effect.id = ?");
    value.bind(1, id);
    bool present = false;
    while (value.executeStep()) {
      const std::string name = value.getColumn("name").getString();
      const bool amplitude = value.getColumn("amplitude").getInt() == 1;
      const std::string type = value.getColumn("type").getString();
      double number = amplitude ? 0 : value.getColumn("typical").getDouble();
      if (type == "real" || type == "integer") number = value.getColumn("value").getDouble();
      else if (!type.empty() && type != "null")
        throw InputRefused(fmt::format("the parameter '{}' of effect '{}' on '{}' is {}; give a number in {}", name, effect.kind,
                                       effect.target_name, type, value.getColumn("unit").getString()));
      const double lower = value.getColumn("lower").getDouble(), upper = value.getColumn("upper").getDouble();
      if (!(number >= lower && number <= upper) && !(amplitude && number == 0))
        throw InputRefused(fmt::format("the parameter '{}' of effect '{}' on '{}' is {:g} {}; it must lie in {:g} to {:g}", name, effect.kind,
                                       effect.target_name, number, value.getColumn("unit").getString(), lower, upper));
      effect.parameters[name] = number;
      present = present || (amplitude && number != 0);
    }
    if (!present) continue;
    if (effect.kind == "expression") {
      effect.formula = row.getColumn("formula").getString();
      effect.output = row.getColumn("output").getString();
      Statement constant(database,
                         "SELECT key, json_type(value, '$[0]') AS type, json_extract(value, '$[0]') AS number, json_extract(value, '$[1]') AS unit "
                         "FROM effect, json_each(effect.parameters, '$.constants') WHERE effect.id = ?");
      constant.bind(1, id);
      while (constant.executeStep()) {
        const std::string type = constant.getColumn("type").getString();
        if (type != "real" && type != "integer")
          throw InputRefused(fmt::format("the constant '{}' of the expression on '{}' must be a pair [number, \"SI unit\"]",
                                         constant.getColumn("key").getString(), effect.target_name));
        effect.constants[constant.getColumn("key").getString()] = {finite(constant, "number", "a constant of an expression"),
                                                                   constant.getColumn("unit").getString()};
      }
    }
    model.effects.push_back(std::move(effect));
  }
}

}  // namespace rille
