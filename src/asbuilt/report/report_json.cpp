// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/report/report_json.h"

#include <fmt/format.h>

#include <algorithm>

#include "asbuilt/io/json_text.h"
#include "asbuilt/report/describe.h"
#include "asbuilt/report/views.h"

namespace asbuilt::report {
namespace {

using io::json_number;

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
    notes.push_back(fmt::format(
        "the model is open: {} edges have one face only, and next to them the sign has no meaning ({} "
        "measured point{})",
        input.model.report.open_edges, input.deviations.on_open_edges, input.deviations.on_open_edges == 1 ? "" : "s"));
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
    entry["face_name"] = row.face_name.empty() ? Json(nullptr) : Json(row.face_name);
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
          {"mesh_watertight", input.closed_mesh_file ? Json(*input.closed_mesh_file) : Json(nullptr)},
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
                    {"faces", faces_json(input.deviations, input.model.face_names)},
                    {"boxes", boxes_json(input.deviations)},
                    {"regions", regions_json(input.deviations)},
                    {"regions_found", input.deviations.regions_found},
                    {"scans", scans_json(input)},
                    {"graph", graph_json(input.record)},
                    {"refinement", refinement_json(input.record)},
                    {"reference", reference_json(input)},
                    {"options", options_json(input.record.options)},
                    {"files", files_json(input)}};
  return io::json_text(report);
}

}  // namespace asbuilt::report
