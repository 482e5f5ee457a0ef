// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/e57_points.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "asbuilt/core/parallel.h"
#include "asbuilt/io/number.h"

namespace asbuilt::io {
namespace {

constexpr std::size_t kBatch = 32768, kGrain = 2048;  // records that go on together, and that a thread decodes
constexpr std::size_t kPadding = 16;                  // so that eight bytes may be loaded at any bit of a stream

template <class T>
T little_at(const char* bytes) {
  std::array<char, sizeof(T)> copy;
  std::memcpy(copy.data(), bytes, sizeof(T));
  if constexpr (std::endian::native != std::endian::little) std::ranges::reverse(copy);
  return std::bit_cast<T>(copy);
}

/// The bytes of one field, packet after packet one unbroken stream, and how they become numbers.
class FieldStream {
 public:
  explicit FieldStream(const E57Field& field) : field_(field), bytes_(kPadding, '\0') {}

  void append(std::string_view bytes) {
    const auto used = static_cast<std::size_t>(bit_ / 8);
    bytes_.erase(0, used);
    bit_ -= 8 * static_cast<std::uint64_t>(used);
    bytes_.insert(size(), bytes);
  }

  [[nodiscard]] std::uint64_t records() const {
    if (field_.bits == 0) return std::numeric_limits<std::uint64_t>::max();
    return (8 * static_cast<std::uint64_t>(size()) - bit_) / field_.bits;
  }

  /// The `count` records after the first `begin` that were not taken. By any thread.
  void read(std::size_t begin, std::size_t count, double* values) const {
    const std::uint64_t bit = bit_ + static_cast<std::uint64_t>(begin) * field_.bits;
    switch (field_.kind) {
      case E57Field::Kind::float32:
        read_floats<float>(bit, count, values);
        break;
      case E57Field::Kind::float64:
        read_floats<double>(bit, count, values);
        break;
      case E57Field::Kind::integer:
        read_integers(bit, count, values, 1.0, 0.0);
        break;
      default:
        read_integers(bit, count, values, field_.scale, field_.offset);
    }
  }
  void take(std::size_t count) { bit_ += static_cast<std::uint64_t>(count) * field_.bits; }

 private:
  [[nodiscard]] std::size_t size() const { return bytes_.size() - kPadding; }

  template <class T>
  void read_floats(std::uint64_t bit, std::size_t count, double* values) const {
    const char* next = bytes_.data() + bit / 8;
    for (std::size_t i = 0; i < count; ++i, next += sizeof(T)) values[i] = static_cast<double>(little_at<T>(next));
  }

  void read_integers(std::uint64_t bit, std::size_t count, double* values, double scale, double offset) const {
    const unsigned bits = field_.bits;
    const std::uint64_t mask = bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
    for (std::size_t i = 0; i < count; ++i, bit += bits) {
      const char* word = bytes_.data() + bit / 8;
      const auto shift = static_cast<unsigned>(bit % 8);
      std::uint64_t raw = little_at<std::uint64_t>(word) >> shift;
      if (bits + shift > 64) raw |= std::uint64_t{static_cast<unsigned char>(word[8])} << (64 - shift);
      // Unsigned sums wrap where signed ones would overflow.
      const std::uint64_t sum = static_cast<std::uint64_t>(field_.minimum) + (raw & mask);
      values[i] = static_cast<double>(static_cast<std::int64_t>(sum)) * scale + offset;
    }
  }

  const E57Field& field_;
  std::string bytes_;
  std::uint64_t bit_ = 0;  // the first that was not taken
};

std::optional<std::int64_t> integer_of(std::optional<std::string_view> text, std::int64_t absent) {
  if (!text || text->empty()) return absent;
  return parse_integer(*text);
}

std::optional<double> real_of(std::optional<std::string_view> text, double absent) {
  if (!text || text->empty()) return absent;
  return parse_number(*text);
}

Result<E57Field> field_of(const Input& input, const XmlElement& element) {
  E57Field field;
  field.name = element.name;
  const auto wrong = [&](std::string_view what) {
    return input.error(fmt::format("field {} of the points {}", in_quotes(element.name), what));
  };
  const std::string_view type = element.attribute("type").value_or("");
  if (type == "Float") {
    const bool is_single = element.attribute("precision").value_or("double") == "single";
    field.kind = is_single ? E57Field::Kind::float32 : E57Field::Kind::float64;
    field.bits = is_single ? 32 : 64;
    const auto low = real_of(element.attribute("minimum"), -std::numeric_limits<double>::max());
    const auto high = real_of(element.attribute("maximum"), std::numeric_limits<double>::max());
    if (!low || !high) return wrong("has limits that are no numbers");
    field.smallest = *low, field.largest = *high;
    return field;
  }
  if (type != "Integer" && type != "ScaledInteger") {
    field.kind = E57Field::Kind::other;
    return field;
  }
  field.kind = type == "Integer" ? E57Field::Kind::integer : E57Field::Kind::scaled_integer;
  const auto low = integer_of(element.attribute("minimum"), std::numeric_limits<std::int64_t>::min());
  const auto high = integer_of(element.attribute("maximum"), std::numeric_limits<std::int64_t>::max());
  if (!low || !high || *low > *high) return wrong("has limits that are no range of integers");
  if (type == "ScaledInteger") {
    const auto scale = real_of(element.attribute("scale"), 1.0), offset = real_of(element.attribute("offset"), 0.0);
    if (!scale || !offset || !std::isfinite(*scale) || !std::isfinite(*offset) || *scale == 0.0) {
      return wrong("has a scale or an offset that makes no sense");
    }
    field.scale = *scale, field.offset = *offset;
  }
  field.minimum = *low;
  field.range = static_cast<std::uint64_t>(*high) - static_cast<std::uint64_t>(*low);
  field.bits = static_cast<unsigned>(std::bit_width(field.range));
  field.smallest = static_cast<double>(*low) * field.scale + field.offset;
  field.largest = static_cast<double>(*high) * field.scale + field.offset;
  return field;
}

/// Steps through the packets of a binary section.
class PacketReader {
 public:
  PacketReader(const Input& input, E57Pages& pages) : input_(input), pages_(pages) {}

  Result<void> open(const E57Points& points) {
    ASBUILT_TRY(section, pages_.logical_from_physical(points.physical_offset, "the points"));
    std::array<char, 32> header;
    ASBUILT_CHECK(pages_.read(section, header));
    if (header[0] != 1) {
      return input_.error_at_byte(static_cast<std::size_t>(points.physical_offset),
                                  fmt::format("found section type {}, expected 1 for points", int{header[0]}));
    }
    const auto length = little_at<std::uint64_t>(header.data() + 8);
    if (length > pages_.logical_size() - section) {
      return input_.error_at_byte(
          static_cast<std::size_t>(points.physical_offset) + 8,
          fmt::format("the points take {} bytes, the file only has {} there", length, pages_.logical_size() - section));
    }
    end_ = section + length;
    ASBUILT_TRY(first, pages_.logical_from_physical(little_at<std::uint64_t>(header.data() + 16), "the first packet"));
    next_ = first;
    return {};
  }

  /// The next data packet, without its header, and its table of lengths before the streams; false at the end.
  Result<bool> next() {
    while (next_ + 4 <= end_) {
      std::array<char, 6> header{};
      ASBUILT_CHECK(pages_.read(next_, std::span(header).first(4)));
      const std::size_t length = std::size_t{little_at<std::uint16_t>(header.data() + 2)} + 1;
      const int type = static_cast<unsigned char>(header[0]);
      if (type > 2) return error(fmt::format("found packet type {}, expected 0, 1 or 2", type));
      if (length < 4 || length > end_ - next_) {
        return error(fmt::format("a packet has {} bytes, {} are left of the points", length, end_ - next_));
      }
      packet_.resize(length);
      ASBUILT_CHECK(pages_.read(next_, packet_));
      begin_ = next_;
      next_ += length;
      if (type == 1) return true;  // the others are an index, or empty
    }
    return false;
  }

  /// The stream of each field in the packet. Errors: lengths that do not fit into it.
  Result<void> split(std::size_t fields, std::vector<std::string_view>& streams) const {
    const std::size_t table = 6 + 2 * fields;
    const std::string_view packet(packet_.data(), packet_.size());
    if (packet.size() < table || little_at<std::uint16_t>(packet.data() + 4) != fields) {
      return error_in_packet(fmt::format("a packet does not hold the {} fields that are declared", fields));
    }
    streams.clear();
    std::size_t at = table;
    for (std::size_t i = 0; i < fields; ++i) {
      const std::size_t length = little_at<std::uint16_t>(packet.data() + 6 + 2 * i);
      if (length > packet.size() - at) return error_in_packet("the fields of a packet are longer than the packet");
      streams.push_back(packet.substr(at, length));
      at += length;
    }
    return {};
  }

  [[nodiscard]] tl::unexpected<Error> error(std::string_view what) const { return error_at(next_, what); }

 private:
  [[nodiscard]] tl::unexpected<Error> error_in_packet(std::string_view what) const { return error_at(begin_, what); }
  [[nodiscard]] tl::unexpected<Error> error_at(std::uint64_t logical, std::string_view what) const {
    return input_.error_at_byte(static_cast<std::size_t>(pages_.physical_from_logical(logical)), what);
  }

  const Input& input_;
  E57Pages& pages_;
  std::uint64_t begin_ = 0, next_ = 0, end_ = 0;
  std::vector<char> packet_;
};

}  // namespace

std::ptrdiff_t E57Points::find(std::string_view name) const {
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (fields[i].name == name) return fields[i].is_number() ? static_cast<std::ptrdiff_t>(i) : -1;
  }
  return -1;
}

Result<E57Points> e57_points_of(const Input& input, const XmlElement& element) {
  E57Points points;
  if (element.attribute("type").value_or("") != "CompressedVector") {
    return input.error("the points are no CompressedVector");
  }
  const auto offset = parse_count(element.attribute("fileOffset").value_or(""));
  const auto records = parse_count(element.attribute("recordCount").value_or(""));
  if (!offset || !records) return input.error("the points have no fileOffset or no recordCount");
  points.physical_offset = *offset;
  points.records = *records;
  const XmlElement* prototype = element.child("prototype");
  if (prototype == nullptr) return input.error("the points have no prototype");
  for (const XmlElement& child : prototype->children) {
    ASBUILT_TRY(field, field_of(input, child));
    points.fields.push_back(std::move(field));
  }
  // Fields of other codecs than the one of the standard could not be told from damaged ones.
  if (const XmlElement* codecs = element.child("codecs"); codecs != nullptr && !codecs->children.empty()) {
    return input.error("the points are packed by a codec that is not in the standard, export the file again");
  }
  return points;
}

std::uint64_t e57_records_that_fit(const E57Pages& pages, const E57Points& points,
                                   std::span<const std::size_t> wanted) {
  std::uint64_t bits = 0;
  for (const std::size_t field : wanted) bits += points.fields[field].bits;
  return bits == 0 ? 1 : 8 * pages.logical_size() / bits;
}

Result<void> for_each_e57_batch(const Input& input, E57Pages& pages, const E57Points& points,
                                std::span<const std::size_t> wanted, const Context& context, const E57Batch& batch) {
  PacketReader packets(input, pages);
  ASBUILT_CHECK(packets.open(points));
  std::vector<FieldStream> streams;
  for (const std::size_t field : wanted) streams.emplace_back(points.fields[field]);
  const auto most = static_cast<std::size_t>(std::min<std::uint64_t>(points.records, kBatch));
  std::vector<std::vector<double>> values(wanted.size(), std::vector<double>(most));
  std::vector<const double*> columns;
  for (const auto& column : values) columns.push_back(column.data());

  std::uint64_t done = 0, ready = 0;
  std::vector<std::string_view> pieces;
  while (done < points.records) {
    const std::uint64_t left = points.records - done;
    while (ready < std::min<std::uint64_t>(left, kBatch)) {
      ASBUILT_TRY(is_there, packets.next());
      if (!is_there) {
        return packets.error(
            fmt::format("the points end after {} of {}, the file seems to be damaged", done + ready, points.records));
      }
      ASBUILT_CHECK(packets.split(points.fields.size(), pieces));
      ready = left;
      for (std::size_t i = 0; i < streams.size(); ++i) {
        streams[i].append(pieces[wanted[i]]);
        ready = std::min(ready, streams[i].records());
      }
    }
    const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(ready, kBatch));
    parallel_for_blocks(context, count, kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = 0; i < streams.size(); ++i) streams[i].read(begin, end - begin, values[i].data() + begin);
    });
    for (FieldStream& stream : streams) stream.take(count);
    batch(done, count, columns);
    done += count;
    ready -= count;
  }
  return {};
}

}  // namespace asbuilt::io
