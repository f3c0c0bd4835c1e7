// The two ways in which the solver says no. Outcomes of physics are values (see result.hpp), not errors.
#pragma once

#include <stdexcept>
#include <string>

namespace rille {

// Input that cannot be used. The sentence names the quantity, the value, which one, the bound and the fix. Exit code 3.
class InputRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace rille
