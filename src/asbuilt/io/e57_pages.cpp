// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/e57_pages.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "asbuilt/io/crc32c.h"
#include "asbuilt/io/file_map.h"

namespace asbuilt::io {
namespace {

template <class T, std::endian order = std::endian::little>
T integer_at(std::string_view bytes, std::size_t at) {
  std::array<char, sizeof(T)> copy;
  std::memcpy(copy.data(), bytes.data() + at, sizeof(T));
  if constexpr (order != std::endian::native) std::ranges::reverse(copy);
  return std::bit_cast<T>(copy);
}

}  // namespace

Result<E57Pages> E57Pages::open(const Input& input) {
  const std::string_view content = input.content;
  if (!content.starts_with("ASTM-E57")) return input.error("is no E57 file, which begins with ASTM-E57");
  if (content.size() < kHeaderSize) {
    return input.error_at_byte(content.size(), "the file ends within its header, it seems to be truncated");
  }
  const auto major = integer_at<std::uint32_t>(content, 8);
  if (major != 1) return input.error_at_byte(8, fmt::format("the E57 file has version {}, expected 1", major));
  E57Pages pages(input);
  const auto length = integer_at<std::uint64_t>(content, 16);
  pages.xml_physical_ = integer_at<std::uint64_t>(content, 24);
  pages.xml_length_ = integer_at<std::uint64_t>(content, 32);
  pages.page_size_ = integer_at<std::uint64_t>(content, 40);
  // The standard has 1024; other powers of two cost nothing to read.
  if (!std::has_single_bit(pages.page_size_) || pages.page_size_ < 64 || pages.page_size_ > (1u << 20)) {
    return input.error_at_byte(40, fmt::format("the pages have {} bytes, expected 1024", pages.page_size_));
  }
  if (content.size() < length) {
    return input.error_at_byte(content.size(), fmt::format("the file ends after {} of {} bytes, it seems to be "
                                                           "truncated",
                                                           content.size(), length));
  }
  pages.payload_ = pages.page_size_ - kChecksumSize;
  pages.input_.content = content.substr(0, content.size() / pages.page_size_ * pages.page_size_);
  pages.is_checked_.assign(static_cast<std::size_t>(pages.input_.content.size() / pages.page_size_), false);
  return pages;
}

std::uint64_t E57Pages::logical_size() const { return is_checked_.size() * payload_; }

std::uint64_t E57Pages::physical_from_logical(std::uint64_t logical) const {
  return logical / payload_ * page_size_ + logical % payload_;
}

Result<std::uint64_t> E57Pages::logical_from_physical(std::uint64_t physical, std::string_view what) const {
  const std::uint64_t within = physical % page_size_;
  if (physical < kHeaderSize || physical >= input_.content.size() || within >= payload_) {
    return input_.error(fmt::format("the offset of {} is {}, which is no place for data in a file of {} bytes", what,
                                    physical, input_.content.size()));
  }
  return physical / page_size_ * payload_ + within;
}

Result<void> E57Pages::check_page(std::uint64_t page) {
  const auto begin = static_cast<std::size_t>(page * page_size_);
  const std::string_view bytes = input_.content.substr(begin, static_cast<std::size_t>(page_size_));
  // Numbers in E57 are little-endian; the checksum alone is not.
  const auto stated = integer_at<std::uint32_t, std::endian::big>(bytes, static_cast<std::size_t>(payload_));
  const std::uint32_t found = crc32c(bytes.substr(0, static_cast<std::size_t>(payload_)));
  if (found != stated) {
    return input_.error_at_byte(begin,
                                fmt::format("page {} is damaged: its checksum is {:08x}, the file states {:08x}; "
                                            "copy or export the file again",
                                            page, found, stated));
  }
  is_checked_[static_cast<std::size_t>(page)] = true;
  return {};
}

Result<void> E57Pages::read(std::uint64_t logical, std::span<char> bytes) {
  if (logical > logical_size() || bytes.size() > logical_size() - logical) {
    return input_.error_at_byte(input_.content.size(),
                                fmt::format("the file ends {} bytes too early, it seems to be "
                                            "truncated",
                                            bytes.size() - (logical_size() - std::min(logical, logical_size()))));
  }
  for (std::size_t done = 0; done < bytes.size();) {
    const std::uint64_t page = (logical + done) / payload_, within = (logical + done) % payload_;
    if (!is_checked_[static_cast<std::size_t>(page)]) ASBUILT_CHECK(check_page(page));
    const std::size_t count = std::min(bytes.size() - done, static_cast<std::size_t>(payload_ - within));
    std::memcpy(bytes.data() + done, input_.content.data() + page * page_size_ + within, count);
    done += count;
  }
  // Points are read from front to back; who goes back reads again from the file.
  constexpr std::size_t kPiece = std::size_t{16} << 20;
  const auto reached = static_cast<std::size_t>(physical_from_logical(logical));
  if (reached < released_) released_ = reached;
  if (reached - released_ >= 2 * kPiece) {
    release_pages(input_.content.substr(released_, reached - released_ - kPiece));
    released_ = reached - kPiece;
  }
  return {};
}

Result<std::string> E57Pages::xml() {
  ASBUILT_TRY(begin, logical_from_physical(xml_physical_, "the XML section"));
  if (xml_length_ > logical_size() - begin) {
    return input_.error_at_byte(32, fmt::format("the XML section has {} bytes, the file only {} behind its beginning",
                                                xml_length_, logical_size() - begin));
  }
  std::string text(static_cast<std::size_t>(xml_length_), '\0');
  ASBUILT_CHECK(read(begin, text));
  return text;
}

}  // namespace asbuilt::io
