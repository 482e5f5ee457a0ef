// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace asbuilt::io {

/// SHA-256 (FIPS 180-4) of bytes that come piece by piece.
class Sha256 {
 public:
  using Words = std::array<std::uint32_t, 8>;
  /// Adds whole blocks of 64 bytes to a hash.
  using AddBlocks = void (*)(Words& hash, const unsigned char* blocks, std::size_t count);

  /// Takes the processor's own instructions where it has them.
  Sha256();
  explicit Sha256(AddBlocks add_blocks);

  void add(std::string_view bytes);
  /// 64 hexadecimal digits; nothing may be added afterwards.
  [[nodiscard]] std::string digest();

  static void add_blocks_plainly(Words& hash, const unsigned char* blocks, std::size_t count);
  /// nullptr where this processor (or this compiler) has no instructions for it.
  [[nodiscard]] static AddBlocks add_blocks_by_instructions();

 private:
  AddBlocks add_blocks_;
  Words hash_;
  std::array<unsigned char, 64> rest_{};
  std::uint64_t size_ = 0;
};

}  // namespace asbuilt::io
