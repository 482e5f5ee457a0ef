// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/run_record.h"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <limits>

#include "asbuilt/io/file.h"
#include "asbuilt/io/json_text.h"

namespace asbuilt::io {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<std::string_view, 6> kStatusNames{"accepted", "ambiguous",    "rejected",
                                                       "dropped",  "disconnected", "failed"};
constexpr std::array<std::string_view, 3> kStateNames{"complete", "partial", "failed"};

// ---- writing

template <int Size>
Json rows_of(const Eigen::Matrix<double, Size, Size>& matrix) {
  Json rows = Json::array();
  for (int r = 0; r < Size; ++r) {
    Json row = Json::array();
    for (int c = 0; c < Size; ++c) row.push_back(json_number(matrix(r, c)));
    rows.push_back(std::move(row));
  }
  return rows;
}

Json json_of(const Pose& pose) { return rows_of<4>(pose.matrix()); }
Json json_of(const Eigen::Vector3d& v) {
  return Json::array({json_number(v.x()), json_number(v.y()), json_number(v.z())});
}
Json json_of(const std::optional<Pose>& pose) { return pose ? json_of(*pose) : Json(nullptr); }

Json json_of(const OptionValue& value) {
  return std::visit(
      [](const auto& held) {
        if constexpr (std::is_same_v<std::decay_t<decltype(held)>, double>)
          return json_number(held);
        else
          return Json(held);
      },
      value);
}

Json json_of(const ModelRecord& model) {
  return {{"path", model.path},
          {"sha256", model.sha256},
          {"triangles", model.triangles},
          {"diameter", json_number(model.diameter)},
          {"sampling_distance", json_number(model.sampling_distance)},
          {"symmetry", model.symmetry}};
}

Json json_of(const CandidateRecord& candidate) {
  return {{"model_from_scan", json_of(candidate.model_from_scan)},
          {"votes", json_number(candidate.votes)},
          {"score", json_number(candidate.score)},
          {"visible_share", json_number(candidate.visible_share)},
          {"free_space_violations", json_number(candidate.free_space_violations)},
          {"normal_agreement", json_number(candidate.normal_agreement)},
          {"rms", json_number(candidate.rms)},
          {"hidden_share", json_number(candidate.hidden_share)},
          {"support", json_number(candidate.support)},
          {"explained_samples", candidate.explained_samples},
          {"facing_share", json_number(candidate.facing_share)},
          {"found_share", json_number(candidate.found_share)},
          {"contradiction_share", json_number(candidate.contradiction_share)},
          {"missing_share", json_number(candidate.missing_share)},
          {"residual_ratio", json_number(candidate.residual_ratio)},
          {"weakest_direction", json_number(candidate.weakest_direction)},
          {"slip_lead", json_number(candidate.slip_lead)},
          {"size_hold", json_number(candidate.size_hold)},
          {"size_lead", json_number(candidate.size_lead)},
          {"lost_end_share", json_number(candidate.lost_end_share)},
          {"pierced_share", json_number(candidate.pierced_share)},
          {"overrun_share", json_number(candidate.overrun_share)},
          {"objection", candidate.objection}};
}

Json json_of(const MotionRecord& motion, bool of_scan) {
  Json json{{"kind", motion.is_turn ? "turn" : "slide"},
            {"direction", json_of(motion.direction)},
            {"through", json_of(motion.through)}};
  if (of_scan) {
    json["sigma"] = json_number(motion.sigma);
    json["unheld"] = motion.unheld;
  }
  return json;
}

Json json_of(const std::vector<MotionRecord>& motions, bool of_scan) {
  Json all = Json::array();
  for (const MotionRecord& motion : motions) all.push_back(json_of(motion, of_scan));
  return all;
}

Json numbers_of(const std::vector<double>& values) {
  Json all = Json::array();
  for (const double value : values) all.push_back(json_number(value));
  return all;
}

Json json_of(const ScanRecord& scan) {
  Json candidates = Json::array();
  for (const CandidateRecord& candidate : scan.candidates) candidates.push_back(json_of(candidate));
  return {{"path", scan.path},
          {"name", scan.name},
          {"index_in_file", scan.index_in_file},
          {"scans_in_file", scan.scans_in_file},
          {"instance", scan.instance},
          {"instances_in_scan", scan.instances_in_scan},
          {"sha256", scan.sha256},
          {"points", scan.points},
          {"viewpoint", scan.viewpoint ? json_of(*scan.viewpoint) : Json(nullptr)},
          {"viewpoint_kind", scan.viewpoint_kind},
          {"viewpoint_source", scan.viewpoint_source},
          {"normals_oriented", scan.normals_oriented},
          {"noise_sigma", json_number(scan.noise_sigma)},
          {"spacing", json_number(scan.spacing)},
          {"offset", json_of(scan.offset)},
          {"status", name_of(scan.status)},
          {"reason_code", scan.reason_code},
          {"reason", scan.reason},
          {"model_from_scan_detected", json_of(scan.model_from_scan_detected)},
          {"model_from_scan", json_of(scan.model_from_scan)},
          {"covariance", scan.covariance ? rows_of<6>(*scan.covariance) : Json(nullptr)},
          {"component", scan.component ? Json(*scan.component) : Json(nullptr)},
          {"hold_sigma", numbers_of(scan.hold_sigma)},
          {"loose_motions", json_of(scan.loose_motions, true)},
          {"votes", json_number(scan.votes)},
          {"score", json_number(scan.score)},
          {"visible_share", json_number(scan.visible_share)},
          {"free_space_violations", json_number(scan.free_space_violations)},
          {"normal_agreement", json_number(scan.normal_agreement)},
          {"margin", json_number(scan.margin)},
          {"candidates", std::move(candidates)},
          {"segment_points", scan.segment_points},
          {"warnings", scan.warnings}};
}

Json json_of(const GraphRecord& graph) {
  Json overlaps = Json::array();
  for (const OverlapRecord& pair : graph.overlaps) {
    overlaps.push_back({{"a", pair.a}, {"b", pair.b}, {"overlap", json_number(pair.overlap)}, {"linked", pair.linked}});
  }
  return {{"overlaps", std::move(overlaps)}, {"components", graph.components}};
}

Json json_of(const RefinementRecord& refinement) {
  Json edges = Json::array();
  for (const EdgeRecord& edge : refinement.edges) {
    edges.push_back({{"from", edge.from}, {"to", edge.to}, {"pairs", edge.pairs}, {"rms", json_number(edge.rms)}});
  }
  Json links = Json::array();
  for (const LinkRecord& link : refinement.links) {
    links.push_back({{"a", link.a},
                     {"b", link.b},
                     {"held", numbers_of(link.held)},
                     {"free_motions", json_of(link.free_motions, false)}});
  }
  return {
      {"component", refinement.component},
      {"fixed_scan", refinement.fixed_scan},
      {"iterations", refinement.iterations},
      {"rms_before", json_number(refinement.rms_before)},
      {"rms_after", json_number(refinement.rms_after)},
      {"converged", refinement.converged},
      {"on_model", refinement.on_model},
      {"gauge", {{"method", refinement.gauge_method}, {"model_from_refined", json_of(refinement.model_from_refined)}}},
      {"edges", std::move(edges)},
      {"links", std::move(links)}};
}

Json json_of(const DeviationRecord& deviation) {
  return {{"mean", json_number(deviation.mean)},
          {"sigma", json_number(deviation.sigma)},
          {"rms", json_number(deviation.rms)},
          {"p95", json_number(deviation.p95)},
          {"in_tolerance", deviation.in_tolerance ? json_number(*deviation.in_tolerance) : Json(nullptr)},
          {"coverage", json_number(deviation.coverage)},
          {"verdict", deviation.verdict.empty() ? Json(nullptr) : Json(deviation.verdict)}};
}

// ---- reading: nlohmann's exceptions name the wrong type; they are caught at the door and become an Error.

double number_at(const Json& object, const char* key) {
  const Json& value = object.at(key);
  return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
}

// Of a field that came later: results of earlier versions do not have it.
double later_number_at(const Json& object, const char* key) {
  return object.contains(key) ? number_at(object, key) : std::numeric_limits<double>::quiet_NaN();
}

template <int Size>
Eigen::Matrix<double, Size, Size> matrix_of(const Json& rows) {
  Eigen::Matrix<double, Size, Size> matrix;
  for (int r = 0; r < Size; ++r) {
    for (int c = 0; c < Size; ++c) {
      matrix(r, c) = rows.at(static_cast<std::size_t>(r)).at(static_cast<std::size_t>(c)).get<double>();
    }
  }
  return matrix;
}

Pose pose_of(const Json& rows) {
  Pose pose = Pose::Identity();
  pose.matrix() = matrix_of<4>(rows);
  return pose;
}
std::optional<Pose> optional_pose(const Json& rows) {
  if (rows.is_null()) return std::nullopt;
  return pose_of(rows);
}

Eigen::Vector3d vector_of(const Json& value) {
  return {value.at(0).get<double>(), value.at(1).get<double>(), value.at(2).get<double>()};
}

OptionValue option_of(const Json& value) {
  if (value.is_boolean()) return value.get<bool>();
  if (value.is_number_integer()) return value.get<std::int64_t>();
  if (value.is_number()) return value.get<double>();
  if (value.is_array()) return value.get<std::vector<std::string>>();
  return value.get<std::string>();
}

template <class Enum, std::size_t Count>
Enum enum_of(const Json& value, const std::array<std::string_view, Count>& names) {
  const auto word = value.get<std::string>();
  for (std::size_t i = 0; i < Count; ++i) {
    if (names[i] == word) return static_cast<Enum>(i);
  }
  throw std::runtime_error(fmt::format("'{}' is none of the known words", word));
}

CandidateRecord candidate_of(const Json& json) {
  CandidateRecord candidate;
  candidate.model_from_scan = pose_of(json.at("model_from_scan"));
  candidate.votes = number_at(json, "votes");
  candidate.score = number_at(json, "score");
  candidate.visible_share = number_at(json, "visible_share");
  candidate.free_space_violations = number_at(json, "free_space_violations");
  candidate.normal_agreement = number_at(json, "normal_agreement");
  candidate.rms = number_at(json, "rms");
  candidate.hidden_share = number_at(json, "hidden_share");
  candidate.support = number_at(json, "support");
  candidate.explained_samples = json.at("explained_samples").get<int>();
  candidate.facing_share = later_number_at(json, "facing_share");
  candidate.found_share = later_number_at(json, "found_share");
  candidate.contradiction_share = later_number_at(json, "contradiction_share");
  candidate.missing_share = later_number_at(json, "missing_share");
  candidate.residual_ratio = later_number_at(json, "residual_ratio");
  candidate.weakest_direction = later_number_at(json, "weakest_direction");
  candidate.slip_lead = later_number_at(json, "slip_lead");
  candidate.size_hold = later_number_at(json, "size_hold");
  candidate.size_lead = later_number_at(json, "size_lead");
  candidate.lost_end_share = later_number_at(json, "lost_end_share");
  candidate.pierced_share = later_number_at(json, "pierced_share");
  candidate.overrun_share = later_number_at(json, "overrun_share");
  candidate.objection = json.value("objection", "");
  return candidate;
}

// What follows is absent from results of versions that did not tell it.
std::vector<double> later_numbers_at(const Json& json, const char* key) {
  std::vector<double> values;
  if (!json.contains(key)) return values;
  for (const Json& value : json.at(key)) {
    values.push_back(value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>());
  }
  return values;
}

std::vector<MotionRecord> later_motions_at(const Json& json, const char* key) {
  constexpr std::array<std::string_view, 2> kKinds{"slide", "turn"};
  std::vector<MotionRecord> motions;
  if (!json.contains(key)) return motions;
  for (const Json& each : json.at(key)) {
    motions.push_back({enum_of<bool>(each.at("kind"), kKinds), vector_of(each.at("direction")),
                       vector_of(each.at("through")), each.contains("sigma") ? number_at(each, "sigma") : 0.0,
                       each.value("unheld", false)});
  }
  return motions;
}

ScanRecord scan_of(const Json& json) {
  ScanRecord scan;
  scan.path = json.at("path").get<std::string>();
  scan.name = json.at("name").get<std::string>();
  scan.index_in_file = json.at("index_in_file").get<int>();
  scan.scans_in_file = json.at("scans_in_file").get<int>();
  scan.instance = json.value("instance", 1);
  scan.instances_in_scan = json.value("instances_in_scan", 1);
  scan.sha256 = json.at("sha256").get<std::string>();
  scan.points = json.at("points").get<std::uint64_t>();
  if (!json.at("viewpoint").is_null()) scan.viewpoint = vector_of(json.at("viewpoint"));
  scan.viewpoint_kind = json.at("viewpoint_kind").get<std::string>();
  scan.viewpoint_source = json.value("viewpoint_source", "none");
  scan.normals_oriented = json.at("normals_oriented").get<bool>();
  scan.noise_sigma = number_at(json, "noise_sigma");
  scan.spacing = number_at(json, "spacing");
  scan.offset = vector_of(json.at("offset"));
  scan.status = enum_of<ScanStatus>(json.at("status"), kStatusNames);
  scan.reason_code = json.at("reason_code").get<std::string>();
  scan.reason = json.at("reason").get<std::string>();
  scan.model_from_scan_detected = optional_pose(json.at("model_from_scan_detected"));
  scan.model_from_scan = optional_pose(json.at("model_from_scan"));
  if (!json.at("covariance").is_null()) scan.covariance = matrix_of<6>(json.at("covariance"));
  if (!json.at("component").is_null()) scan.component = json.at("component").get<int>();
  scan.hold_sigma = later_numbers_at(json, "hold_sigma");
  scan.loose_motions = later_motions_at(json, "loose_motions");
  scan.votes = number_at(json, "votes");
  scan.score = number_at(json, "score");
  scan.visible_share = number_at(json, "visible_share");
  scan.free_space_violations = number_at(json, "free_space_violations");
  scan.normal_agreement = number_at(json, "normal_agreement");
  scan.margin = number_at(json, "margin");
  for (const Json& candidate : json.at("candidates")) scan.candidates.push_back(candidate_of(candidate));
  scan.segment_points = json.at("segment_points").get<std::uint64_t>();
  scan.warnings = json.at("warnings").get<std::vector<std::string>>();
  return scan;
}

GraphRecord graph_of(const Json& json) {
  GraphRecord graph;
  for (const Json& pair : json.at("overlaps")) {
    graph.overlaps.push_back(
        {pair.at("a").get<int>(), pair.at("b").get<int>(), number_at(pair, "overlap"), pair.at("linked").get<bool>()});
  }
  graph.components = json.at("components").get<std::vector<std::vector<int>>>();
  return graph;
}

RefinementRecord refinement_of(const Json& json) {
  RefinementRecord refinement;
  refinement.component = json.at("component").get<int>();
  refinement.fixed_scan = json.at("fixed_scan").get<int>();
  refinement.iterations = json.at("iterations").get<int>();
  refinement.rms_before = number_at(json, "rms_before");
  refinement.rms_after = number_at(json, "rms_after");
  refinement.converged = json.at("converged").get<bool>();
  refinement.on_model = json.value("on_model", false);  // earlier versions did not ask the CAD
  refinement.gauge_method = json.at("gauge").at("method").get<std::string>();
  refinement.model_from_refined = pose_of(json.at("gauge").at("model_from_refined"));
  for (const Json& edge : json.at("edges")) {
    refinement.edges.push_back({edge.at("from").get<int>(), edge.at("to").get<int>(),
                                edge.at("pairs").get<std::uint64_t>(), number_at(edge, "rms")});
  }
  if (!json.contains("links")) return refinement;  // of a version that did not tell them
  for (const Json& link : json.at("links")) {
    refinement.links.push_back({link.at("a").get<int>(), link.at("b").get<int>(), later_numbers_at(link, "held"),
                                later_motions_at(link, "free_motions")});
  }
  return refinement;
}

DeviationRecord deviation_of(const Json& json) {
  DeviationRecord deviation{number_at(json, "mean"),
                            number_at(json, "sigma"),
                            number_at(json, "rms"),
                            number_at(json, "p95"),
                            std::nullopt,
                            number_at(json, "coverage"),
                            {}};
  if (!json.at("in_tolerance").is_null()) deviation.in_tolerance = number_at(json, "in_tolerance");
  // Results of earlier versions have none.
  if (json.contains("verdict") && json["verdict"].is_string()) deviation.verdict = json["verdict"].get<std::string>();
  return deviation;
}

ModelRecord model_of(const Json& json) {
  return {json.at("path").get<std::string>(),        json.at("sha256").get<std::string>(),
          json.at("triangles").get<std::uint64_t>(), number_at(json, "diameter"),
          number_at(json, "sampling_distance"),      json.at("symmetry").get<std::string>()};
}

RunRecord record_of(const Json& json) {
  const int schema = json.at("asbuilt").at("schema").get<int>();
  if (schema != RunRecord::kSchema) {
    throw std::runtime_error(fmt::format("has schema {}, this version reads schema {}", schema, RunRecord::kSchema));
  }
  RunRecord record;
  record.version = json.at("asbuilt").at("version").get<std::string>();
  record.state = enum_of<RunState>(json.at("state"), kStateNames);
  for (const auto& [name, value] : json.at("options").items()) record.options.emplace_back(name, option_of(value));
  record.model = model_of(json.at("model"));
  for (const Json& scan : json.at("scans")) record.scans.push_back(scan_of(scan));
  if (json.contains("graph")) record.graph = graph_of(json.at("graph"));
  if (json.contains("refinement")) {
    record.refinement.emplace();
    for (const Json& item : json.at("refinement")) record.refinement->push_back(refinement_of(item));
  }
  if (json.contains("deviation")) record.deviation = deviation_of(json.at("deviation"));
  return record;
}

/// Runs `read` on the parsed text; whatever nlohmann or `read` throws becomes an error about `name`.
template <class Read>
auto parsed(std::string_view text, std::string_view name, const Read& read) -> Result<decltype(read(Json()))> {
  try {
    return read(Json::parse(text));
  } catch (const std::exception& error) {
    return fail(ErrorCode::unreadable_input, fmt::format("{}: {}; expected what asbuilt writes (result schema {})",
                                                         name, error.what(), RunRecord::kSchema));
  }
}

}  // namespace

std::string_view name_of(ScanStatus status) { return kStatusNames[static_cast<std::size_t>(status)]; }
std::string_view name_of(RunState state) { return kStateNames[static_cast<std::size_t>(state)]; }

std::string to_json(const RunRecord& record) {
  Json options = Json::object();
  for (const auto& [name, value] : record.options) options[name] = json_of(value);
  Json scans = Json::array();
  for (const ScanRecord& scan : record.scans) scans.push_back(json_of(scan));
  Json json{{"asbuilt", {{"version", record.version}, {"schema", RunRecord::kSchema}}},
            {"state", name_of(record.state)},
            {"unit", "mm"},
            {"options", std::move(options)},
            {"model", json_of(record.model)},
            {"scans", std::move(scans)}};
  if (record.graph) json["graph"] = json_of(*record.graph);
  if (record.refinement) {
    json["refinement"] = Json::array();
    for (const RefinementRecord& refinement : *record.refinement) json["refinement"].push_back(json_of(refinement));
  }
  if (record.deviation) json["deviation"] = json_of(*record.deviation);
  return json_text(json);
}

Result<RunRecord> run_record_from_json(std::string_view text, std::string_view name) {
  return parsed(text, name, record_of);
}

Result<RunRecord> read_run_record(const std::filesystem::path& result_json) {
  ASBUILT_TRY(text, read_file(result_json));
  return run_record_from_json(text, result_json.string());
}

std::filesystem::path segment_file(std::size_t scan_index, std::string_view scan_name) {
  std::string name;
  for (const char c : scan_name) {
    const auto byte = static_cast<unsigned char>(c);
    name += std::isalnum(byte) != 0 || c == '-' || c == '_' || c == '.' || byte >= 0x80 ? c : '_';
  }
  return std::filesystem::path("segments") / fmt::format("{:03}_{}.ply", scan_index, name.substr(0, 200));
}

std::string to_json(const TimingRecord& timing) {
  Json stages = Json::array();
  for (const StageTime& stage : timing.stages) {
    stages.push_back({{"stage", stage.stage},
                      {"scan", stage.scan},
                      {"seconds", json_number(stage.seconds)},
                      {"peak_memory_bytes", stage.peak_memory_bytes}});
  }
  return json_text({{"schema", RunRecord::kSchema},
                    {"command", timing.command},
                    {"started", timing.started},
                    {"finished", timing.finished},
                    {"threads", timing.threads},
                    {"seconds", json_number(timing.seconds)},
                    {"stages", std::move(stages)}});
}

Result<TimingRecord> read_timing_record(const std::filesystem::path& timing_json) {
  ASBUILT_TRY(text, read_file(timing_json));
  return parsed(text, timing_json.string(), [](const Json& json) {
    TimingRecord timing;
    timing.command = json.at("command").get<std::string>();
    timing.started = json.at("started").get<std::string>();
    timing.finished = json.at("finished").get<std::string>();
    timing.threads = json.at("threads").get<int>();
    timing.seconds = number_at(json, "seconds");
    for (const Json& stage : json.at("stages")) {
      timing.stages.push_back({stage.at("stage").get<std::string>(), stage.at("scan").get<std::string>(),
                               number_at(stage, "seconds"), stage.at("peak_memory_bytes").get<std::uint64_t>()});
    }
    return timing;
  });
}

}  // namespace asbuilt::io
