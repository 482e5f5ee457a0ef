// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>

#include "asbuilt/io/lines.h"
#include "asbuilt/io/number.h"
#include "asbuilt/io/polygons.h"
#include "asbuilt/io/readers.h"

namespace asbuilt::io {
namespace {

/// Lines without comments (from # to the end of the line), the empty ones left out.
class OffLines {
 public:
  explicit OffLines(std::string_view content) : lines_(content) {}

  bool next() {
    while (lines_.next_with_content()) {
      line_ = lines_.line().substr(0, lines_.line().find('#'));
      if (!WordCursor(line_).next().empty()) return true;
    }
    return false;
  }
  [[nodiscard]] std::string_view line() const { return line_; }
  [[nodiscard]] std::size_t number() const { return lines_.number(); }

 private:
  LineCursor lines_;
  std::string_view line_;
};

class OffReader {
 public:
  explicit OffReader(const Input& input) : input_(input), lines_(input.content) {}

  Result<TriangleMesh> read() {
    ASBUILT_CHECK(read_head());
    for (std::uint64_t i = 0; i < vertices_; ++i) ASBUILT_CHECK(read_vertex(i));
    for (std::uint64_t i = 0; i < faces_; ++i) ASBUILT_CHECK(read_face(i));
    return std::move(mesh_);
  }

 private:
  [[nodiscard]] tl::unexpected<Error> error(std::string_view what) const {
    return input_.error_at_line(lines_.number(), what);
  }
  [[nodiscard]] tl::unexpected<Error> ends_after(std::uint64_t found, std::uint64_t declared,
                                                 std::string_view what) const {
    return input_.error_at_line(
        lines_.number() + 1,
        fmt::format("the file ends after {} of {} {}, it seems to be truncated", found, declared, what));
  }

  /// The kind, for example OFF or COFF, then the counts, on the same line or the next.
  Result<void> read_head() {
    if (!lines_.next()) return input_.error("the file holds no OFF head");
    WordCursor words(lines_.line());
    const std::string_view kind = words.next();
    constexpr std::array<std::string_view, 8> kKinds{"OFF",   "COFF",   "NOFF",   "CNOFF",
                                                     "STOFF", "STCOFF", "STNOFF", "STCNOFF"};
    if (std::ranges::find(kKinds, kind) == kKinds.end()) {
      return error(fmt::format("found {}, expected OFF, COFF or NOFF in three dimensions", in_quotes(kind)));
    }
    if (words.rest().starts_with("BINARY")) return error("binary OFF is not supported, export as ascii OFF or as PLY");
    if (words.rest().empty()) {
      if (!lines_.next())
        return input_.error_at_line(lines_.number() + 1, "the file ends before the counts of vertices and faces");
      words = WordCursor(lines_.line());
    }
    const auto vertices = parse_count(words.next()), faces = parse_count(words.next());
    if (!vertices || !faces)
      return error(fmt::format("found {}, expected the counts of vertices and faces", in_quotes(lines_.line())));
    if (*vertices > kMostVertices) return error(fmt::format("{} vertices are more than a mesh can index", *vertices));
    vertices_ = *vertices;
    faces_ = *faces;
    return {};
  }

  /// Three coordinates; normals, colours and texture coordinates may follow and are not needed.
  Result<void> read_vertex(std::uint64_t index) {
    if (!lines_.next()) return ends_after(index, vertices_, "vertices");
    WordCursor words(lines_.line());
    Eigen::Vector3d vertex;
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view word = words.next();
      const auto number = parse_number(word);
      if (!number) return error(fmt::format("found {}, expected three coordinates", in_quotes(word)));
      vertex[axis] = *number;
    }
    mesh_.vertices.push_back(vertex);
    return {};
  }

  /// A count and as many vertex indices; a colour may follow.
  Result<void> read_face(std::uint64_t index) {
    if (!lines_.next()) return ends_after(index, faces_, "faces");
    WordCursor words(lines_.line());
    const std::string_view count_word = words.next();
    const auto count = parse_count(count_word);
    if (!count) return error(fmt::format("found {}, expected the number of corners of a face", in_quotes(count_word)));
    corners_.clear();
    for (std::uint64_t i = 0; i < *count; ++i) {
      const std::string_view word = words.next();
      const auto corner = parse_integer(word);
      if (!corner)
        return error(fmt::format("corner {} of {} is {}, expected a vertex index", i, *count, in_quotes(word)));
      corners_.push_back(*corner);
    }
    if (const auto wrong = append_fan(corners_, mesh_.vertices.size(), mesh_.triangles)) {
      return error(fmt::format("face {} names vertex {}, the file has {} vertices", index, *wrong, vertices_));
    }
    return {};
  }

  const Input& input_;
  OffLines lines_;
  TriangleMesh mesh_;
  std::vector<std::int64_t> corners_;
  std::uint64_t vertices_ = 0, faces_ = 0;
};

}  // namespace

Result<TriangleMesh> read_off_mesh(const Input& input) { return OffReader(input).read(); }

}  // namespace asbuilt::io
