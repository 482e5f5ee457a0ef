// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "asbuilt/core/result.h"
#include "asbuilt/io/input.h"
#include "asbuilt/io/lines.h"
#include "asbuilt/io/ply_header.h"
#include "asbuilt/io/scalar_load.h"

namespace asbuilt::io {

/// The scalar properties of an element. Binary rows of fixed size are decoded where they lie (so the file's content
/// must outlive the table), all others are parsed into `decoded`.
struct PlyTable {
  std::size_t rows = 0;
  std::vector<StridedColumn> columns;  ///< one per property; a list has no `load`
  std::vector<double> decoded;
  std::string_view lies_in_file;  ///< the rows, where they were not parsed
};

/// The entries of one list property, row after row.
struct PlyLists {
  std::vector<std::int64_t> values;
  std::vector<std::size_t> ends;  ///< row i holds values[ends[i - 1], ends[i])
};

/// Reads the elements of a PLY file in the order in which they stand. No memory is taken for rows that
/// the rest of the file cannot hold, whatever the header declares. Errors: unreadable_input with line or byte, and how
/// many rows there were.
class PlyBody {
 public:
  PlyBody(const Input& input, const PlyHeader& header);

  [[nodiscard]] Result<PlyTable> read_scalars(const PlyElement& element);
  [[nodiscard]] Result<PlyLists> read_lists(const PlyElement& element, std::size_t property);
  [[nodiscard]] Result<void> skip(const PlyElement& element);

  /// Bytes behind what has been read so far.
  [[nodiscard]] std::size_t bytes_left() const;
  /// Whether the last line that was read had no line end (ascii only): its last value may be cut off.
  [[nodiscard]] bool last_line_is_open() const { return !lines_.is_ended(); }

 private:
  template <class Visitor>
  Result<void> walk(const PlyElement& element, Visitor& visitor);
  template <class Visitor>
  Result<void> walk_ascii(const PlyElement& element, Visitor& visitor);
  template <class Visitor>
  Result<void> walk_binary(const PlyElement& element, Visitor& visitor);
  [[nodiscard]] PlyTable view_of(const PlyElement& element) const;
  [[nodiscard]] std::uint64_t rows_that_fit(const PlyElement& element) const;
  [[nodiscard]] tl::unexpected<Error> ends_after(const PlyElement& element, std::uint64_t rows) const;

  const Input& input_;
  PlyEncoding encoding_;
  std::size_t position_;  ///< next byte of a binary body
  LineCursor lines_;      ///< of an ascii body
};

}  // namespace asbuilt::io
