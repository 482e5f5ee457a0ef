// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>

namespace asbuilt::io {

/// Reads one number of type T at any address, from either byte order, as a double (exact for all types of 32 bits
/// and for double).
template <class T, std::endian order>
double load_scalar(const char* bytes) {
  std::array<char, sizeof(T)> copy;
  std::memcpy(copy.data(), bytes, sizeof(T));
  if constexpr (order != std::endian::native && sizeof(T) > 1) std::ranges::reverse(copy);
  return static_cast<double>(std::bit_cast<T>(copy));
}

/// The same for `count` numbers, `stride` bytes apart, into every `step`-th place of `numbers`.
template <class T, std::endian order>
void load_scalars(const char* bytes, std::size_t stride, std::size_t count, double* numbers, std::size_t step) {
  for (std::size_t i = 0; i < count; ++i) numbers[i * step] = load_scalar<T, order>(bytes + i * stride);
}

/// How numbers of one type are read, one by one or many in a loop of their own.
struct ScalarLoader {
  double (*one)(const char* bytes) = nullptr;
  void (*many)(const char* bytes, std::size_t stride, std::size_t count, double* numbers, std::size_t step) = nullptr;

  double operator()(const char* bytes) const { return one(bytes); }
  explicit operator bool() const { return one != nullptr; }
};

template <class T, std::endian order>
constexpr ScalarLoader scalar_loader() {
  return {load_scalar<T, order>, load_scalars<T, order>};
}

/// One number per row, at a fixed distance from row to row.
struct StridedColumn {
  const char* first = nullptr;
  std::size_t stride = 0;
  ScalarLoader load;

  [[nodiscard]] double operator[](std::size_t row) const { return load(first + row * stride); }
  /// Rows [row, row + count) into every `step`-th place of `numbers`.
  void read(std::size_t row, std::size_t count, double* numbers, std::size_t step) const {
    load.many(first + row * stride, stride, count, numbers, step);
  }
};

}  // namespace asbuilt::io
