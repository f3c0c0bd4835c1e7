#include "effects/formula.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <muParser.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "model/error.hpp"

namespace rille {

struct Formula::Impl {
  mu::Parser parser;
  std::vector<double> values;     // variables, then constants
};

Formula::Formula(const std::string& text, const std::vector<Variable>& variables, const std::map<std::string, Constant>& constants,
                 const std::string& result_unit)
    : impl_(std::make_unique<Impl>()) {
  std::vector<Dimension> dimensions;
  std::vector<std::string> names;
  for (const Variable& variable : variables) {
    names.emplace_back(variable.name);
    dimensions.push_back(dimension_of(variable.unit));
  }
  for (const auto& [name, constant] : constants) {
    if (std::find(names.begin(), names.end(), name) != names.end())
      throw InputRefused(fmt::format("the constant '{}' of the formula '{}' has the name of a variable; rename it", name, text));
    names.push_back(name);
    dimensions.push_back(dimension_of(constant.unit));
  }
  auto& values = impl_->values;
  values.assign(names.size(), 0);
  const auto explain = [&](const mu::Parser::exception_type& error) {
    return InputRefused(fmt::format("the formula '{}' cannot be read: {}; it may use {}, and sin cos tan exp ln sqrt abs sign min max tanh",
                                    text, error.GetMsg(), fmt::join(names, ", ")));
  };
  const Dimension result = dimension_of(result_unit);
  try {
    for (std::size_t k = 0; k < names.size(); ++k) impl_->parser.DefineVar(names[k], &values[k]);
    impl_->parser.SetExpr(text);
    std::mt19937_64 random(20071);  // fixed: the same verdict every time
    std::uniform_real_distribution<double> log_size(-1.5, 1.5);
    int tried = 0;
    for (int point = 0; point < 64; ++point) {
      std::vector<double> at(names.size());
      for (std::size_t k = 0; k < at.size(); ++k)
        at[k] = std::exp(log_size(random)) * (k < variables.size() && point % 2 == 1 && random() % 2 == 0 ? -1 : 1);
      values = at;
      const double before = impl_->parser.Eval();
      std::array<double, 4> unit_change{};
      for (double& change : unit_change) change = log_size(random);
      const auto factor = [&](const Dimension& d) {
        double logarithm = 0;
        for (std::size_t k = 0; k < 4; ++k) logarithm += d.exponent[k] * unit_change[k];
        return std::exp(logarithm);
      };
      for (std::size_t k = 0; k < at.size(); ++k) values[k] = at[k] * factor(dimensions[k]);
      const double after = impl_->parser.Eval();
      if (!std::isfinite(before) || !std::isfinite(after)) continue;
      const double expected = before * factor(result);
      if (std::abs(after - expected) > 1e-8 * std::max(std::abs(after), std::abs(expected)))
        throw InputRefused(fmt::format("the formula '{}' does not have the unit {}: it changes otherwise when the units do; check its constants "
                                       "and the arguments of its functions, which must be pure numbers", text, result_unit));
      if (before != 0) ++tried;
    }
    if (tried < 3) throw InputRefused(fmt::format("the formula '{}' is zero or undefined wherever it was tried; check it", text));
  } catch (const mu::Parser::exception_type& error) {
    throw explain(error);
  }
  std::size_t at = variables.size();
  for (const auto& [name, constant] : constants) values[at++] = constant.value;
}

Formula::~Formula() = default;
Formula::Formula(Formula&&) noexcept = default;

double Formula::operator()(std::initializer_list<double> values) const {
  std::copy(values.begin(), values.end(), impl_->values.begin());
  const double result = impl_->parser.Eval();
  return std::isfinite(result) ? result : 0;
}

}  // namespace rille
