// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <nlohmann/json.hpp>

#include "asbuilt/io/base64.h"
#include "asbuilt/live/state.h"

namespace asbuilt::live {
namespace {

using Json = nlohmann::ordered_json;

// Names of files need not be UTF-8; what is not becomes a question mark in a diamond.
std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
Json number(const std::optional<double>& value) { return value ? number(*value) : Json(nullptr); }
Json vector(const Eigen::Vector3d& v) { return Json::array({number(v.x()), number(v.y()), number(v.z())}); }
Json vector(const std::optional<Eigen::Vector3d>& v) { return v ? vector(*v) : Json(nullptr); }
Json percent(double share) { return number(100.0 * share); }
Json percent(const std::optional<double>& share) { return share ? percent(*share) : Json(nullptr); }
Json word(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }

Json pose(const std::optional<Pose>& model_from_scan) {
  if (!model_from_scan) return nullptr;
  Json rows = Json::array();
  for (Eigen::Index r = 0; r < 4; ++r) {
    for (Eigen::Index c = 0; c < 4; ++c) rows.push_back(number(model_from_scan->matrix()(r, c)));
  }
  return rows;
}

Json json(const WeakDirection& weak) {
  return {{"kind", weak.is_rotation ? "rotation" : "translation"},
          {"direction", vector(weak.direction)},
          {"sigma", number(weak.sigma_mm)},
          {"unheld", weak.unheld},
          {"text", weak.text}};
}

Json json(const ScanState& scan, std::size_t index, const LiveState& state) {
  Json links = Json::array(), weak = Json::array();
  const auto self = static_cast<int>(index);
  for (const LinkState& link : state.links) {
    if (link.a != self && link.b != self) continue;
    links.push_back({{"to", link.a == self ? link.b : link.a},
                     {"overlap", number(link.overlap)},
                     {"firmness", link.firmness},
                     {"used", link.used}});
  }
  for (const WeakDirection& direction : scan.weak_directions) weak.push_back(json(direction));
  const io::ScanRecord& record = scan.record;
  return {{"index", index},
          {"file", scan.file},
          {"name", record.name},
          {"index_in_file", record.index_in_file},
          {"instance", record.instance},
          {"arrival", scan.arrival},
          {"status", io::name_of(record.status)},
          {"provisional", scan.provisional},
          {"reason_code", record.reason_code},
          {"reason", record.reason},
          {"sentence", scan.sentence},
          {"points", record.points},
          {"part_points", record.segment_points},
          {"noise_sigma", number(record.noise_sigma)},
          {"spacing", number(record.spacing)},
          {"score", number(record.score)},
          {"new_percent", percent(scan.new_share)},
          {"covers_percent", percent(scan.covered_share)},
          {"component", scan.piece ? Json(*scan.piece) : Json(nullptr)},
          {"refined", scan.refined},
          {"model_from_scan", pose(record.model_from_scan)},
          {"viewpoint", vector(scan.viewpoint_in_model)},
          {"view_direction", vector(scan.view_direction_in_model)},
          {"links", links},
          {"weak_directions", weak},
          {"seconds", number(scan.seconds)}};
}

Json json(const LinkState& link) {
  return {{"a", link.a},
          {"b", link.b},
          {"overlap", number(link.overlap)},
          {"used", link.used},
          {"firmness", link.firmness},
          {"rms", number(link.rms_mm)}};
}

Json json(const PieceState& piece) {
  Json join = nullptr;
  if (piece.join) {
    const auto index = [](int i) { return i < 0 ? Json(nullptr) : Json(i); };
    join = Json{{"text", piece.join->text},
                {"best_overlap", number(piece.join->best_overlap)},
                {"a", index(piece.join->a)},
                {"b", index(piece.join->b)},
                {"view", index(piece.join->view)}};
  }
  return {{"scans", piece.scans}, {"percent", percent(piece.share)}, {"join", join}};
}

Json json(const HoleState& hole) {
  return {{"area", number(hole.hole.area_mm2)},    {"percent", percent(hole.hole.share)},
          {"centre", vector(hole.hole.centre)},    {"normal", vector(hole.hole.normal)},
          {"extent", number(hole.hole.extent_mm)}, {"face", hole.hole.face < 0 ? Json(nullptr) : Json(hole.hole.face)},
          {"reachable", hole.reachable},           {"text", hole.text}};
}

Json json(const ViewState& view) {
  const ViewProposal& proposal = view.proposal;
  const char* purpose = proposal.purpose == Purpose::first  ? "first"
                        : proposal.purpose == Purpose::join ? "join"
                                                            : "coverage";
  return {{"position", vector(proposal.view.position)},
          {"direction", vector(proposal.view.direction())},
          {"target", vector(proposal.view.target)},
          {"distance", number((proposal.view.target - proposal.view.position).norm())},
          {"gain_percent", percent(proposal.gain_share)},
          {"gain_area", number(view.gain_area_mm2)},
          {"overlap", number(proposal.overlap)},
          {"purpose", purpose},
          {"text", view.text}};
}

template <class Item>
Json list(const std::vector<Item>& items) {
  Json all = Json::array();
  for (const Item& item : items) all.push_back(json(item));
  return all;
}

}  // namespace

std::string to_json(const LiveState& state) {
  Json scans = Json::array(), notes = Json::array(), duplicates = Json::array();
  for (std::size_t i = 0; i < state.scans.size(); ++i) scans.push_back(json(state.scans[i], i, state));
  for (const Note& note : state.notes) {
    notes.push_back(
        {{"revision", note.revision}, {"level", note.level}, {"file", word(note.file)}, {"text", note.text}});
  }
  for (const auto& [file, original] : state.duplicates) duplicates.push_back({{"file", file}, {"of", original}});
  const Json unreachable = state.coverable_share ? percent(1.0 - state.coverable_share.value()) : Json(nullptr);
  const bool has_sensor = state.sensor.distance_mm > 0.0;
  return text_of(
      Json{{"schema", 1},
           {"revision", state.revision},
           {"surface_revision", state.surface_revision},
           {"phase", state.phase},
           {"busy_with", word(state.busy_with)},
           {"now",
            {{"level", state.now_level},
             {"headline", state.now_headline},
             {"text", state.now_text},
             {"sound", word(state.now_sound)}}},
           {"model",
            {{"path", state.model.path},
             {"sha256", state.model.sha256},
             {"unit", "mm"},
             {"diameter", number(state.model.diameter)},
             {"min", vector(Eigen::Vector3d(state.box.min()))},
             {"max", vector(Eigen::Vector3d(state.box.max()))},
             {"triangles", state.model.triangles},
             {"symmetry", state.model.symmetry},
             {"faces", state.faces}}},
           {"watch", word(state.watch)},
           {"output", state.output},
           {"coverage",
            {{"percent", percent(state.covered_share)},
             {"twice_percent", percent(state.twice_share)},
             {"coverable_percent", percent(state.coverable_share)},
             {"scanned_area", number(state.covered_share * state.total_area_mm2)},
             {"total_area", number(state.total_area_mm2)}}},
           {"scans", scans},
           {"links", list(state.links)},
           {"pieces", list(state.pieces)},
           {"holes", list(state.holes)},
           {"views", list(state.views)},
           {"sensor",
            {{"half_angle", has_sensor ? number(state.sensor.half_angle_deg) : Json(nullptr)},
             {"near", has_sensor ? number(state.sensor.near_mm) : Json(nullptr)},
             {"far", has_sensor ? number(state.sensor.far_mm) : Json(nullptr)},
             {"distance", has_sensor ? number(state.sensor.distance_mm) : Json(nullptr)},
             {"source", state.sensor.source}}},
           {"unreachable_percent", unreachable},
           {"refinement",
            {{"state", state.refinement},
             {"scans", state.refined_scans},
             {"rms", number(state.refinement_rms_mm)},
             {"dropped", state.dropped_scans}}},
           {"notes", notes},
           {"removed", state.removed},
           {"duplicates", duplicates},
           {"result", {{"state", state.result}, {"folder", word(state.result_folder)}, {"text", state.result_text}}}});
}

std::string to_json(const Surface& surface) {
  std::vector<std::uint32_t> corners;
  for (const auto& t : surface.mesh.triangles) corners.insert(corners.end(), t.begin(), t.end());
  std::string text = R"({"schema":1,"vertices":)" + io::packed_positions_json(surface.mesh.vertices) +
                     R"(,"triangles":)" + io::packed_json(std::span<const std::uint32_t>(corners));
  if (!surface.mesh.faces.empty()) {
    text += R"(,"faces":)" + io::packed_json(std::span<const std::uint32_t>(surface.mesh.faces));
  }
  return text + "}";
}

std::string to_json(const SurfaceValues& values) {
  return R"({"schema":1,"revision":)" + std::to_string(values.revision) + R"(,"support":)" +
         io::packed_json(std::span<const std::uint16_t>(values.support)) + R"(,"deviation":)" +
         io::packed_json(std::span<const float>(values.deviation_mm)) + R"(,"newest":)" +
         io::packed_json(std::span<const std::uint16_t>(values.newest)) + "}";
}

}  // namespace asbuilt::live
