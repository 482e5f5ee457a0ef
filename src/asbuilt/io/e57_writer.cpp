// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/e57_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>

#include "asbuilt/io/crc32c.h"
#include "asbuilt/io/file.h"

namespace asbuilt::io {
namespace {

constexpr std::size_t kPage = 1024, kPayload = kPage - 4, kHeaderSize = 48;
constexpr std::size_t kLargestPacket = 32768;
constexpr double kMetresPerMillimetre = 1e-3;

template <class T>
void append(std::string& bytes, T value) {
  std::array<char, sizeof(T)> copy = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if constexpr (std::endian::native != std::endian::little) std::ranges::reverse(copy);
  bytes.append(copy.data(), copy.size());
}

std::uint64_t physical(std::uint64_t logical) { return logical / kPayload * kPage + logical % kPayload; }

/// A field of the records: its line in the prototype, and its bytes for one point.
struct Field {
  std::string prototype;
  std::size_t size;  ///< bytes a point
  std::function<void(std::string&, std::size_t)> put;
};

bool is_float_enough(const E57Scan& scan) {
  constexpr double kLargest_mm = 8000.0;  // there half a step of float is a quarter of a micrometre
  return std::ranges::all_of(scan.positions_mm, [](const Eigen::Vector3d& p) {
    return !p.allFinite() || p.cwiseAbs().maxCoeff() < kLargest_mm;
  });
}

bool has_invalid(const E57Scan& scan) {
  return !std::ranges::all_of(scan.positions_mm, [](const Eigen::Vector3d& p) { return p.allFinite(); });
}

std::vector<Field> fields_of(const E57Scan& scan) {
  std::vector<Field> fields;
  const bool is_single = is_float_enough(scan);
  const std::string real = is_single ? R"(type="Float" precision="single")" : R"(type="Float")";
  const std::size_t real_size = is_single ? 4 : 8;
  constexpr std::array<const char*, 3> kAxes{"X", "Y", "Z"};
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    fields.push_back({fmt::format("<cartesian{} {}/>", kAxes[static_cast<std::size_t>(axis)], real), real_size,
                      [&scan, axis, is_single](std::string& bytes, std::size_t i) {
                        const Eigen::Vector3d& p = scan.positions_mm[i];
                        const double metres = p.allFinite() ? p[axis] * kMetresPerMillimetre : 0.0;
                        if (is_single) {
                          append(bytes, static_cast<float>(metres));
                        } else {
                          append(bytes, metres);
                        }
                      }});
  }
  if (has_invalid(scan)) {
    // A range of 256 values takes a whole byte, so that no bits need packing.
    fields.push_back(
        {R"(<cartesianInvalidState type="Integer" minimum="0" maximum="255"/>)", 1,
         [&scan](std::string& bytes, std::size_t i) { bytes += scan.positions_mm[i].allFinite() ? '\0' : '\2'; }});
  }
  for (Eigen::Index axis = 0; axis < 3 && !scan.normals.empty(); ++axis) {
    fields.push_back({fmt::format(R"(<nor:normal{} type="Float" precision="single" minimum="-1" maximum="1"/>)",
                                  kAxes[static_cast<std::size_t>(axis)]),
                      4, [&scan, axis](std::string& bytes, std::size_t i) { append(bytes, scan.normals[i][axis]); }});
  }
  constexpr std::array<const char*, 3> kChannels{"Red", "Green", "Blue"};
  for (std::size_t c = 0; c < 3 && !scan.colours.empty(); ++c) {
    fields.push_back({fmt::format(R"(<color{} type="Integer" minimum="0" maximum="255"/>)", kChannels[c]), 1,
                      [&scan, c](std::string& bytes, std::size_t i) { append(bytes, scan.colours[i][c]); }});
  }
  if (!scan.intensities.empty()) {
    fields.push_back({R"(<intensity type="Float" precision="single"/>)", 4,
                      [&scan](std::string& bytes, std::size_t i) { append(bytes, scan.intensities[i]); }});
  }
  return fields;
}

/// Appends the binary section of a scan to the logical bytes of the file; its physical offset.
std::uint64_t append_points(std::string& file, const E57Scan& scan, const std::vector<Field>& fields) {
  const std::size_t section = file.size();
  const std::size_t first_packet = section + 32;
  file.append(32, '\0');
  std::size_t record = 0;
  for (const Field& field : fields) record += field.size;
  const std::size_t head = 6 + 2 * fields.size();
  const std::size_t most = (kLargestPacket - head - 3) / record;
  const std::size_t count = scan.positions_mm.size();
  for (std::size_t begin = 0; begin < count; begin += most) {
    const std::size_t end = std::min(count, begin + most);
    std::size_t length = head + (end - begin) * record;
    const std::size_t padding = (4 - length % 4) % 4;  // packets are a multiple of four bytes long
    length += padding;
    append(file, std::uint8_t{1});
    append(file, std::uint8_t{0});
    append(file, static_cast<std::uint16_t>(length - 1));
    append(file, static_cast<std::uint16_t>(fields.size()));
    for (const Field& field : fields) append(file, static_cast<std::uint16_t>((end - begin) * field.size));
    for (const Field& field : fields) {
      for (std::size_t i = begin; i < end; ++i) field.put(file, i);
    }
    file.append(padding, '\0');
  }
  if (count == 0) {  // a section has at least one packet: an empty one
    append(file, std::uint8_t{1});
    append(file, std::uint8_t{0});
    const std::size_t padding = (4 - head % 4) % 4;
    append(file, static_cast<std::uint16_t>(head + padding - 1));
    append(file, static_cast<std::uint16_t>(fields.size()));
    file.append(2 * fields.size() + padding, '\0');
  }
  const std::size_t index_packet = file.size();
  append(file, std::uint8_t{0});
  append(file, std::uint8_t{0});
  append(file, std::uint16_t{31});
  append(file, std::uint16_t{1});  // one entry: record 0 is in the first packet
  append(file, std::uint8_t{0});
  file.append(9, '\0');
  append(file, std::uint64_t{0});
  append(file, physical(first_packet));

  std::string header;
  append(header, std::uint8_t{1});
  header.append(7, '\0');
  append(header, static_cast<std::uint64_t>(file.size() - section));
  append(header, physical(first_packet));
  append(header, physical(index_packet));
  file.replace(section, header.size(), header);
  return physical(section);
}

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '<') {
      result += "&lt;";
    } else if (c == '&') {
      result += "&amp;";
    } else if (c == '>') {
      result += "&gt;";
    } else if (static_cast<unsigned char>(c) >= 0x20) {
      result += c;
    }
  }
  return result;
}

/// A globally unique name that follows from the content, so that equal scans give equal files.
std::string guid_of(std::string_view content) {
  const std::string digest = sha256(content);
  return fmt::format("{{{}-{}-{}-{}-{}}}", digest.substr(0, 8), digest.substr(8, 4), digest.substr(12, 4),
                     digest.substr(16, 4), digest.substr(20, 12));
}

std::string real(std::string_view name, double value) {
  return fmt::format("<{0} type=\"Float\">{1:.17g}</{0}>\n", name, value);
}

std::string pose_xml(const Pose& pose) {
  const Eigen::Quaterniond turn(pose.linear());
  const Eigen::Vector3d metres = kMetresPerMillimetre * pose.translation();
  return "<pose type=\"Structure\">\n<rotation type=\"Structure\">\n" + real("w", turn.w()) + real("x", turn.x()) +
         real("y", turn.y()) + real("z", turn.z()) + "</rotation>\n<translation type=\"Structure\">\n" +
         real("x", metres.x()) + real("y", metres.y()) + real("z", metres.z()) + "</translation>\n</pose>\n";
}

std::string bounds_xml(const E57Scan& scan) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : scan.positions_mm) {
    if (p.allFinite()) box.extend(kMetresPerMillimetre * p);
  }
  if (box.isEmpty()) return {};
  std::string text = "<cartesianBounds type=\"Structure\">\n";
  constexpr std::array<const char*, 3> kAxes{"x", "y", "z"};
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const char* name = kAxes[static_cast<std::size_t>(axis)];
    text +=
        real(fmt::format("{}Minimum", name), box.min()[axis]) + real(fmt::format("{}Maximum", name), box.max()[axis]);
  }
  return text + "</cartesianBounds>\n";
}

std::string limits_xml(const E57Scan& scan) {
  std::string text;
  if (!scan.intensities.empty()) {
    const auto [low, high] = std::ranges::minmax(scan.intensities);
    text += "<intensityLimits type=\"Structure\">\n" + real("intensityMinimum", static_cast<double>(low)) +
            real("intensityMaximum", static_cast<double>(high)) + "</intensityLimits>\n";
  }
  if (scan.colours.empty()) return text;
  text += "<colorLimits type=\"Structure\">\n";
  for (const char* channel : {"Red", "Green", "Blue"}) {
    text += fmt::format(
        "<color{0}Minimum type=\"Integer\">0</color{0}Minimum>\n"
        "<color{0}Maximum type=\"Integer\">255</color{0}Maximum>\n",
        channel);
  }
  return text + "</colorLimits>\n";
}

std::string scan_xml(const E57Scan& scan, const std::vector<Field>& fields, std::uint64_t offset, std::string guid) {
  std::string text = fmt::format("<vectorChild type=\"Structure\">\n<guid type=\"String\">{}</guid>\n", guid);
  text += fmt::format("<name type=\"String\">{}</name>\n", escaped(scan.name));
  if (scan.file_from_scan) text += pose_xml(*scan.file_from_scan);
  text += bounds_xml(scan) + limits_xml(scan);
  text += fmt::format(
      "<points type=\"CompressedVector\" fileOffset=\"{}\" recordCount=\"{}\">\n"
      "<prototype type=\"Structure\">\n",
      offset, scan.positions_mm.size());
  for (const Field& field : fields) text += field.prototype + "\n";
  return text +
         "</prototype>\n<codecs type=\"Vector\" allowHeterogeneousChildren=\"1\">\n</codecs>\n</points>\n"
         "</vectorChild>\n";
}

/// Cuts logical bytes into pages, each with its checksum.
std::string paged(std::string_view logical) {
  std::string file;
  file.reserve(logical.size() / kPayload * kPage + kPage);
  for (std::size_t at = 0; at < logical.size(); at += kPayload) {
    std::string page(logical.substr(at, kPayload));
    page.resize(kPayload, '\0');
    const std::uint32_t checksum = crc32c(page);
    for (int shift = 24; shift >= 0; shift -= 8) page += static_cast<char>((checksum >> shift) & 0xffu);
    file += page;
  }
  return file;
}

}  // namespace

Result<void> write_e57(const std::filesystem::path& path, std::span<const E57Scan> scans) {
  std::string logical(kHeaderSize, '\0');
  std::string data3d;
  for (const E57Scan& scan : scans) {
    const std::size_t count = scan.positions_mm.size();
    const auto fits = [&](std::size_t size) { return size == 0 || size == count; };
    if (!fits(scan.normals.size()) || !fits(scan.colours.size()) || !fits(scan.intensities.size())) {
      return fail(ErrorCode::invalid_argument,
                  fmt::format("scan '{}' has {} points, but other numbers of normals, colours or intensities",
                              scan.name, count));
    }
    const std::vector<Field> fields = fields_of(scan);
    const std::size_t begin = logical.size();
    const std::uint64_t offset = append_points(logical, scan, fields);
    data3d += scan_xml(scan, fields, offset, guid_of(scan.name + logical.substr(begin)));
    logical.resize((logical.size() + 3) / 4 * 4, '\0');
  }
  const std::string xml =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<e57Root type=\"Structure\" xmlns=\"http://www.astm.org/COMMIT/E57/2010-e57-v1.0\" "
      "xmlns:nor=\"http://www.libe57.org/E57_NOR_surface_normals.txt\">\n"
      "<formatName type=\"String\">ASTM E57 3D Imaging Data File</formatName>\n"
      "<guid type=\"String\">" +
      guid_of(data3d) +
      "</guid>\n<versionMajor type=\"Integer\">1</versionMajor>\n<versionMinor type=\"Integer\">0</versionMinor>\n"
      "<e57LibraryVersion type=\"String\">asbuilt</e57LibraryVersion>\n<coordinateMetadata "
      "type=\"String\"></coordinateMetadata>\n"
      "<data3D type=\"Vector\" allowHeterogeneousChildren=\"1\">\n" +
      data3d + "</data3D>\n<images2D type=\"Vector\" allowHeterogeneousChildren=\"1\">\n</images2D>\n</e57Root>\n";
  const std::uint64_t xml_offset = physical(logical.size());
  logical += xml;
  const std::uint64_t pages = (logical.size() + kPayload - 1) / kPayload;
  std::string header = "ASTM-E57";
  append(header, std::uint32_t{1});
  append(header, std::uint32_t{0});
  append(header, pages * kPage);
  append(header, xml_offset);
  append(header, static_cast<std::uint64_t>(xml.size()));
  append(header, std::uint64_t{kPage});
  logical.replace(0, kHeaderSize, header);
  return write_file(path, paged(logical));
}

}  // namespace asbuilt::io
