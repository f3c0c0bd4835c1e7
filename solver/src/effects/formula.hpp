// A formula over named variables and constants, checked for its dimension and evaluated by muParser.
#pragma once

#include <initializer_list>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "effects/dimension.hpp"
#include "model/effect.hpp"

namespace rille {

struct Variable {
  const char* name;
  const char* unit;
};

class Formula {
 public:
  // Raises InputRefused for a syntax error, an unknown name, or a result that is not of the dimension of `result_unit`.
  //
  // The dimension is checked as homogeneity (Buckingham 1914): when the units of m, kg, s, A are changed by any factors, all variables
  // change with their dimensions, and the result must change with its own. Random points and factors show every violation, whatever
  // functions the formula uses, and need no second parser.
  Formula(const std::string& text, const std::vector<Variable>& variables, const std::map<std::string, Constant>& constants,
          const std::string& result_unit);
  ~Formula();
  Formula(Formula&&) noexcept;

  // values: in the order of the variables. A result that is not finite counts as 0.
  double operator()(std::initializer_list<double> values) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace rille
