// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/ply_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "asbuilt/io/file.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/io/ply_body.h"
#include "asbuilt/io/ply_header.h"

namespace asbuilt::io {
namespace {

constexpr std::string_view ply_name(float) { return "float"; }
constexpr std::string_view ply_name(double) { return "double"; }
constexpr std::string_view ply_name(std::uint8_t) { return "uchar"; }
constexpr std::string_view ply_name(std::uint16_t) { return "ushort"; }
constexpr std::string_view ply_name(std::int32_t) { return "int"; }

template <class T>
void store_little_endian(T value, char* target) {
  auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if constexpr (std::endian::native == std::endian::big) std::ranges::reverse(bytes);
  std::memcpy(target, bytes.data(), sizeof(T));
}

std::size_t length_of(const PlyColumn& column) {
  return std::visit([](const auto& values) { return values.size(); }, column.values);
}

std::size_t value_size(const PlyColumn& column) {
  return std::visit([](const auto& values) { return sizeof(values[0]); }, column.values);
}

bool is_one_line(const std::string& text) { return text.find_first_of("\r\n") == std::string::npos; }

std::string header_of(std::span<const PlyColumn> columns, std::size_t rows, std::span<const std::string> comments) {
  std::string header = "ply\nformat binary_little_endian 1.0\n";
  for (const std::string& comment : comments) {
    ASBUILT_EXPECT(is_one_line(comment), "PLY comments of one line");
    header += fmt::format("comment {}\n", comment);
  }
  header += fmt::format("element vertex {}\n", rows);
  for (const PlyColumn& column : columns) {
    const bool is_word = !column.name.empty() && column.name.find_first_of(" \t\r\n") == std::string::npos;
    ASBUILT_EXPECT(is_word, "PLY columns named by one word");
    const std::string_view type =
        std::visit([](const auto& v) { return ply_name(std::decay_t<decltype(v[0])>{}); }, column.values);
    header += fmt::format("property {} {}\n", type, column.name);
  }
  return header + "end_header\n";
}

}  // namespace

Result<void> write_ply(const std::filesystem::path& path, std::span<const PlyColumn> columns,
                       std::span<const std::string> comments) {
  const std::size_t rows = columns.empty() ? 0 : length_of(columns.front());
  std::size_t stride = 0;
  for (const PlyColumn& column : columns) {
    ASBUILT_EXPECT(length_of(column) == rows, "PLY columns of one length");
    stride += value_size(column);
  }
  std::string content = header_of(columns, rows, comments);
  std::size_t target = content.size();
  content.resize(content.size() + rows * stride);
  for (const PlyColumn& column : columns) {
    std::visit(
        [&](const auto& values) {
          for (std::size_t i = 0; i < rows; ++i) store_little_endian(values[i], content.data() + target + i * stride);
        },
        column.values);
    target += value_size(column);
  }
  return write_file(path, content);
}

Result<void> write_mesh_ply(const std::filesystem::path& path, const TriangleMesh& mesh) {
  return write_mesh_ply(path, mesh, {});
}

Result<void> write_mesh_ply(const std::filesystem::path& path, const TriangleMesh& mesh, const VertexValues& values) {
  const bool has_faces = !mesh.cad_faces.empty();
  const bool has_deviation = !values.deviation_mm.empty(), has_colours = !values.colours.empty();
  ASBUILT_EXPECT(!has_deviation || values.deviation_mm.size() == mesh.vertices.size(), "a deviation per vertex");
  ASBUILT_EXPECT(!has_colours || values.colours.size() == mesh.vertices.size(), "a colour per vertex");
  const bool has_filled = !values.filled.empty();
  ASBUILT_EXPECT(!has_filled || values.filled.size() == mesh.vertices.size(), "a mark per vertex");
  constexpr std::size_t kCornerBytes = sizeof(std::int32_t);
  const std::size_t vertex_bytes =
      3 * sizeof(double) + (has_deviation ? sizeof(float) : 0) + (has_colours ? 3 : 0) + (has_filled ? 1 : 0);
  const std::size_t face_bytes = 1 + (has_faces ? 4 : 3) * kCornerBytes;
  std::string content = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double "
      "z\n"
      "{}{}{}element face {}\nproperty list uchar int vertex_indices\n{}end_header\n",
      mesh.vertices.size(), has_deviation ? "property float deviation\n" : "",
      has_colours ? "property uchar red\nproperty uchar green\nproperty uchar blue\n" : "",
      has_filled ? "property uchar filled\n" : "", mesh.triangles.size(), has_faces ? "property int cad_face\n" : "");
  std::size_t target = content.size();
  content.resize(target + mesh.vertices.size() * vertex_bytes + mesh.triangles.size() * face_bytes);
  const auto put = [&](auto value) {
    store_little_endian(value, content.data() + target);
    target += sizeof(value);
  };
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) put(mesh.vertices[i][axis]);
    if (has_deviation) put(values.deviation_mm[i]);
    if (has_colours) {
      for (const std::uint8_t channel : values.colours[i]) put(channel);
    }
    if (has_filled) put(values.filled[i]);
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    put(std::uint8_t{3});
    for (int corner = 0; corner < 3; ++corner) put(std::int32_t{mesh.triangles[i][corner]});
    if (has_faces) put(std::int32_t{mesh.cad_faces[i]});
  }
  return write_file(path, content);
}

const std::vector<double>* PlyVertices::find(const std::string& name) const {
  const auto found = std::ranges::find(names, name);
  return found == names.end() ? nullptr : &columns[static_cast<std::size_t>(found - names.begin())];
}

Result<PlyVertices> read_ply_vertices(const std::filesystem::path& path) {
  ASBUILT_TRY(content, read_file(path));
  const Input input{path.string(), content};
  ASBUILT_TRY(header, read_ply_header(input));
  const auto vertex = header.find_element("vertex");
  if (!vertex) return input.error("the PLY header declares no element 'vertex'");
  PlyBody body(input, header);
  for (std::size_t e = 0; e < *vertex; ++e) ASBUILT_CHECK(body.skip(header.elements[e]));
  const PlyElement& element = header.elements[*vertex];
  ASBUILT_TRY(table, body.read_scalars(element));

  PlyVertices vertices;
  for (std::size_t p = 0; p < element.properties.size(); ++p) {
    if (element.properties[p].is_list()) continue;
    vertices.names.push_back(element.properties[p].name);
    std::vector<double>& values = vertices.columns.emplace_back();
    values.reserve(table.rows);
    for (std::size_t i = 0; i < table.rows; ++i) values.push_back(table.columns[p][i]);
  }
  return vertices;
}

}  // namespace asbuilt::io
