// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "asbuilt/io/json_text.h"
#include "asbuilt/report/describe.h"
#include "asbuilt/report/report_json.h"

namespace asbuilt::report {

using io::json_number;

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

}  // namespace asbuilt::report
