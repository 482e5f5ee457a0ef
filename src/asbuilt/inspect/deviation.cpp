// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/inspect/deviation.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "asbuilt/core/median.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/voxel_grid.h"
#include "asbuilt/io/cad_face_name.h"

namespace asbuilt::inspect {
namespace {

constexpr std::size_t kMostNamesInMessage = 6;

Result<void> check_share(std::string_view name, double value) {
  if (value >= 0.0 && value <= 1.0) return {};
  return fail(ErrorCode::invalid_argument, fmt::format("{} is {}, expected a share in [0, 1]", name, value));
}

/// The feet after the alignment that was asked for, which needs those before it.
Result<Feet> aligned_feet(const Measurement& measurement, const model::PreparedModel& model,
                          const InspectOptions& options, Alignment& alignment, const Context& context) {
  ASBUILT_TRY(feet, feet_of(measurement.cloud, Pose::Identity(), model, context));
  ASBUILT_TRY(found, aligned(measurement, feet, model, options.alignment, context));
  alignment = std::move(found);
  if (alignment.method == AlignmentMethod::as_given) return std::move(feet);
  return feet_of(measurement.cloud, alignment.model_from_given, model, context);
}

/// Statistics, with the shares counted value by value, since each may have its own tolerance.
struct ToleranceCount {
  std::size_t judged = 0, over = 0, under = 0;

  void add(double deviation, const Tolerance* tolerance) {
    if (tolerance == nullptr) return;
    ++judged;
    over += deviation > tolerance->high_mm ? 1 : 0;
    under += deviation < tolerance->low_mm ? 1 : 0;
  }
  void write_to(DeviationStatistics& statistics) const {
    if (judged == 0) return;
    const auto count = static_cast<double>(judged);
    statistics.in_tolerance = static_cast<double>(judged - over - under) / count;
    statistics.over_tolerance = static_cast<double>(over) / count;
    statistics.under_tolerance = static_cast<double>(under) / count;
  }
};

/// Each spot's face is that of the triangle it lies on.
std::vector<std::uint32_t> faces_of_spots(const model::PreparedModel& model, const FaceMap& map,
                                          const Context& context) {
  std::vector<std::uint32_t> faces(model.dense_samples.size());
  parallel_for(context, faces.size(), 512, [&](std::size_t i) {
    const Eigen::Vector3d position = model.dense_samples.positions[i].cast<double>();
    faces[i] = map.of_triangle[model.surface->nearest(position).triangle];
  });
  return faces;
}

/// Collects the spots of one face or box.
class PartCollector {
 public:
  explicit PartCollector(const std::string& name, int cad_face = -1) {
    part_.name = name;
    part_.cad_face = cad_face;
  }
  void set_tolerance(const Tolerance& tolerance) { part_.tolerance = tolerance; }

  void add(const Eigen::Vector3f& position, const Eigen::Vector3f& normal, const Spot& spot,
           const Tolerance* tolerance) {
    ++part_.spots;
    part_.centre += position.cast<double>();
    part_.normal += normal.cast<double>();
    if (!spot.is_scanned()) return;
    ++part_.spots_scanned;
    const auto deviation = static_cast<double>(spot.deviation_mm);
    deviations_.push_back(deviation);
    errors_ += static_cast<double>(spot.standard_error_mm) * static_cast<double>(spot.standard_error_mm);
    count_.add(deviation, tolerance);
  }

  SurfacePart finish(double spot_area_mm2, const VerdictRule& rule) {
    part_.area_mm2 = spot_area_mm2 * static_cast<double>(part_.spots);
    if (part_.spots > 0) part_.centre /= static_cast<double>(part_.spots);
    if (part_.normal.norm() > 0.0) part_.normal.normalize();
    part_.statistics = statistics(std::move(deviations_), std::nullopt);
    count_.write_to(part_.statistics);
    take_noise_off(part_.statistics, errors_);
    if (part_.tolerance) part_.verdict = verdict_of(part_, rule);
    return std::move(part_);
  }

  static void take_noise_off(DeviationStatistics& statistics, double sum_of_squared_errors) {
    if (statistics.count == 0 || !std::isfinite(sum_of_squared_errors)) return;
    const double noise = sum_of_squared_errors / static_cast<double>(statistics.count);
    statistics.sigma_without_noise = std::sqrt(std::max(0.0, statistics.sigma * statistics.sigma - noise));
  }

 private:
  SurfacePart part_;
  std::vector<double> deviations_;
  ToleranceCount count_;
  double errors_ = 0.0;
};

/// Three robust sigmas of the spots: what stands out where no drawing says what may.
Tolerance limits_from(std::span<const Spot> spots) {
  std::vector<double> magnitudes;
  for (const Spot& spot : spots) {
    if (spot.is_scanned()) magnitudes.push_back(std::abs(static_cast<double>(spot.deviation_mm)));
  }
  if (magnitudes.empty()) return {};
  const double limit = 3.0 * 1.4826 * median_of(std::move(magnitudes));
  return {-limit, limit};
}

class Inspection {
 public:
  Inspection(const Measurement& measurement, const model::PreparedModel& model, const InspectOptions& options,
             const Context& context)
      : measurement_(measurement), model_(model), options_(options), context_(context) {}

  Result<DeviationReport> run() {
    if (model_.dense_samples.empty()) {
      return fail(ErrorCode::not_possible, "the model has no surface to measure against");
    }
    report_.face_map = faces_of(model_.skin, model_.face_names);
    ASBUILT_CHECK(declare_parts());
    ASBUILT_TRY(feet, aligned_feet(measurement_, model_, options_, report_.alignment, context_));
    context_.report_progress(0.6);
    report_.on_open_edges = feet.on_open_edges;
    describe_points(feet);
    report_.deviation_mm = feet.deviation_mm;
    compare_with_reference(feet);
    find_spots(std::move(feet));
    if (context_.cancelled()) return fail(ErrorCode::cancelled, "the inspection was interrupted");
    describe_area();
    find_regions();
    context_.report_progress(1.0);
    return std::move(report_);
  }

 private:
  [[nodiscard]] double max_distance() const { return options_.max_distance_ratio * model_.diameter; }
  [[nodiscard]] VerdictRule rule() const { return {options_.required_share, options_.minimum_coverage}; }

  /// Faces and boxes with their tolerances, before anything is measured, so that a row for a face that is not there is
  /// found at once.
  Result<void> declare_parts() {
    const auto others = options_.tolerances.others ? options_.tolerances.others : options_.tolerance;
    for (std::size_t i = 0; i < report_.face_map.names.size(); ++i) {
      SurfacePart& face = report_.faces.emplace_back();
      face.name = report_.face_map.names[i];
      face.cad_face = report_.face_map.cad_face[i];
      face.tolerance = others;
    }
    std::vector<int> named;
    for (const ToleranceRow& row : options_.tolerances.rows) {
      if (row.box) {
        SurfacePart& box = report_.boxes.emplace_back();
        box.name = row.name;
        box.tolerance = row.tolerance;
        report_.box_extents.push_back(*row.box);
        continue;
      }
      ASBUILT_TRY(number, number_of_face(row));
      const auto face = std::ranges::find(report_.faces, number, &SurfacePart::cad_face);
      if (face == report_.faces.end()) {
        const std::string what = model_.skin.cad_faces.empty()
                                     ? "but the model is a mesh, without CAD faces; give a box instead"
                                     : "which the model's outer skin has not";
        return refused(row, fmt::format("the row is for {}, {}", io::face_label(number, model_.face_names), what));
      }
      if (std::ranges::count(named, number) > 0) {
        return refused(row, fmt::format("{} is given a second tolerance; keep one of the two rows", face->name));
      }
      named.push_back(number);
      face->tolerance = row.tolerance;
      // A name that the file gives is told beside the CAD's.
      const bool has_own_name = row.name != fmt::format("face {}", number) && row.name != row.face_name;
      if (has_own_name) face->name = fmt::format("{} ({})", row.name, face->name);
    }
    return {};
  }

  [[nodiscard]] tl::unexpected<Error> refused(const ToleranceRow& row, const std::string& why) const {
    const std::string& source = options_.tolerances.source;
    return fail(ErrorCode::invalid_argument,
                fmt::format("{}, line {}: {}", source.empty() ? "the tolerances" : source, row.place, why));
  }

  /// The face that a row is for, by its number or by the one face that has its name.
  [[nodiscard]] Result<int> number_of_face(const ToleranceRow& row) const {
    if (row.face) return *row.face;
    const std::string name = io::clean_cad_name(row.face_name);
    const std::vector<int> same = faces_called([&](const std::string& other) { return other == name; });
    if (same.size() == 1 && !name.empty()) return same.front();
    if (model_.skin.cad_faces.empty()) {
      return refused(row,
                     fmt::format("the row is for the face '{}', but the model is a mesh, without CAD faces; give a "
                                 "box instead: NAME,LOW,HIGH,X1,Y1,Z1,X2,Y2,Z2",
                                 name));
    }
    if (same.size() > 1 && !name.empty()) {
      return refused(row,
                     fmt::format("{} CAD faces are called '{}', expected the name of one; give the number of one: {}",
                                 same.size(), name, some_of(same)));
    }
    const std::vector<int> named = faces_called([](const std::string& other) { return !other.empty(); });
    if (named.empty()) {
      return refused(row,
                     fmt::format("no face is called '{}', as the CAD file names none; give the number of a CAD face, "
                                 "as in faces.csv, or a box: NAME,LOW,HIGH,X1,Y1,Z1,X2,Y2,Z2",
                                 name));
    }
    return refused(row,
                   fmt::format("no CAD face of the outer skin is called '{}', expected a name as in {}; or give the "
                               "number of a face",
                               name, some_of(named)));
  }

  /// Numbers of the CAD faces whose name passes a test.
  template <class Test>
  [[nodiscard]] std::vector<int> faces_called(const Test& test) const {
    std::vector<int> found;
    for (const int face : report_.face_map.cad_face) {
      const auto number = static_cast<std::size_t>(std::max(face, 0));
      if (face >= 0 && number < model_.face_names.size() && test(model_.face_names[number].name)) found.push_back(face);
    }
    return found;
  }

  [[nodiscard]] std::string some_of(const std::vector<int>& faces) const {
    std::vector<std::string> labels;
    for (const int face : faces) {
      if (labels.size() < kMostNamesInMessage) labels.push_back(io::face_label(face, model_.face_names));
    }
    return fmt::format("{}{}", fmt::join(labels, ", "), faces.size() > labels.size() ? " ..." : "");
  }

  void describe_points(const Feet& feet) {
    std::vector<float> counted;
    counted.reserve(feet.deviation_mm.size());
    ToleranceCount tolerances;
    for (std::size_t i = 0; i < feet.deviation_mm.size(); ++i) {
      const float deviation = feet.deviation_mm[i];
      if (!(std::abs(deviation) <= max_distance())) continue;
      counted.push_back(deviation);
      if (!options_.has_tolerance()) continue;
      const std::uint32_t face = report_.face_map.of_triangle[feet.triangles[i]];
      tolerances.add(static_cast<double>(deviation), report_.tolerance_at(face, feet.points[i]));
    }
    report_.far_points = feet.deviation_mm.size() - counted.size();
    report_.over_points = statistics_of_many(std::move(counted), std::nullopt);
    tolerances.write_to(report_.over_points);
  }

  void compare_with_reference(const Feet& feet) {
    if (options_.reference.empty()) return;
    std::vector<Eigen::Vector3f> normals = measurement_.cloud.normals;
    if (normals.empty()) {
      for (const std::uint32_t triangle : feet.triangles) normals.push_back(model_.face_normals[triangle]);
    }
    const double noise = measurement_.sigma_mm.empty() ? 0.0 : static_cast<double>(measurement_.sigma_mm.front());
    report_.reference =
        compared_with(options_.reference, measurement_.cloud, normals, report_.alignment.model_from_given,
                      model_.diameter, noise, options_.reference_distance_mm);
  }

  void find_spots(Feet feet) {
    spacing_ = median_spacing(model_.dense_samples.positions);
    report_.finder = std::make_shared<const SpotFinder>(measurement_, report_.alignment.model_from_given, feet, model_,
                                                        spacing_, max_distance(), context_);
    report_.noise_sigma_mm = report_.finder->noise_sigma_mm();
    report_.spacing_mm = report_.finder->spacing_mm();
    report_.spots = report_.finder->at(model_.dense_samples, context_);
    report_.face_of_spot = faces_of_spots(model_, report_.face_map, context_);
    context_.report_progress(0.9);
  }

  void describe_area() {
    std::vector<PartCollector> faces, boxes;
    for (const SurfacePart& face : report_.faces) faces.emplace_back(face.name, face.cad_face);
    for (const SurfacePart& box : report_.boxes) boxes.emplace_back(box.name);
    for (std::size_t i = 0; i < faces.size(); ++i) {
      if (report_.faces[i].tolerance) faces[i].set_tolerance(*report_.faces[i].tolerance);
    }
    for (std::size_t i = 0; i < boxes.size(); ++i) boxes[i].set_tolerance(*report_.boxes[i].tolerance);
    PartCollector whole("part");
    std::size_t significant = 0;
    for (std::uint32_t i = 0; i < report_.spots.size(); ++i) {
      const Spot& spot = report_.spots[i];
      const Eigen::Vector3f &position = model_.dense_samples.positions[i], &normal = model_.dense_samples.normals[i];
      const Tolerance* tolerance = report_.tolerance_at(report_.face_of_spot[i], position);
      whole.add(position, normal, spot, tolerance);
      faces[report_.face_of_spot[i]].add(position, normal, spot, tolerance);
      for (std::size_t k = 0; k < boxes.size(); ++k) {
        if (!report_.box_extents[k].contains(position.cast<double>())) continue;
        boxes[k].add(position, normal, spot, &*report_.boxes[k].tolerance);
      }
      const double error = static_cast<double>(spot.standard_error_mm);
      if (std::abs(static_cast<double>(spot.deviation_mm)) > options_.significance * error) ++significant;
    }
    const double spot_area = model_.dense_sample_area_mm2;
    const SurfacePart all = whole.finish(spot_area, rule());
    report_.over_area = all.statistics;
    report_.coverage = all.coverage();
    report_.area_mm2 = all.area_mm2;
    if (all.spots_scanned > 0) {
      report_.significant_share = static_cast<double>(significant) / static_cast<double>(all.spots_scanned);
    }
    for (std::size_t i = 0; i < faces.size(); ++i) report_.faces[i] = faces[i].finish(spot_area, rule());
    for (std::size_t i = 0; i < boxes.size(); ++i) report_.boxes[i] = boxes[i].finish(spot_area, rule());
    report_.verdict = verdict_of_all(report_.faces, report_.boxes, report_.coverage, rule());
  }

  void find_regions() {
    report_.region_limits = limits_from(report_.spots);
    const bool judged = options_.has_tolerance();
    RegionOptions options;
    options.spot_area_mm2 = model_.dense_sample_area_mm2;
    options.spacing_mm = spacing_;
    options.significance = options_.significance;
    const auto tolerance_of = [&](std::uint32_t spot) {
      return judged ? report_.tolerance_at(report_.face_of_spot[spot], model_.dense_samples.positions[spot])
                    : &report_.region_limits;
    };
    FoundRegions found = regions_out_of(model_.dense_samples, report_.spots, report_.face_of_spot, tolerance_of,
                                        *report_.finder, options);
    report_.regions = std::move(found.largest);
    report_.regions_found = found.count;
    // Fitted over a plane; the surface may be bent.
    for (Region& region : report_.regions) region.peak.point = model_.surface->nearest(region.peak.point).point;
    report_.region_of_spot.assign(report_.spots.size(), -1);
    for (std::size_t k = 0; k < report_.regions.size(); ++k) {
      for (const std::uint32_t spot : report_.regions[k].spots) {
        report_.region_of_spot[spot] = static_cast<std::int32_t>(k);
      }
    }
  }

  const Measurement& measurement_;
  const model::PreparedModel& model_;
  const InspectOptions& options_;
  const Context& context_;
  DeviationReport report_;
  double spacing_ = 0.0;
};

}  // namespace

Result<void> InspectOptions::validate() const {
  if (!(max_distance_ratio > 0.0 && std::isfinite(max_distance_ratio))) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("max_distance_ratio is {}, expected a share of the diameter above 0", max_distance_ratio));
  }
  ASBUILT_CHECK(check_share("required_share", required_share));
  ASBUILT_CHECK(check_share("minimum_coverage", minimum_coverage));
  if (!(significance > 0.0 && std::isfinite(significance))) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("significance is {}, expected a number of standard errors above 0", significance));
  }
  if (!(reference_distance_mm >= 0.0 && std::isfinite(reference_distance_mm))) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("reference_distance is {} mm, it must not be negative", reference_distance_mm));
  }
  if (!tolerance) return {};
  const bool finite = std::isfinite(tolerance->low_mm) && std::isfinite(tolerance->high_mm);
  if (finite && tolerance->low_mm <= tolerance->high_mm) return {};
  return fail(ErrorCode::invalid_argument, fmt::format("the tolerance is {},{} mm, expected LOW,HIGH with LOW <= HIGH",
                                                       tolerance->low_mm, tolerance->high_mm));
}

const Tolerance* DeviationReport::tolerance_at(std::uint32_t face, const Eigen::Vector3f& position) const {
  for (std::size_t k = 0; k < boxes.size(); ++k) {
    if (box_extents[k].contains(position.cast<double>())) return &*boxes[k].tolerance;
  }
  return faces[face].tolerance ? &*faces[face].tolerance : nullptr;
}

Result<DeviationReport> inspect(const Measurement& measurement, const model::PreparedModel& model,
                                const InspectOptions& options, const Context& context) {
  ASBUILT_CHECK(options.validate());
  return Inspection(measurement, model, options, context).run();
}

Result<DeviationReport> inspect(const PointCloud& cloud_in_model, const model::PreparedModel& model,
                                const InspectOptions& options, const Context& context) {
  return inspect(Measurement{cloud_in_model}, model, options, context);
}

}  // namespace asbuilt::inspect
