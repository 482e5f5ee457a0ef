// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "asbuilt/io/json_text.h"
#include "asbuilt/report/report_json.h"

namespace asbuilt::report {

using io::json_number;

namespace {

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

}  // namespace

Json faces_json(const inspect::DeviationReport& deviations, const io::CadFaceNames& names) {
  Json faces = Json::array();
  for (std::size_t i = 0; i < deviations.faces.size(); ++i) {
    const inspect::SurfacePart& face = deviations.faces[i];
    Json entry{{"index", i}, {"cad_face", face.cad_face >= 0 ? Json(face.cad_face) : Json(nullptr)}};
    const auto number = static_cast<std::size_t>(std::max(face.cad_face, 0));
    const bool is_known = face.cad_face >= 0 && number < names.size();
    const auto text = [&](const std::string& name) { return name.empty() ? Json(nullptr) : Json(name); };
    entry["cad_name"] = is_known ? text(names[number].name) : Json(nullptr);
    entry["cad_part"] = is_known ? text(names[number].part) : Json(nullptr);
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

}  // namespace asbuilt::report
