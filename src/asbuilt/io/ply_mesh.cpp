// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "asbuilt/io/ply_body.h"
#include "asbuilt/io/ply_header.h"
#include "asbuilt/io/polygons.h"
#include "asbuilt/io/readers.h"

namespace asbuilt::io {
namespace {

Result<std::vector<Eigen::Vector3d>> read_vertices(const Input& input, PlyBody& body, const PlyElement& element) {
  const auto x = element.find("x"), y = element.find("y"), z = element.find("z");
  ASBUILT_TRY(table, body.read_scalars(element));
  for (const auto& column : {x, y, z}) {
    if (!column || element.properties[*column].is_list())
      return input.error("the vertices have no properties x, y and z");
  }
  if (table.rows > kMostVertices)
    return input.error(fmt::format("{} vertices are more than a mesh can index", table.rows));
  std::vector<Eigen::Vector3d> vertices;
  vertices.reserve(table.rows);
  for (std::size_t i = 0; i < table.rows; ++i) {
    vertices.emplace_back(table.columns[*x][i], table.columns[*y][i], table.columns[*z][i]);
  }
  return vertices;
}

Result<PlyLists> read_faces(const Input& input, PlyBody& body, const PlyElement& element) {
  auto property = element.find("vertex_indices");
  if (!property) property = element.find("vertex_index");
  if (!property || !element.properties[*property].is_list()) {
    return input.error("the faces have no list property vertex_indices");
  }
  return body.read_lists(element, *property);
}

}  // namespace

Result<TriangleMesh> read_ply_mesh(const Input& input) {
  ASBUILT_TRY(header, read_ply_header(input));
  const auto vertex = header.find_element("vertex"), face = header.find_element("face");
  if (!vertex) return input.error("the PLY header declares no element 'vertex'");
  if (!face) return input.error("the PLY header declares no element 'face', expected a mesh of polygons");

  TriangleMesh mesh;
  PlyLists faces;
  PlyBody body(input, header);
  for (std::size_t e = 0; e <= std::max(*vertex, *face); ++e) {
    if (e == *vertex) {
      ASBUILT_TRY(vertices, read_vertices(input, body, header.elements[e]));
      mesh.vertices = std::move(vertices);
    } else if (e == *face) {
      ASBUILT_TRY(lists, read_faces(input, body, header.elements[e]));
      faces = std::move(lists);
    } else {
      ASBUILT_CHECK(body.skip(header.elements[e]));
    }
  }
  mesh.triangles.reserve(faces.ends.size());
  for (std::size_t row = 0, begin = 0; row < faces.ends.size(); begin = faces.ends[row++]) {
    const std::span<const std::int64_t> corners(faces.values.data() + begin, faces.ends[row] - begin);
    if (const auto wrong = append_fan(corners, mesh.vertices.size(), mesh.triangles)) {
      return input.error(
          fmt::format("face {} names vertex {}, the file has {} vertices", row, *wrong, mesh.vertices.size()));
    }
  }
  return mesh;
}

}  // namespace asbuilt::io
