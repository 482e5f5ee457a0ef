// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "asbuilt/core/result.h"
#include "asbuilt/io/input.h"

namespace asbuilt::io {

/// The paged layer of an E57 file (ASTM E2807, section 7): pages of data, each followed by the CRC-32C of it. Offsets
/// in the file are physical (checksums count), lengths are logical (they do not).
class E57Pages {
 public:
  static constexpr std::size_t kHeaderSize = 48, kChecksumSize = 4;

  /// Reads the file header. Errors: unreadable_input (no E57, a version that is not known, sizes that contradict the
  /// file).
  [[nodiscard]] static Result<E57Pages> open(const Input& input);

  /// Copies logical bytes; a page is checked when it is first touched. Errors: unreadable_input with the byte (beyond
  /// the end, or a damaged page).
  [[nodiscard]] Result<void> read(std::uint64_t logical, std::span<char> bytes);

  /// Errors: unreadable_input for an offset outside the file or within a checksum. `what` names it.
  [[nodiscard]] Result<std::uint64_t> logical_from_physical(std::uint64_t physical, std::string_view what) const;
  [[nodiscard]] std::uint64_t physical_from_logical(std::uint64_t logical) const;
  [[nodiscard]] std::uint64_t logical_size() const;

  /// The XML section.
  [[nodiscard]] Result<std::string> xml();

 private:
  explicit E57Pages(const Input& input) : input_(input) {}
  [[nodiscard]] Result<void> check_page(std::uint64_t page);

  Input input_;
  std::uint64_t page_size_ = 0, payload_ = 0, xml_physical_ = 0, xml_length_ = 0;
  std::vector<bool> is_checked_;
  std::size_t released_ = 0;  ///< bytes of the file before which pages may have left memory
};

}  // namespace asbuilt::io
