// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "asbuilt/io/lines.h"
#include "asbuilt/io/number.h"
#include "asbuilt/io/polygons.h"
#include "asbuilt/io/readers.h"

namespace asbuilt::io {
namespace {

/// Vertices and faces; every other keyword (groups, materials, curves) is passed over.
class ObjReader {
 public:
  explicit ObjReader(const Input& input) : input_(input), lines_(input.content) {}

  Result<TriangleMesh> read() {
    while (next_line()) {
      WordCursor words(line_);
      const std::string_view keyword = words.next();
      if (keyword == "v") ASBUILT_CHECK(read_vertex(words));
      if (keyword == "f" || keyword == "fo") ASBUILT_CHECK(read_face(words));
    }
    ASBUILT_CHECK(make_triangles());
    return std::move(mesh_);
  }

 private:
  struct Face {
    std::size_t end;   ///< of its corners in corners_
    std::size_t line;  ///< where it stands
  };

  [[nodiscard]] tl::unexpected<Error> error(std::string_view what) const {
    return input_.error_at_line(first_line_, what);
  }

  /// A line, with those that a backslash at its end ties to it.
  bool next_line() {
    if (!lines_.next()) return false;
    line_ = lines_.line();
    first_line_ = lines_.number();
    if (!line_.ends_with('\\')) return true;
    joined_ = line_;
    while (joined_.ends_with('\\')) {
      joined_.back() = ' ';
      if (!lines_.next()) break;
      joined_ += lines_.line();
    }
    line_ = joined_;
    return true;
  }

  Result<void> read_vertex(WordCursor& words) {
    if (mesh_.vertices.size() >= kMostVertices) return error("there are more vertices than a mesh can index");
    Eigen::Vector3d vertex;
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view word = words.next();
      const auto number = parse_number(word);
      if (!number) return error(fmt::format("found {}, expected 'v X Y Z'", in_quotes(word)));
      vertex[axis] = *number;
    }
    mesh_.vertices.push_back(vertex);
    return {};
  }

  /// Corners V, V/T, V//N or V/T/N, counted from 1, or from the last vertex backwards when negative.
  Result<void> read_face(WordCursor& words) {
    for (std::string_view word = words.next(); !word.empty() && !word.starts_with('#'); word = words.next()) {
      const auto index = parse_integer(word.substr(0, word.find('/')));
      if (!index || *index == 0)
        return error(fmt::format("found {}, expected a vertex index, counted from 1", in_quotes(word)));
      const auto read_so_far = static_cast<std::int64_t>(mesh_.vertices.size());
      const std::int64_t corner = *index > 0 ? *index - 1 : read_so_far + *index;
      if (corner < 0)
        return error(fmt::format("index {} reaches back beyond the {} vertices so far", *index, read_so_far));
      corners_.push_back(corner);
    }
    const std::size_t count = corners_.size() - (faces_.empty() ? 0 : faces_.back().end);
    if (count < 3) return error(fmt::format("a face has {} corners, expected at least 3", count));
    faces_.push_back({corners_.size(), first_line_});
    return {};
  }

  /// At the end, because a face may name a vertex that comes later.
  Result<void> make_triangles() {
    std::size_t begin = 0;
    for (const Face& face : faces_) {
      const std::span<const std::int64_t> corners(corners_.data() + begin, face.end - begin);
      if (const auto wrong = append_fan(corners, mesh_.vertices.size(), mesh_.triangles)) {
        return input_.error_at_line(face.line, fmt::format("a face names vertex {}, the file has {} vertices",
                                                           *wrong + 1, mesh_.vertices.size()));
      }
      begin = face.end;
    }
    return {};
  }

  const Input& input_;
  LineCursor lines_;
  std::string_view line_;
  std::string joined_;
  std::size_t first_line_ = 0;
  TriangleMesh mesh_;
  std::vector<std::int64_t> corners_;
  std::vector<Face> faces_;
};

}  // namespace

Result<TriangleMesh> read_obj_mesh(const Input& input) { return ObjReader(input).read(); }

}  // namespace asbuilt::io
