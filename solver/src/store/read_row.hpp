// Reading single values of a row, with sentences for what cannot be used.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>

#include "model/error.hpp"

namespace rille {

using Eigen::Vector3d;
using SQLite::Column;
using SQLite::Database;
using SQLite::Statement;
using Index = std::map<std::int64_t, int>;  // key in the database -> index in the model

// SQLite keeps infinities; nothing in a model may be one.
inline double finite(Statement& row, const char* column, const std::string& subject) {
  const double value = row.getColumn(column).getDouble();
  if (!std::isfinite(value))
    throw InputRefused(fmt::format("{} of {} is {}; give a finite value", column, subject, value));
  return value;
}

inline Vector3d vector(Statement& row, const char* x, const char* y, const char* z, const std::string& subject) {
  return {finite(row, x, subject), finite(row, y, subject), finite(row, z, subject)};
}

inline double above_zero(Statement& row, const char* column, const std::string& subject) {
  const double value = finite(row, column, subject);
  if (!(value > 0)) throw InputRefused(fmt::format("{} of {} is {:g}; it must be above 0", column, subject, value));
  return value;
}

inline double not_negative(Statement& row, const char* column, const std::string& subject) {
  const double value = finite(row, column, subject);
  if (!(value >= 0)) throw InputRefused(fmt::format("{} of {} is {:g}; it must not be below 0", column, subject, value));
  return value;
}

inline double within(Statement& row, const char* column, double lower, double upper, const std::string& subject) {
  const double value = finite(row, column, subject);
  if (!(value >= lower && value <= upper))
    throw InputRefused(fmt::format("{} of {} is {:g}; it must lie in {:g} to {:g}", column, subject, value, lower, upper));
  return value;
}

inline Eigen::Quaterniond rotation(Statement& row, const char* w, const char* x, const char* y, const char* z, const std::string& subject) {
  const Eigen::Quaterniond q(finite(row, w, subject), finite(row, x, subject), finite(row, y, subject), finite(row, z, subject));
  if (!(std::abs(q.norm() - 1) < 1e-3))
    throw InputRefused(fmt::format("the orientation of {} is a quaternion of length {:g}; it must be 1", subject, q.norm()));
  return q.normalized();
}

inline int index_of(const Index& index, const Column& key, const char* what, const std::string& subject) {
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

}  // namespace rille
