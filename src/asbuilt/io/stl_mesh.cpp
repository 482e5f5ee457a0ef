// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cstdint>

#include "asbuilt/io/file_kind.h"
#include "asbuilt/io/lines.h"
#include "asbuilt/io/number.h"
#include "asbuilt/io/polygons.h"
#include "asbuilt/io/readers.h"
#include "asbuilt/io/scalar_load.h"

namespace asbuilt::io {
namespace {

constexpr std::size_t kHead = 84, kFacet = 50, kNormal = 12;

void append_triangle_of_last_three(TriangleMesh& mesh) {
  const int end = static_cast<int>(mesh.vertices.size());
  mesh.triangles.emplace_back(end - 3, end - 2, end - 1);
}

Result<TriangleMesh> read_binary(const Input& input) {
  const std::string_view bytes = input.content;
  if (bytes.size() < kHead) {
    return input.error(
        fmt::format("{} bytes are too few for an STL file, whose head alone takes {}", bytes.size(), kHead));
  }
  const auto load = load_scalar<float, std::endian::little>;
  const auto declared = static_cast<std::size_t>(load_scalar<std::uint32_t, std::endian::little>(bytes.data() + 80));
  const std::size_t present = (bytes.size() - kHead) / kFacet;
  if (present < declared) {
    return input.error_at_byte(
        bytes.size(),
        fmt::format("the file ends after {} of {} triangles, it seems to be truncated", present, declared));
  }
  if (declared > kMostVertices / 3)
    return input.error(fmt::format("{} triangles are more than a mesh can index", declared));
  TriangleMesh mesh;
  mesh.vertices.reserve(3 * declared);
  mesh.triangles.reserve(declared);
  for (std::size_t i = 0; i < declared; ++i) {
    const char* corner = bytes.data() + kHead + i * kFacet + kNormal;
    for (int c = 0; c < 3; ++c, corner += 12)
      mesh.vertices.emplace_back(load(corner), load(corner + 4), load(corner + 8));
    append_triangle_of_last_three(mesh);
  }
  return mesh;
}

/// The ascii grammar, one keyword a line: solid, then facets of one loop of three vertices, then endsolid.
class AsciiReader {
 public:
  explicit AsciiReader(const Input& input) : input_(input), lines_(input.content) {}

  Result<TriangleMesh> read() {
    while (lines_.next_with_content()) {
      WordCursor words(lines_.line());
      ASBUILT_CHECK(read_line(lower_case(words.next()), words));
    }
    if (in_solid_) {
      return input_.error_at_line(
          lines_.number() + 1,
          fmt::format("the file ends after {} triangles without 'endsolid', it seems to be truncated",
                      mesh_.triangles.size()));
    }
    return std::move(mesh_);
  }

 private:
  [[nodiscard]] tl::unexpected<Error> error(std::string_view what) const {
    return input_.error_at_line(lines_.number(), what);
  }

  Result<void> read_line(const std::string& keyword, WordCursor& words) {
    if (keyword == "vertex") return read_vertex(words);
    if (keyword == "endloop") return end_loop();
    if (keyword == "solid") {
      in_solid_ = true;
      return {};
    }
    if (keyword == "endsolid" && corners_ == 0) {
      in_solid_ = false;
      return {};
    }
    if (keyword == "facet" || keyword == "outer" || keyword == "endfacet" || keyword == "color") return {};
    return error(
        fmt::format("found {}, expected facet, outer loop, vertex, endloop, endfacet or endsolid", in_quotes(keyword)));
  }

  Result<void> read_vertex(WordCursor& words) {
    Eigen::Vector3d vertex;
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view word = words.next();
      const auto number = parse_number(word);
      if (!number) return error(fmt::format("found {}, expected 'vertex X Y Z'", in_quotes(word)));
      vertex[axis] = *number;
    }
    if (!words.rest().empty()) return error(fmt::format("found {} after three coordinates", in_quotes(words.rest())));
    if (mesh_.vertices.size() >= kMostVertices) return error("there are more vertices than a mesh can index");
    mesh_.vertices.push_back(vertex);
    ++corners_;
    return {};
  }

  Result<void> end_loop() {
    if (corners_ != 3) return error(fmt::format("a facet has {} vertices, expected 3", corners_));
    append_triangle_of_last_three(mesh_);
    corners_ = 0;
    return {};
  }

  const Input& input_;
  LineCursor lines_;
  TriangleMesh mesh_;
  int corners_ = 0;  ///< of the loop that is open
  bool in_solid_ = false;
};

}  // namespace

Result<TriangleMesh> read_stl_mesh(const Input& input) {
  return is_ascii_stl(input.content) ? AsciiReader(input).read() : read_binary(input);
}

}  // namespace asbuilt::io
