// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstring>
#include <string>
#include <type_traits>

namespace asbuilt::test {

/// The bytes of a number, least significant first, by arithmetic rather than by the machine's own order.
template <class T>
std::string little(T value) {
  using Bits = std::conditional_t<
      sizeof(T) == 8, unsigned long long,
      std::conditional_t<sizeof(T) == 4, unsigned, std::conditional_t<sizeof(T) == 2, unsigned short, unsigned char>>>;
  Bits bits;
  std::memcpy(&bits, &value, sizeof(T));
  std::string bytes;
  for (std::size_t i = 0; i < sizeof(T); ++i) bytes += static_cast<char>((bits >> (8 * i)) & 0xff);
  return bytes;
}

template <class T>
std::string big(T value) {
  const std::string bytes = little(value);
  return {bytes.rbegin(), bytes.rend()};
}

}  // namespace asbuilt::test
