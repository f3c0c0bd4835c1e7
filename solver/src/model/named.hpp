// Finding a part of a model by its name, with a sentence for a name that it does not have.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string>
#include <vector>

#include "model/error.hpp"

namespace rille {

// Index of the item of that name. whose: the beginning of the sentence, such as "sensor 'imu' reads body".
template <class Items>
int find_named(const Items& items, const std::string& name, const std::string& whose) {
  std::vector<std::string> names;
  for (std::size_t k = 0; k < items.size(); ++k) {
    if (items[k].name == name) return static_cast<int>(k);
    names.push_back(items[k].name);
  }
  throw InputRefused(fmt::format("{} '{}', which the model does not have; it has {}", whose, name, names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
}

}  // namespace rille
