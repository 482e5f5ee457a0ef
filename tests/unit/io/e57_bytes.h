// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "unit/io/bytes.h"

namespace asbuilt::test {

/// CRC-32C one bit after the other, as its definition reads: an oracle for the one with tables.
inline std::uint32_t plain_crc32c(const std::string& bytes) {
  std::uint32_t crc = 0xffffffffu;
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1u) != 0 ? 0x82F63B78u : 0u);
  }
  return ~crc;
}

/// Integers of so many bits each, the first in the lowest bits.
inline std::string packed(const std::vector<int>& values, int bits) {
  std::string bytes;
  int filled = 0;
  for (const int value : values) {
    for (int bit = 0; bit < bits; ++bit, ++filled) {
      if (filled % 8 == 0) bytes += '\0';
      if (((value >> bit) & 1) != 0) bytes.back() = static_cast<char>(bytes.back() | (1 << (filled % 8)));
    }
  }
  return bytes;
}

/// Recomputes the checksum of every page of an E57 file: what a fuzzer changes then gets past them.
inline void repair_checksums(std::string& file, std::size_t page = 1024) {
  for (std::size_t at = 0; at + page <= file.size(); at += page) {
    const std::string crc = big(plain_crc32c(file.substr(at, page - 4)));
    file.replace(at + page - 4, 4, crc);
  }
}

/// An E57 file, byte by byte.
class E57Builder {
 public:
  /// A scan whose fields have these byte streams; they are cut at arbitrary places into `packets` packets.
  void add_scan(const std::string& prototype, std::size_t records, const std::vector<std::vector<std::string>>& streams,
                std::size_t packets = 1, const std::string& header = "") {
    const std::size_t section = body_.size() + 48;
    std::string data;
    const std::vector<std::string>& fields = streams.front();
    for (std::size_t p = 0; p < packets; ++p) {
      std::string lengths, content;
      for (const std::string& field : fields) {
        const std::size_t begin = field.size() * p / packets, end = field.size() * (p + 1) / packets;
        lengths += little(static_cast<std::uint16_t>(end - begin));
        content += field.substr(begin, end - begin);
      }
      std::string packet = lengths + content;
      while ((packet.size() + 6) % 4 != 0) packet += '\0';
      data += std::string("\1\0", 2) + little(static_cast<std::uint16_t>(packet.size() + 5)) +
              little(static_cast<std::uint16_t>(fields.size())) + packet;
    }
    const std::string header_bytes = std::string("\1\0\0\0\0\0\0\0", 8) + little(std::uint64_t{32 + data.size()}) +
                                     little(physical(section + 32)) + little(std::uint64_t{0});
    body_ += header_bytes + data;
    xml_ += "<vectorChild type=\"Structure\">" + header + "<points type=\"CompressedVector\" fileOffset=\"" +
            std::to_string(physical(section)) + "\" recordCount=\"" + std::to_string(records) +
            "\"><prototype type=\"Structure\">" + prototype +
            "</prototype><codecs type=\"Vector\" allowHeterogeneousChildren=\"1\"></codecs></points></vectorChild>";
  }

  [[nodiscard]] std::string bytes() const {
    const std::string xml =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?><e57Root type=\"Structure\"><data3D type=\"Vector\">" + xml_ +
        "</data3D></e57Root>";
    const std::size_t logical = 48 + body_.size() + xml.size();
    const std::uint64_t pages = (logical + 1019) / 1020;
    std::string content = "ASTM-E57" + little(std::uint32_t{1}) + little(std::uint32_t{0}) + little(1024 * pages) +
                          little(physical(48 + body_.size())) + little(std::uint64_t{xml.size()}) +
                          little(std::uint64_t{1024}) + body_ + xml;
    content.resize(pages * 1020, '\0');
    std::string file;
    for (std::size_t at = 0; at < content.size(); at += 1020) file += content.substr(at, 1020) + std::string(4, '\0');
    repair_checksums(file);
    return file;
  }

 private:
  static std::uint64_t physical(std::uint64_t logical) { return logical / 1020 * 1024 + logical % 1020; }

  std::string body_, xml_;
};

}  // namespace asbuilt::test
