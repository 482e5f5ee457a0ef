// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace asbuilt {

/// Random numbers that belong to an item, not to the thread that meets it: Random(seed, stage, index)
/// gives the same sequence wherever and whenever it is made. xoshiro256++ seeded by splitmix64; the
/// distributions are our own because the standard library's differ between implementations.
class Random {
 public:
  Random(std::uint64_t seed, std::string_view stage, std::uint64_t index) {
    // The seed is mixed before a letter meets it: else seed 0 with stage "b" would be seed 3 with stage "a".
    std::uint64_t state = mix(seed);
    for (const char c : stage) state = mix(state ^ static_cast<unsigned char>(c));
    state = mix(state ^ index);
    for (std::uint64_t& word : state_) word = state = mix(state);
  }

  [[nodiscard]] std::uint64_t bits() {
    const std::uint64_t result = rotate(state_[0] + state_[3], 23) + state_[0];
    const std::uint64_t shifted = state_[1] << 17;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= shifted;
    state_[3] = rotate(state_[3], 45);
    return result;
  }

  /// Uniform in [0, 1).
  [[nodiscard]] double uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }
  [[nodiscard]] double uniform(double low, double high) { return low + (high - low) * uniform(); }

  /// Uniform in [0, count); count > 0.
  [[nodiscard]] std::size_t below(std::size_t count) {
    return static_cast<std::size_t>(uniform() * static_cast<double>(count));
  }

  /// Standard normal (Box-Muller).
  [[nodiscard]] double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * 3.14159265358979323846 * uniform());
  }

 private:
  static std::uint64_t rotate(std::uint64_t x, int k) { return (x << k) | (x >> (64 - k)); }
  static std::uint64_t mix(std::uint64_t x) {
    x += 0x9e3779b97f4a7c15ULL;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
    return x ^ (x >> 31);
  }

  std::uint64_t state_[4];
};

}  // namespace asbuilt
