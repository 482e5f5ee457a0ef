// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace asbuilt::model {

static_assert(std::endian::native == std::endian::little, "prepared models are little-endian; add the swaps here");

/// Appends numbers and lists to a string, little-endian, without padding.
class ByteWriter {
 public:
  template <class Number>
  requires std::is_arithmetic_v<Number>
  void put(Number value) { bytes_.append(reinterpret_cast<const char*>(&value), sizeof(value)); }
  void put(std::string_view text) {
    put(static_cast<std::uint64_t>(text.size()));
    bytes_.append(text);
  }
  template <class Scalar>
  void put(const std::vector<Eigen::Matrix<Scalar, 3, 1>>& values) {
    put(static_cast<std::uint64_t>(values.size()));
    for (const auto& value : values) bytes_.append(reinterpret_cast<const char*>(value.data()), 3 * sizeof(Scalar));
  }
  void put(const std::vector<int>& values) {
    put(static_cast<std::uint64_t>(values.size()));
    for (const int value : values) put(static_cast<std::int32_t>(value));
  }

  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

/// Takes them out again. Once something was missing, ok() is false and all further reads give zero or nothing.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}

  template <class Number>
  requires std::is_arithmetic_v<Number>
  void get(Number& value) {
    value = Number{};
    if (const char* bytes = take(1, sizeof(value))) std::memcpy(&value, bytes, sizeof(value));
  }
  void get(std::string& text) {
    std::uint64_t size = 0;
    get(size);
    const char* bytes = take(size, 1);
    text = bytes != nullptr ? std::string(bytes, size) : std::string();
  }
  template <class Scalar>
  void get(std::vector<Eigen::Matrix<Scalar, 3, 1>>& values) {
    std::uint64_t size = 0;
    get(size);
    values.clear();
    const char* bytes = take(size, 3 * sizeof(Scalar));
    if (bytes == nullptr) return;
    values.resize(size);
    for (auto& value : values) {
      std::memcpy(value.data(), bytes, 3 * sizeof(Scalar));
      bytes += 3 * sizeof(Scalar);
    }
  }
  void get(std::vector<int>& values) {
    std::uint64_t size = 0;
    get(size);
    values.clear();
    const char* bytes = take(size, sizeof(std::int32_t));
    for (std::uint64_t i = 0; bytes != nullptr && i < size; ++i, bytes += sizeof(std::int32_t)) {
      std::int32_t value = 0;
      std::memcpy(&value, bytes, sizeof(value));
      values.push_back(value);
    }
  }

  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] bool at_end() const { return ok_ && rest_.empty(); }

 private:
  // Checks before it multiplies: a damaged count must not ask for memory.
  const char* take(std::uint64_t count, std::size_t each) {
    if (!ok_ || count > rest_.size() / each) {
      ok_ = false;
      return nullptr;
    }
    const char* bytes = rest_.data();
    rest_.remove_prefix(static_cast<std::size_t>(count) * each);
    return bytes;
  }

  std::string_view rest_;
  bool ok_ = true;
};

}  // namespace asbuilt::model
