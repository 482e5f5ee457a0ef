// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asbuilt/io/json_text.h"
#include "asbuilt/report/describe.h"
#include "asbuilt/report/report.h"
#include "asbuilt/report/views.h"

namespace asbuilt::report {
namespace {

using Json = nlohmann::ordered_json;
using io::json_number;

Json optional_number(const std::optional<double>& value) { return value ? json_number(*value) : Json(nullptr); }
Json text_or_null(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }
Json triple(const Eigen::Vector3d& v) { return {json_number(v.x()), json_number(v.y()), json_number(v.z())}; }
Json colour_json(const Rgb& rgb) { return {rgb[0], rgb[1], rgb[2]}; }

Json pose_json(const Pose& pose) {
  Json numbers = Json::array();
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) numbers.push_back(json_number(pose.matrix()(row, column)));
  }
  return numbers;
}

Json tolerance_json(const std::optional<inspect::Tolerance>& tolerance) {
  return tolerance ? Json{json_number(tolerance->low_mm), json_number(tolerance->high_mm)} : Json(nullptr);
}

Json statistics_json(const inspect::DeviationStatistics& s) {
  return {{"count", s.count},
          {"min", json_number(s.min)},
          {"max", json_number(s.max)},
          {"mean", json_number(s.mean)},
          {"mean_absolute", json_number(s.mean_absolute)},
          {"rms", json_number(s.rms)},
          {"sigma", json_number(s.sigma)},
          {"sigma_without_noise", optional_number(s.sigma_without_noise)},
          {"mean_positive", json_number(s.mean_positive)},
          {"mean_negative", json_number(s.mean_negative)},
          {"median", json_number(s.median)},
          {"p95", json_number(s.p95)},
          {"p99", json_number(s.p99)},
          {"in_tolerance", optional_number(s.in_tolerance)},
          {"over_tolerance", optional_number(s.over_tolerance)},
          {"under_tolerance", optional_number(s.under_tolerance)}};
}

Json verdict_json(const ReportInput& input) {
  const inspect::DeviationReport& deviations = input.deviations;
  const auto count = [&](inspect::Verdict verdict) {
    return std::ranges::count(deviations.faces, std::optional(verdict), &inspect::SurfacePart::verdict) +
           std::ranges::count(deviations.boxes, std::optional(verdict), &inspect::SurfacePart::verdict);
  };
  return {{"part", deviations.verdict ? Json(inspect::name_of(*deviations.verdict)) : Json(nullptr)},
          {"reason", verdict_reason(input)},
          {"tolerance_given", deviations.verdict.has_value()},
          {"pass", count(inspect::Verdict::pass)},
          {"fail", count(inspect::Verdict::fail)},
          {"not_enough_data", count(inspect::Verdict::not_enough_data)},
          {"not_scanned", count(inspect::Verdict::not_scanned)}};
}

Json notes_json(const ReportInput& input) {
  Json notes = Json::array();
  if (input.model.is_open()) {
    notes.push_back(
        fmt::format("the model is open: {} edges have one face only, and the sign of {} points nearest to them "
                    "has no meaning",
                    input.model.report.open_edges, input.deviations.on_open_edges));
  }
  if (input.deviations.far_points > 0) {
    notes.push_back(fmt::format("{} points lie further than {:.3g} mm from the surface and enter no figure",
                                input.deviations.far_points, input.options.max_distance_ratio * input.model.diameter));
  }
  if (input.model.skin.cad_faces.empty()) {
    notes.push_back("the model is a mesh without CAD faces: faces here are its pieces between sharp edges");
  }
  notes.push_back("times are in timing.json, not here: the same input gives the same report");
  return notes;
}

Json model_json(const ReportInput& input) {
  const io::ModelRecord& model = input.record.model;
  const auto& skin = input.model.skin;
  std::vector<int> faces = skin.cad_faces;
  std::ranges::sort(faces);
  const auto repeated = std::ranges::unique(faces);
  faces.erase(repeated.begin(), repeated.end());
  return {{"path", model.path},
          {"sha256", text_or_null(model.sha256)},
          {"triangles", skin.triangles.size()},
          {"diameter", json_number(input.model.diameter)},
          {"area", json_number(input.deviations.area_mm2)},
          {"open_edges", input.model.report.open_edges},
          {"cad_faces", faces.size()},
          {"symmetry", model.symmetry},
          {"box", {{"min", triple(input.model.box.min())}, {"max", triple(input.model.box.max())}}}};
}

Json measured_json(const ReportInput& input) {
  return {{"path", input.measured ? Json(input.measured->path) : Json(nullptr)},
          {"sha256", input.measured ? text_or_null(input.measured->sha256) : Json(nullptr)},
          {"points", input.points},
          {"far_points", input.deviations.far_points},
          {"spacing", json_number(input.deviations.spacing_mm)},
          {"noise_sigma", json_number(input.deviations.noise_sigma_mm)}};
}

Json alignment_json(const ReportInput& input) {
  const inspect::Alignment& alignment = input.deviations.alignment;
  const bool fitted = alignment.method == inspect::AlignmentMethod::best_fit;
  return {{"method", alignment_method(input)},
          {"detail", alignment_detail(input)},
          {"on", alignment.on},
          {"model_from_given", pose_json(alignment.model_from_given)},
          {"rms_before", fitted ? json_number(alignment.rms_before_mm) : Json(nullptr)},
          {"rms_after", fitted ? json_number(alignment.rms_after_mm) : Json(nullptr)}};
}

std::optional<inspect::Tolerance> tolerance_of_others(const ReportInput& input) {
  return input.options.tolerances.others ? input.options.tolerances.others : input.options.tolerance;
}

Json tolerances_json(const ReportInput& input) {
  if (!input.options.has_tolerance()) return nullptr;
  const auto others = tolerance_of_others(input);
  Json rows = Json::array();
  for (const inspect::ToleranceRow& row : input.options.tolerances.rows) {
    Json entry{
        {"name", row.name}, {"low", json_number(row.tolerance.low_mm)}, {"high", json_number(row.tolerance.high_mm)}};
    entry["face"] = row.face ? Json(*row.face) : Json(nullptr);
    entry["box"] = row.box ? Json{triple(row.box->min()), triple(row.box->max())} : Json(nullptr);
    rows.push_back(std::move(entry));
  }
  const std::string source = input.tolerance_file ? input.tolerance_file->path
                             : others             ? fmt::format("{},{}", others->low_mm, others->high_mm)
                                                  : "";
  return {{"low", others ? json_number(others->low_mm) : Json(nullptr)},
          {"high", others ? json_number(others->high_mm) : Json(nullptr)},
          {"required_share", json_number(input.options.required_share)},
          {"minimum_coverage", json_number(input.options.minimum_coverage)},
          {"source", source},
          {"sha256", input.tolerance_file ? Json(input.tolerance_file->sha256) : Json(nullptr)},
          {"rows", rows}};
}

Json coverage_json(const inspect::DeviationReport& deviations) {
  std::size_t scanned = 0, support = 0;
  for (const inspect::Spot& spot : deviations.spots) {
    scanned += spot.is_scanned() ? 1 : 0;
    support += spot.scans;
  }
  return {{"share", json_number(deviations.coverage)},
          {"area", json_number(deviations.coverage * deviations.area_mm2)},
          {"spots", deviations.spots.size()},
          {"spots_scanned", scanned},
          {"support_mean",
           scanned > 0 ? json_number(static_cast<double>(support) / static_cast<double>(scanned)) : Json(nullptr)}};
}

Json significance_json(const ReportInput& input) {
  std::vector<double> errors;
  for (const inspect::Spot& spot : input.deviations.spots) {
    if (std::isfinite(spot.standard_error_mm)) errors.push_back(static_cast<double>(spot.standard_error_mm));
  }
  Json middle = nullptr;
  if (!errors.empty()) {
    const auto half = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
    std::ranges::nth_element(errors, half);
    middle = json_number(*half);
  }
  // Two-sided, of a normal error.
  const double confidence = std::erf(input.options.significance / std::sqrt(2.0));
  return {{"confidence", json_number(confidence)},
          {"standard_errors", json_number(input.options.significance)},
          {"significant_share", errors.empty() ? Json(nullptr) : json_number(input.deviations.significant_share)},
          {"standard_error_median", middle}};
}

Json histogram_json(const inspect::DeviationReport& deviations, double range) {
  constexpr int kBins = 60;
  std::vector<std::size_t> counts(kBins, 0);
  std::size_t below = 0, above = 0;
  for (const inspect::Spot& spot : deviations.spots) {
    if (!spot.is_scanned()) continue;
    const double place = (static_cast<double>(spot.deviation_mm) / range + 1.0) * 0.5 * kBins;
    if (place < 0.0) {
      ++below;
    } else if (place >= kBins + 1e-9) {
      ++above;
    } else {
      ++counts[std::min<std::size_t>(static_cast<std::size_t>(place), kBins - 1)];
    }
  }
  return {{"low", json_number(-range)},
          {"high", json_number(range)},
          {"bins", kBins},
          {"over_area", counts},
          {"below", below},
          {"above", above}};
}

Json colours_json(const ColourMap& colours) {
  Json stops = Json::array(), steps = Json::array();
  for (const ColourMap::Stop& stop : colours.stops()) {
    stops.push_back({{"value", json_number(stop.value_mm)}, {"rgb", colour_json(stop.rgb)}});
  }
  for (const ColourMap::Step& step : colours.steps()) {
    steps.push_back(
        {{"from", json_number(step.from_mm)}, {"to", json_number(step.to_mm)}, {"rgb", colour_json(step.rgb)}});
  }
  const auto& tolerance = colours.tolerance();
  return {{"low", json_number(-colours.range_mm())},
          {"high", json_number(colours.range_mm())},
          {"tolerance_low", tolerance ? json_number(tolerance->low_mm) : Json(nullptr)},
          {"tolerance_high", tolerance ? json_number(tolerance->high_mm) : Json(nullptr)},
          {"not_scanned", colour_json(ColourMap::kNotScanned)},
          {"stops", stops},
          {"steps", steps}};
}

Json part_json(const inspect::SurfacePart& part) {
  const inspect::DeviationStatistics& s = part.statistics;
  const auto known = [&](double value) { return s.count > 0 ? json_number(value) : Json(nullptr); };
  return {{"name", part.name},
          {"area", json_number(part.area_mm2)},
          {"coverage", json_number(part.coverage())},
          {"spots", part.spots},
          {"spots_scanned", part.spots_scanned},
          {"verdict", part.verdict ? Json(inspect::name_of(*part.verdict)) : Json(nullptr)},
          {"tolerance", tolerance_json(part.tolerance)},
          {"in_tolerance", optional_number(s.in_tolerance)},
          {"mean", known(s.mean)},
          {"sigma", known(s.sigma)},
          {"rms", known(s.rms)},
          {"min", known(s.min)},
          {"max", known(s.max)},
          {"p95", known(s.p95)},
          {"centre", triple(part.centre)},
          {"normal", triple(part.normal)}};
}

Json faces_json(const inspect::DeviationReport& deviations) {
  Json faces = Json::array();
  for (std::size_t i = 0; i < deviations.faces.size(); ++i) {
    const inspect::SurfacePart& face = deviations.faces[i];
    Json entry{{"index", i}, {"cad_face", face.cad_face >= 0 ? Json(face.cad_face) : Json(nullptr)}};
    entry.update(part_json(face));
    faces.push_back(std::move(entry));
  }
  return faces;
}

Json boxes_json(const inspect::DeviationReport& deviations) {
  Json boxes = Json::array();
  for (std::size_t i = 0; i < deviations.boxes.size(); ++i) {
    Json entry = part_json(deviations.boxes[i]);
    entry["low_corner"] = triple(deviations.box_extents[i].min());
    entry["high_corner"] = triple(deviations.box_extents[i].max());
    boxes.push_back(std::move(entry));
  }
  return boxes;
}

Json regions_json(const inspect::DeviationReport& deviations) {
  Json regions = Json::array();
  for (std::size_t i = 0; i < deviations.regions.size(); ++i) {
    const inspect::Region& region = deviations.regions[i];
    regions.push_back({{"index", i},
                       {"area", json_number(region.area_mm2)},
                       {"spots", region.spots.size()},
                       {"size", triple(region.box.sizes())},
                       {"centre", triple(region.centre)},
                       {"peak", json_number(region.peak.deviation_mm)},
                       {"peak_at", triple(region.peak.point)},
                       {"peak_standard_error", json_number(region.peak.standard_error_mm)},
                       {"mean", json_number(region.mean_mm)},
                       {"limit", json_number(region.limit_mm)},
                       {"excess", json_number(region.peak.deviation_mm - region.limit_mm)},
                       {"face", region.face},
                       {"face_name", deviations.faces[region.face].name},
                       {"significant", region.significant}});
  }
  return regions;
}

Json scans_json(const ReportInput& input) {
  Json scans = Json::array();
  for (std::size_t i = 0; i < input.record.scans.size(); ++i) {
    const io::ScanRecord& scan = input.record.scans[i];
    const LinkSummary links = links_of(input.record, static_cast<int>(i));
    const PlaceError error = place_error(scan, input.model.box.center());
    const std::size_t spots = spots_of(input.deviations, i);
    const auto all = static_cast<double>(std::max<std::size_t>(1, input.deviations.spots.size()));
    scans.push_back({{"index", i},
                     {"name", scan.name},
                     {"path", scan.path},
                     {"sha256", text_or_null(scan.sha256)},
                     {"status", io::name_of(scan.status)},
                     {"reason_code", scan.reason_code},
                     {"reason", scan.reason},
                     {"points", scan.points},
                     {"segment_points", scan.segment_points},
                     {"noise_sigma", json_number(scan.noise_sigma)},
                     {"spacing", json_number(scan.spacing)},
                     {"viewpoint", scan.viewpoint ? triple(*scan.viewpoint) : Json(nullptr)},
                     {"score", json_number(scan.score)},
                     {"visible_share", json_number(scan.visible_share)},
                     {"free_space_violations", json_number(scan.free_space_violations)},
                     {"normal_agreement", json_number(scan.normal_agreement)},
                     {"margin", json_number(scan.margin)},
                     {"component", scan.component ? Json(*scan.component) : Json(nullptr)},
                     {"links", links.links},
                     {"best_overlap", optional_number(links.best_overlap)},
                     {"residual", optional_number(links.residual_mm)},
                     {"position_sigma", optional_number(error.position_mm)},
                     {"rotation_sigma_deg", optional_number(error.rotation_deg)},
                     {"share_of_part", json_number(static_cast<double>(spots) / all)},
                     {"spots", spots},
                     {"warnings", scan.warnings},
                     {"model_from_scan", scan.model_from_scan ? pose_json(*scan.model_from_scan) : Json(nullptr)}});
  }
  return scans;
}

Json graph_json(const io::RunRecord& record) {
  if (!record.graph) return nullptr;
  Json links = Json::array();
  for (const io::OverlapRecord& overlap : record.graph->overlaps) {
    const auto residual = overlap.linked ? residual_of(record, overlap.a, overlap.b) : std::nullopt;
    links.push_back({{"a", overlap.a},
                     {"b", overlap.b},
                     {"overlap", json_number(overlap.overlap)},
                     {"linked", overlap.linked},
                     {"residual", residual ? json_number(residual->rms_mm) : Json(nullptr)},
                     {"pairs", residual ? Json(residual->pairs) : Json(nullptr)}});
  }
  return {{"links", links}, {"components", record.graph->components}};
}

Json refinement_json(const io::RunRecord& record) {
  Json components = Json::array();
  if (!record.refinement) return components;
  for (const io::RefinementRecord& refinement : *record.refinement) {
    components.push_back({{"component", refinement.component},
                          {"fixed_scan", refinement.fixed_scan},
                          {"iterations", refinement.iterations},
                          {"rms_before", json_number(refinement.rms_before)},
                          {"rms_after", json_number(refinement.rms_after)},
                          {"converged", refinement.converged},
                          {"gauge", refinement.gauge_method}});
  }
  return components;
}

Json reference_json(const ReportInput& input) {
  const auto& reference = input.deviations.reference;
  if (!reference) return nullptr;
  Json points = Json::array();
  for (std::size_t i = 0; i < reference->points.size(); ++i) {
    const inspect::ReferencePoint& point = reference->points[i];
    const inspect::ReferenceDeviation& deviation = reference->deviations[i];
    const auto known = [&](double value) { return deviation.measured ? json_number(value) : Json(nullptr); };
    points.push_back(
        {{"name", point.name},
         {"point", triple(point.position)},
         {"sigma", optional_number(point.sigma_mm)},
         {"deviation", known(deviation.deviation_mm)},
         {"standard_error", deviation.standard_error_mm > 0.0 ? known(deviation.standard_error_mm) : Json(nullptr)},
         {"distance", known(deviation.distance_mm)},
         {"status", deviation.measured ? "measured" : "not scanned"},
         {"significant", deviation.significant ? Json(*deviation.significant) : Json(nullptr)}});
  }
  return {{"path", input.reference_file ? Json(input.reference_file->path) : Json(nullptr)},
          {"sha256", input.reference_file ? Json(input.reference_file->sha256) : Json(nullptr)},
          {"search_distance", json_number(reference->search_distance_mm)},
          {"points", points},
          {"statistics", statistics_json(reference->statistics)}};
}

Json options_json(const io::Options& options) {
  Json object = Json::object();
  for (const auto& [name, value] : options) {
    std::visit(
        [&, &key = name](const auto& held) {
          using Held = std::decay_t<decltype(held)>;
          if constexpr (std::is_same_v<Held, double>) {
            object[key] = json_number(held);
          } else {
            object[key] = held;
          }
        },
        value);
  }
  return object;
}

Json files_json(const ReportInput& input) {
  Json views = Json::array();
  if (input.views) {
    for (const View& view : standard_views()) views.push_back("views/" + view.name + ".png");
  }
  const bool has_scans = !input.record.scans.empty();
  return {{"reconstruction", input.cloud_file ? Json(*input.cloud_file) : Json(nullptr)},
          {"mesh", input.mesh_file ? Json(*input.mesh_file) : Json(nullptr)},
          {"points_csv", "points.csv"},
          {"faces_csv", "faces.csv"},
          {"regions_csv", "regions.csv"},
          {"scans_csv", has_scans ? Json("scans.csv") : Json(nullptr)},
          {"reference_csv", input.deviations.reference ? Json("reference.csv") : Json(nullptr)},
          {"views", views},
          {"timing", "timing.json"},
          {"result", has_scans ? Json("result.json") : Json(nullptr)}};
}

}  // namespace

ColourMap colours_of(const ReportInput& input) {
  const auto tolerance = tolerance_of_others(input);
  return {colour_range_mm(input.deviations.over_area.p99, tolerance), tolerance};
}

std::string report_json(const ReportInput& input) {
  const ColourMap colours = colours_of(input);
  const Json report{{"asbuilt", {{"version", input.record.version}, {"report_schema", 1}}},
                    {"command", {{"verb", input.verb}, {"arguments", input.arguments}}},
                    {"unit", "mm"},
                    {"sign", "positive: outside the material"},
                    {"verdict", verdict_json(input)},
                    {"summary", summary_of(input)},
                    {"notes", notes_json(input)},
                    {"model", model_json(input)},
                    {"measured", measured_json(input)},
                    {"alignment", alignment_json(input)},
                    {"tolerance", tolerances_json(input)},
                    {"coverage", coverage_json(input.deviations)},
                    {"significance", significance_json(input)},
                    {"over_area", statistics_json(input.deviations.over_area)},
                    {"over_points", statistics_json(input.deviations.over_points)},
                    {"histogram", histogram_json(input.deviations, colours.range_mm())},
                    {"colours", colours_json(colours)},
                    {"faces", faces_json(input.deviations)},
                    {"boxes", boxes_json(input.deviations)},
                    {"regions", regions_json(input.deviations)},
                    {"scans", scans_json(input)},
                    {"graph", graph_json(input.record)},
                    {"refinement", refinement_json(input.record)},
                    {"reference", reference_json(input)},
                    {"options", options_json(input.record.options)},
                    {"files", files_json(input)}};
  return io::json_text(report);
}

}  // namespace asbuilt::report
