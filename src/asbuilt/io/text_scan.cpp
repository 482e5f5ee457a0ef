// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "asbuilt/io/lines.h"
#include "asbuilt/io/number.h"
#include "asbuilt/io/readers.h"
#include "asbuilt/io/scan_assembly.h"
#include "asbuilt/io/text_layout.h"

namespace asbuilt::io {
namespace {

/// The points of one scan. PTS files may hold several, each headed by its count.
struct Block {
  std::vector<Eigen::Vector3d> positions;
  std::vector<Eigen::Vector3f> normals;
  std::vector<Rgb> colours;
  std::vector<float> intensities;
  std::optional<std::uint64_t> declared;
};

class TextReader {
 public:
  TextReader(const Input& input, const TextLayout& layout) : input_(input), layout_(layout), lines_(input.content) {}

  Result<std::vector<Block>> read() {
    while (lines_.next()) {
      if (is_comment(lines_.line()) || lines_.number() == layout_.header_line) continue;
      if (const auto count = count_line(lines_.line())) {
        ASBUILT_CHECK(begin_block(*count));
      } else {
        ASBUILT_CHECK(read_point());
      }
    }
    ASBUILT_CHECK(end_block());
    return std::move(blocks_);
  }

  [[nodiscard]] bool last_line_is_open() const { return !lines_.is_ended(); }

 private:
  [[nodiscard]] tl::unexpected<Error> error(std::string_view what) const {
    return input_.error_at_line(lines_.number(), what);
  }

  Result<void> begin_block(std::uint64_t count) {
    ASBUILT_CHECK(end_block());
    if (!blocks_.empty() && !blocks_.back().declared)
      return error("a count stands between points, expected at least x y z");
    blocks_.emplace_back().declared = count;
    return {};
  }

  Result<void> end_block() const {
    if (blocks_.empty() || !blocks_.back().declared) return {};
    const Block& block = blocks_.back();
    if (block.positions.size() == *block.declared) return {};
    return error(fmt::format("a scan ends after {} of {} points, the file seems to be truncated",
                             block.positions.size(), *block.declared));
  }

  Result<void> read_point() {
    split_fields(lines_.line(), layout_.separator, fields_);
    if (fields_.size() != layout_.columns) {
      return error(fmt::format("the point has {} values, the first one has {}", fields_.size(), layout_.columns));
    }
    // All fields are looked at, also those that are not used: a damaged line must not pass.
    numbers_.clear();
    for (const std::string_view field : fields_) {
      const auto number = parse_field(field, layout_.separator);
      if (!number) return error(fmt::format("found {}, expected a number", in_quotes(field)));
      numbers_.push_back(*number);
    }
    if (blocks_.empty()) blocks_.emplace_back();
    Block& block = blocks_.back();
    if (block.declared && block.positions.size() == *block.declared) {
      return error(fmt::format("there are more points than the {} declared", *block.declared));
    }
    block.positions.push_back(vector_of(layout_.position));
    if (layout_.normal) block.normals.push_back(vector_of(*layout_.normal).cast<float>());
    if (layout_.colour) block.colours.push_back(colour_of(*layout_.colour));
    if (layout_.intensity) block.intensities.push_back(static_cast<float>(numbers_[*layout_.intensity]));
    return {};
  }

  [[nodiscard]] Eigen::Vector3d vector_of(const std::array<std::size_t, 3>& columns) const {
    return {numbers_[columns[0]], numbers_[columns[1]], numbers_[columns[2]]};
  }

  [[nodiscard]] Rgb colour_of(const std::array<std::size_t, 3>& columns) const {
    Rgb rgb;
    for (std::size_t c = 0; c < 3; ++c) {
      const double value = numbers_[columns[c]];
      rgb[c] = static_cast<std::uint8_t>(std::isfinite(value) ? std::clamp(value, 0.0, 255.0) : 0.0);
    }
    return rgb;
  }

  const Input& input_;
  const TextLayout& layout_;
  LineCursor lines_;
  std::vector<Block> blocks_;
  std::vector<std::string_view> fields_;
  std::vector<double> numbers_;
};

std::string format_of(const std::filesystem::path& path) {
  const std::string extension = lower_case(path.extension().string());
  return extension.empty() ? "xyz" : extension.substr(1);
}

}  // namespace

Result<std::vector<ScanFile>> read_text_scan(const std::filesystem::path& path, const Input& input,
                                             const ReadOptions& options) {
  if (input.content.starts_with("\xff\xfe") || input.content.starts_with("\xfe\xff")) {
    return input.error("is text in UTF-16, save it as UTF-8 or ASCII");
  }
  Input text = input;
  if (text.content.starts_with("\xef\xbb\xbf")) text.content.remove_prefix(3);  // a byte order mark
  ASBUILT_TRY(layout, layout_of(text, options.columns));
  TextReader reader(text, layout);
  ASBUILT_TRY(blocks, reader.read());
  std::erase_if(blocks, [](const Block& block) { return block.positions.empty(); });

  std::vector<ScanFile> scans;
  for (const Block& block : blocks) {
    RawPoints points;
    points.count = block.positions.size();
    points.positions = values_in(block.positions);
    if (layout.normal) points.normals = values_in(block.normals);
    if (layout.colour) points.colours = values_in(block.colours);
    if (layout.intensity) points.intensities = values_in(block.intensities);
    ScanFile scan = assemble_scan(path, format_of(path), points, options);
    scan.notes.insert(scan.notes.begin(), layout.notes.begin(), layout.notes.end());
    scan.index_in_file = static_cast<int>(scans.size());
    if (blocks.size() > 1) scan.name += fmt::format("_{:02}", scans.size());
    scans.push_back(std::move(scan));
  }
  if (reader.last_line_is_open()) {
    scans.back().notes.emplace_back("The last line has no line end: its last value may have been cut off.");
  }
  return scans;
}

}  // namespace asbuilt::io
