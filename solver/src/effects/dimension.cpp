#include "effects/dimension.hpp"

#include <fmt/format.h>

#include <map>

#include "model/error.hpp"

namespace rille {
namespace {

const std::map<std::string, Dimension> kUnits = {
    {"1", {}},
    {"-", {}},
    {"rad", {}},
    {"m", {{1, 0, 0, 0}}},
    {"kg", {{0, 1, 0, 0}}},
    {"s", {{0, 0, 1, 0}}},
    {"A", {{0, 0, 0, 1}}},
    {"Hz", {{0, 0, -1, 0}}},
    {"N", {{1, 1, -2, 0}}},
    {"Pa", {{-1, 1, -2, 0}}},
    {"J", {{2, 1, -2, 0}}},
    {"W", {{2, 1, -3, 0}}},
    {"V", {{2, 1, -3, -1}}},
};

}  // namespace

Dimension dimension_of(const std::string& unit) {
  const auto refuse = [&](const std::string& part) {
    return InputRefused(fmt::format("the unit '{}' has the part '{}', which is no SI unit known here; use m, kg, s, A, rad, N, Pa, J, W, V, Hz "
                                    "with ^ and /, for example 'N m s/rad'", unit, part));
  };
  Dimension total;
  std::size_t at = 0;
  double sign = 1;
  while (at < unit.size()) {
    if (unit[at] == ' ' || unit[at] == '*') {
      sign = 1;
      ++at;
      continue;
    }
    if (unit[at] == '/') {
      sign = -1;
      ++at;
      continue;
    }
    const std::size_t end = std::min(unit.find_first_of(" */", at), unit.size());
    const std::string part = unit.substr(at, end - at);
    const std::size_t hat = part.find('^');
    const auto found = kUnits.find(part.substr(0, hat));
    if (found == kUnits.end()) throw refuse(part);
    double power = 1;
    if (hat != std::string::npos) {
      std::size_t used = 0;
      try {
        power = std::stod(part.substr(hat + 1), &used);
      } catch (const std::exception&) {
        throw refuse(part);
      }
      if (used != part.size() - hat - 1) throw refuse(part);
    }
    total = total * found->second.to_the(sign * power);
    at = end;
  }
  return total;
}

}  // namespace rille
