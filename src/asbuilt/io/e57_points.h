// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/io/e57_pages.h"
#include "asbuilt/io/input.h"
#include "asbuilt/io/xml.h"

namespace asbuilt::io {

/// One field of the records of a CompressedVector, as its prototype declares it.
struct E57Field {
  enum class Kind { integer, scaled_integer, float32, float64, other };

  std::string name;
  Kind kind = Kind::float64;
  std::int64_t minimum = 0;              ///< of integers: what a raw value of 0 stands for
  std::uint64_t range = 0;               ///< of integers: the largest raw value
  double scale = 1.0, offset = 0.0;      ///< of scaled integers
  double smallest = 0.0, largest = 0.0;  ///< declared limits, scaled
  unsigned bits = 64;                    ///< that a record takes in the stream

  [[nodiscard]] bool is_number() const { return kind != Kind::other; }
};

/// A vector of points: where its records lie, how many they are, and of what.
struct E57Points {
  std::uint64_t physical_offset = 0, records = 0;
  std::vector<E57Field> fields;

  [[nodiscard]] std::ptrdiff_t find(std::string_view name) const;  ///< index of the field; -1 if there is none
};

/// From the XML element `points`. Errors: unreadable_input.
[[nodiscard]] Result<E57Points> e57_points_of(const Input& input, const XmlElement& element);

/// Records [first, first + count) of the fields that were asked for, a column each.
using E57Batch = std::function<void(std::uint64_t first, std::size_t count, std::span<const double* const> columns)>;

/// Decodes the wanted fields in the order of the file, at most 32 768 records at a time: memory does not grow with the
/// number of points. The threads of the context share the decoding; `batch` is called by one. Errors: unreadable_input
/// with the byte, and how many records there were.
[[nodiscard]] Result<void> for_each_e57_batch(const Input& input, E57Pages& pages, const E57Points& points,
                                              std::span<const std::size_t> wanted, const Context& context,
                                              const E57Batch& batch);

/// The most records that the file can hold, whatever it declares: each takes the bits of the wanted fields. Fields
/// without bits are constants.
[[nodiscard]] std::uint64_t e57_records_that_fit(const E57Pages& pages, const E57Points& points,
                                                 std::span<const std::size_t> wanted);

}  // namespace asbuilt::io
