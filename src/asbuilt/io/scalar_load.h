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

using ScalarLoader = double (*)(const char*);

/// One number per row, at a fixed distance from row to row.
struct StridedColumn {
  const char* first = nullptr;
  std::size_t stride = 0;
  ScalarLoader load = nullptr;

  [[nodiscard]] double operator[](std::size_t row) const { return load(first + row * stride); }
};

}  // namespace asbuilt::io
