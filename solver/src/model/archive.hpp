// A complete state as bytes: one function visits the values of an object, for writing and for reading alike.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <cstring>
#include <deque>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "model/error.hpp"

namespace rille {

class Archive {
 public:
  Archive() = default;                                                        // writes
  explicit Archive(std::string bytes) : reading_(true), bytes_(std::move(bytes)) {}  // reads

  bool reading() const { return reading_; }
  const std::string& bytes() const { return bytes_; }
  // Raises InputRefused unless every byte was read.
  void finish() const {
    if (reading_ && at_ != bytes_.size()) refuse();
  }

  template <class... Values>
  void operator()(Values&... values) {
    (visit(values), ...);
  }

 private:
  template <class Value>
  void visit(Value& value) {
    if constexpr (std::is_same_v<Value, bool>) {
      auto byte = static_cast<unsigned char>(value);
      raw(&byte, 1);
      if (byte > 1) refuse();
      value = byte == 1;
    } else if constexpr (std::is_enum_v<Value>) {  // the only one in a state: -1, 0, 1 (RowSide)
      auto number = static_cast<std::underlying_type_t<Value>>(value);
      raw(&number, sizeof number);
      if (number < -1 || number > 1) refuse();
      value = static_cast<Value>(number);
    } else if constexpr (std::is_arithmetic_v<Value>) {
      raw(&value, sizeof value);
    } else {
      value.visit(*this);
    }
  }
  template <class Scalar, int Rows, int Columns>
  void visit(Eigen::Matrix<Scalar, Rows, Columns>& matrix) {
    auto size = static_cast<std::uint64_t>(matrix.size());
    const std::uint64_t expected = size;
    raw(&size, sizeof size);
    if (size != expected) refuse();  // shapes are part of the model, not of the state
    raw(matrix.data(), sizeof(Scalar) * static_cast<std::size_t>(matrix.size()));
  }
  void visit(Eigen::Quaterniond& rotation) { raw(rotation.coeffs().data(), 4 * sizeof(double)); }
  template <class First, class Second>
  void visit(std::pair<First, Second>& pair) {
    visit(pair.first);
    visit(pair.second);
  }
  template <class Value, std::size_t N>
  void visit(std::array<Value, N>& values) {
    for (Value& value : values) visit(value);
  }
  void visit(std::string& text) {
    const std::size_t size = count(text.size());
    text.resize(size);
    raw(text.data(), size);
  }
  void visit(std::vector<bool>& flags) {
    flags.resize(count(flags.size()));
    for (std::size_t k = 0; k < flags.size(); ++k) {
      bool flag = flags[k];
      visit(flag);
      flags[k] = flag;
    }
  }
  template <class Value>
  void visit(std::vector<Value>& values) {
    values.resize(count(values.size()));
    for (Value& value : values) visit(value);
  }
  template <class Value>
  void visit(std::deque<Value>& values) {
    values.resize(count(values.size()));
    for (Value& value : values) visit(value);
  }

  std::size_t count(std::size_t size) {
    auto number = static_cast<std::uint64_t>(size);
    raw(&number, sizeof number);
    if (reading_ && number > bytes_.size() - at_) refuse();  // no element takes less than a byte
    return static_cast<std::size_t>(number);
  }
  void raw(void* data, std::size_t size) {
    if (size == 0) return;
    if (!reading_) {
      bytes_.append(static_cast<const char*>(data), size);
      return;
    }
    if (size > bytes_.size() - at_) refuse();
    std::memcpy(data, bytes_.data() + at_, size);
    at_ += size;
  }
  [[noreturn]] static void refuse() {
    throw InputRefused("the checkpoint does not belong to this model or is damaged; start the run again without --resume");
  }

  bool reading_ = false;
  std::string bytes_;
  std::size_t at_ = 0;
};

}  // namespace rille
