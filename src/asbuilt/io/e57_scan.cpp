// SPDX-License-Identifier: Apache-2.0
// E57 (ASTM E2807-11): several scans a file, each in the frame of its sensor, with a pose that places it in the file.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include "asbuilt/core/parallel.h"
#include "asbuilt/io/e57_pages.h"
#include "asbuilt/io/e57_points.h"
#include "asbuilt/io/number.h"
#include "asbuilt/io/readers.h"
#include "asbuilt/io/scan_assembly.h"
#include "asbuilt/io/xml.h"

namespace asbuilt::io {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// The value of a numeric element. E57 leaves the text out where the value is 0.
std::optional<double> value_of(const XmlElement* element) {
  if (element == nullptr) return std::nullopt;
  std::string_view text = element->text;
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  if (begin == std::string_view::npos) return 0.0;
  text = text.substr(begin, text.find_last_not_of(" \t\r\n") - begin + 1);
  auto value = parse_number(text);
  if (value && element->attribute("type").value_or("") == "ScaledInteger") {
    *value = *value * parse_number(element->attribute("scale").value_or("1")).value_or(1.0) +
             parse_number(element->attribute("offset").value_or("0")).value_or(0.0);
  }
  return value;
}

double number_in(const XmlElement& parent, std::string_view name, double absent) {
  return value_of(parent.child(name)).value_or(absent);
}

/// The fields of three names, if all are there.
std::optional<std::array<std::size_t, 3>> fields_named(const E57Points& points,
                                                       const std::array<std::string_view, 3>& names) {
  std::array<std::size_t, 3> fields{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto field = points.find(names[i]);
    if (field < 0) return std::nullopt;
    fields[i] = static_cast<std::size_t>(field);
  }
  return fields;
}

/// Columns of a batch by what they mean; -1 where the file does not have them.
struct Columns {
  std::vector<std::size_t> wanted;  ///< fields of the file
  std::array<std::ptrdiff_t, 3> position{-1, -1, -1}, normal{-1, -1, -1}, colour{-1, -1, -1};
  std::ptrdiff_t invalid = -1, intensity = -1, row = -1, column = -1;
  bool is_spherical = false;

  std::ptrdiff_t add(std::ptrdiff_t field) {
    if (field < 0) return -1;
    wanted.push_back(static_cast<std::size_t>(field));
    return static_cast<std::ptrdiff_t>(wanted.size()) - 1;
  }
  void add(const std::array<std::size_t, 3>& fields, std::array<std::ptrdiff_t, 3>& columns) {
    for (std::size_t i = 0; i < 3; ++i) columns[i] = add(static_cast<std::ptrdiff_t>(fields[i]));
  }
};

std::optional<Columns> columns_of(const E57Points& points) {
  Columns columns;
  auto position = fields_named(points, {"cartesianX", "cartesianY", "cartesianZ"});
  columns.is_spherical = !position;
  if (!position) position = fields_named(points, {"sphericalRange", "sphericalAzimuth", "sphericalElevation"});
  if (!position) return std::nullopt;
  columns.add(*position, columns.position);
  columns.invalid = columns.add(points.find(columns.is_spherical ? "sphericalInvalidState" : "cartesianInvalidState"));
  if (const auto normal = fields_named(points, {"nor:normalX", "nor:normalY", "nor:normalZ"})) {
    columns.add(*normal, columns.normal);
  }
  if (const auto colour = fields_named(points, {"colorRed", "colorGreen", "colorBlue"})) {
    columns.add(*colour, columns.colour);
  }
  columns.intensity = columns.add(points.find("intensity"));
  columns.row = columns.add(points.find("rowIndex"));
  columns.column = columns.add(points.find("columnIndex"));
  return columns;
}

/// How a colour becomes a byte: from the limits that the file states, else from those of the field's type.
struct ColourScale {
  std::array<double, 3> low{}, factor{};

  [[nodiscard]] std::uint8_t operator()(std::size_t channel, double value) const {
    return nearest_byte((value - low[channel]) * factor[channel]);
  }
};

ColourScale colour_scale(const XmlElement& scan, const E57Points& points, const Columns& columns) {
  constexpr std::array<std::string_view, 3> kNames{"colorRed", "colorGreen", "colorBlue"};
  const XmlElement* limits = scan.child("colorLimits");
  ColourScale scale;
  for (std::size_t i = 0; i < 3; ++i) {
    const E57Field& field = points.fields[columns.wanted[static_cast<std::size_t>(columns.colour[i])]];
    double low = field.smallest, high = field.largest;
    if (limits != nullptr) {
      low = number_in(*limits, fmt::format("{}Minimum", kNames[i]), low);
      high = number_in(*limits, fmt::format("{}Maximum", kNames[i]), high);
    }
    // Reals without limits are shares of 1.
    const bool is_bounded = std::isfinite(high - low) && high > low && high - low < 1e18;
    scale.low[i] = is_bounded ? low : 0.0;
    scale.factor[i] = is_bounded ? 255.0 / (high - low) : 255.0;
  }
  return scale;
}

Eigen::Vector3d cartesian(double range, double azimuth, double elevation) {
  return {range * std::cos(elevation) * std::cos(azimuth), range * std::cos(elevation) * std::sin(azimuth),
          range * std::sin(elevation)};
}

using BatchColumns = std::span<const double* const>;

const double* column_of(BatchColumns batch, std::ptrdiff_t column) { return batch[static_cast<std::size_t>(column)]; }

/// Where points of a batch are, in the file's unit; NaN where the sensor says that there is none.
void read_positions(BatchColumns batch, const Columns& columns, std::size_t first, std::span<Eigen::Vector3d> out) {
  const double* const a = column_of(batch, columns.position[0]) + first;
  const double* const b = column_of(batch, columns.position[1]) + first;
  const double* const c = column_of(batch, columns.position[2]) + first;
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = columns.is_spherical ? cartesian(a[i], b[i], c[i]) : Eigen::Vector3d(a[i], b[i], c[i]);
  }
  if (columns.invalid < 0) return;
  // 1 stands for a mere direction, 2 for nothing at all.
  const double* const invalid = column_of(batch, columns.invalid) + first;
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (invalid[i] != 0.0) out[i].setConstant(kNaN);
  }
}

PointValues<Eigen::Vector3f> normals_of(BatchColumns batch, const Columns& columns) {
  return values_by_row<Eigen::Vector3f>([x = column_of(batch, columns.normal[0]),
                                         y = column_of(batch, columns.normal[1]),
                                         z = column_of(batch, columns.normal[2])](std::size_t i) {
    return Eigen::Vector3f(Eigen::Vector3d(x[i], y[i], z[i]).cast<float>());
  });
}

PointValues<Rgb> colours_of(BatchColumns batch, const Columns& columns, const ColourScale& scale) {
  return values_by_row<Rgb>([batch, colour = columns.colour, scale](std::size_t i) {
    Rgb rgb;
    for (std::size_t c = 0; c < 3; ++c) rgb[c] = scale(c, column_of(batch, colour[c])[i]);
    return rgb;
  });
}

/// Smallest and largest index of rows or columns.
struct IndexRange {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();

  void extend(double value) { low = std::min(low, value), high = std::max(high, value); }
  [[nodiscard]] std::uint64_t count() const {
    const double count = high - low + 1.0;
    return count >= 1.0 && count < 1e9 ? static_cast<std::uint64_t>(count) : 0;
  }
};

/// Points spread evenly over a scan, which decide on its offset.
class Probes {
 public:
  explicit Probes(std::size_t count) : count_(count) {}

  /// In the order of the file, each point once; `first` is the place of the first one of a batch.
  void offer(std::uint64_t first, std::size_t size, BatchColumns batch, const Columns& columns) {
    for (; next_ < std::min(kOffsetProbes, count_) && probe_index(next_, count_) < first + size; ++next_) {
      Eigen::Vector3d position;
      read_positions(batch, columns, static_cast<std::size_t>(probe_index(next_, count_) - first),
                     std::span(&position, 1));
      positions_.push_back(position);
    }
  }
  [[nodiscard]] Eigen::Vector3d offset_mm(double mm_per_unit) const {
    RawPoints probed;
    probed.count = positions_.size();
    probed.positions = values_in(positions_);
    return precision_offset_mm(probed, mm_per_unit);
  }

 private:
  std::size_t count_, next_ = 0;
  std::vector<Eigen::Vector3d> positions_;
};

class ScanReader {
 public:
  ScanReader(const Input& input, E57Pages& pages, const XmlElement& element, double mm_per_unit,
             const ReadOptions& options)
      : input_(input),
        pages_(pages),
        element_(element),
        mm_per_unit_(mm_per_unit),
        sieve_(options.sieve.get()),
        context_(options.threads()) {}

  Result<ScanFile> read() {
    const XmlElement* points_element = element_.child("points");
    if (points_element == nullptr) return input_.error("the scan has no points");
    ASBUILT_TRY(points, e57_points_of(input_, *points_element));
    const auto columns = columns_of(points);
    if (!columns) return input_.error("the points have neither cartesian nor spherical coordinates");
    if (points.records > 0 && points.records > e57_records_that_fit(pages_, points, columns->wanted)) {
      return input_.error(fmt::format("{} points are declared, the file is too small for them", points.records));
    }
    ScanFile scan;
    scan.format = columns->is_spherical ? "e57 spherical" : "e57";
    if (const XmlElement* name = element_.child("name")) scan.title = name->text;
    if (points.records > 0) ASBUILT_CHECK(read_points(points, *columns, scan));
    ASBUILT_CHECK(place(scan, columns->is_spherical));
    return scan;
  }

 private:
  Result<void> read_points(const E57Points& points, const Columns& columns, ScanFile& scan) {
    const auto count = static_cast<std::size_t>(points.records);
    Columns reduced = columns;
    reduced.wanted.clear();
    for (auto& column : reduced.position) {
      column = reduced.add(static_cast<std::ptrdiff_t>(columns.wanted[static_cast<std::size_t>(column)]));
    }
    if (columns.invalid >= 0) {
      reduced.invalid =
          reduced.add(static_cast<std::ptrdiff_t>(columns.wanted[static_cast<std::size_t>(columns.invalid)]));
    }
    const auto each_batch = [&](const E57Batch& batch) {
      return for_each_e57_batch(input_, pages_, points, reduced.wanted, context_, batch);
    };
    Probes probes(count);
    if (sieve_ != nullptr && sieve_->applies_to(points.records)) {
      // The sieve needs to know the offset before the first point.
      ASBUILT_CHECK(each_batch([&](std::uint64_t first, std::size_t size, BatchColumns batch) {
        probes.offer(first, size, batch, reduced);
      }));
      scan.offset_mm = probes.offset_mm(mm_per_unit_);
      return read_attributes(points, columns, scan, nullptr);
    }
    ASBUILT_CHECK(read_attributes(points, columns, scan, &probes));
    scan.offset_mm = probes.offset_mm(mm_per_unit_);
    if (scan.offset_mm.isZero(0.0)) return {};
    // Large coordinates are rare; only they are read a second time.
    MovedPositions moved(scan, mm_per_unit_);
    ASBUILT_CHECK(each_batch([&](std::uint64_t first, std::size_t size, BatchColumns batch) {
      if (first + size > scan.cloud.size()) return;  // called off half-way
      move_positions(batch, reduced, moved, std::span(scan.cloud.positions).subspan(first, size));
    }));
    moved.note();
    return {};
  }

  void move_positions(BatchColumns batch, const Columns& columns, MovedPositions& moved,
                      std::span<Eigen::Vector3f> out) const {
    parallel_for_blocks(context_, out.size(), kPointsAtOnce, [&](std::size_t begin, std::size_t end) {
      std::array<Eigen::Vector3d, kPointsAtOnce> raw;
      const std::span positions(raw.data(), end - begin);
      read_positions(batch, columns, begin, positions);
      moved.move(positions, out.data() + begin);
    });
  }

  /// `probes` is empty where the offset is known already.
  Result<void> read_attributes(const E57Points& points, const Columns& columns, ScanFile& scan, Probes* probes) {
    const auto count = static_cast<std::size_t>(points.records);
    const bool is_sifted = probes == nullptr;
    const bool has_colour = columns.colour[0] >= 0;
    ColourScale colour;
    if (has_colour) colour = colour_scale(element_, points, columns);
    if (!is_sifted) {
      scan.cloud.positions.reserve(count);
      if (columns.normal[0] >= 0) scan.cloud.normals.reserve(count);
      if (has_colour) scan.colours.reserve(count);
      if (columns.intensity >= 0) scan.intensities.reserve(count);
    }
    MovedPositions moved(scan, mm_per_unit_);
    SievedPoints kept(scan, sieve_, points.records, context_);
    IndexRange rows, grid_columns;
    std::vector<Eigen::Vector3f> positions;
    const auto take = [&](std::uint64_t first, std::size_t size, BatchColumns batch) {
      if (kept.cancelled()) return;
      if (probes != nullptr) probes->offer(first, size, batch, columns);
      positions.resize(size);
      move_positions(batch, columns, moved, positions);
      kept.add(positions, [&](std::span<const std::uint32_t> staying) {
        if (columns.normal[0] >= 0) {
          append_values(scan.cloud.normals, normals_of(batch, columns), 0, staying, context_);
        }
        if (has_colour) append_values(scan.colours, colours_of(batch, columns, colour), 0, staying, context_);
        if (columns.intensity >= 0) {
          const auto intensity = [column = column_of(batch, columns.intensity)](std::size_t i) {
            return static_cast<float>(column[i]);
          };
          append_values(scan.intensities, values_by_row<float>(intensity), 0, staying, context_);
        }
      });
      if (columns.row >= 0 && columns.column >= 0) {
        for (std::size_t i = 0; i < size; ++i) {
          rows.extend(column_of(batch, columns.row)[i]);
          grid_columns.extend(column_of(batch, columns.column)[i]);
        }
      }
    };
    ASBUILT_CHECK(for_each_e57_batch(input_, pages_, points, columns.wanted, context_, take));
    kept.finish();
    if (is_sifted) moved.note();
    if (rows.count() > 0 && grid_columns.count() > 0) scan.grid = ScanGrid{rows.count(), grid_columns.count()};
    return {};
  }

  /// Pose and viewpoint. A pose says that the sensor stood at the origin of the scan's frame, and so do spherical
  /// coordinates; an identity alone is what writers put there without knowing.
  Result<void> place(ScanFile& scan, bool is_spherical) {
    if (is_spherical) scan.viewpoint_mm = Eigen::Vector3d::Zero();
    const XmlElement* element = element_.child("pose");
    if (element == nullptr) return {};
    Pose pose = Pose::Identity();
    if (const XmlElement* rotation = element->child("rotation")) {
      const Eigen::Quaterniond turn(number_in(*rotation, "w", 1.0), number_in(*rotation, "x", 0.0),
                                    number_in(*rotation, "y", 0.0), number_in(*rotation, "z", 0.0));
      if (std::abs(turn.norm() - 1.0) < 0.01) {
        pose.linear() = turn.normalized().toRotationMatrix();
      } else {
        scan.notes.push_back(fmt::format(
            "The pose's rotation is a quaternion of length {:.3g}, expected 1; the pose was ignored.", turn.norm()));
        return {};
      }
    }
    if (const XmlElement* translation = element->child("translation")) {
      pose.translation() =
          mm_per_unit_ * Eigen::Vector3d(number_in(*translation, "x", 0.0), number_in(*translation, "y", 0.0),
                                         number_in(*translation, "z", 0.0));
    }
    if (!pose.matrix().allFinite()) {
      scan.notes.emplace_back("The pose is not finite and was ignored.");
      return {};
    }
    scan.file_from_scan = pose;
    if (!pose.matrix().isIdentity(1e-12)) scan.viewpoint_mm = Eigen::Vector3d::Zero();
    return {};
  }

  const Input& input_;
  E57Pages& pages_;
  const XmlElement& element_;
  double mm_per_unit_;
  const PointSieve* sieve_;
  Context context_;
};

}  // namespace

Result<std::vector<ScanFile>> read_e57_scans(const std::filesystem::path& path, const Input& input,
                                             const ReadOptions& options) {
  ASBUILT_TRY(pages, E57Pages::open(input));
  ASBUILT_TRY(xml, pages.xml());
  ASBUILT_TRY(root, parse_xml({input.name + ", XML section", xml}));
  if (root.name != "e57Root")
    return input.error(fmt::format("the XML section holds {}, expected e57Root", in_quotes(root.name)));
  const XmlElement* data = root.child("data3D");
  if (data == nullptr || data->children.empty()) return input.error("the E57 file is valid and holds no scan");

  const Unit unit = options.unit == Unit::stated ? Unit::metre : options.unit;
  std::vector<Result<ScanFile>> scans;
  for (std::size_t i = 0; i < data->children.size(); ++i) {
    Input part = input;
    if (data->children.size() > 1) part.name += fmt::format(", scan {}", i);
    scans.push_back(ScanReader(part, pages, data->children[i], millimetres_per(unit), options).read());
  }
  ASBUILT_TRY(whole, readable_of(path, std::move(scans)));
  for (ScanFile& scan : whole) {
    scan.unit = unit;
    if (unit != Unit::metre) {
      scan.notes.push_back(
          fmt::format("E57 files are in metres by their standard; as you said, {} was taken instead.", name_of(unit)));
    }
  }
  return std::move(whole);
}

}  // namespace asbuilt::io
