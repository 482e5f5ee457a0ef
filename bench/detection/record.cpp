// SPDX-License-Identifier: Apache-2.0
#include "record.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>
#include <tuple>

#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/evaluate/evaluate.h"
#include "asbuilt/evaluate/pose_error.h"
#include "asbuilt/io/file.h"

namespace asbuilt::bench {
namespace {

using Json = nlohmann::ordered_json;

// How near a hypothesis must be for the registration to have a fair chance.
constexpr double kNearAngleDeg = 12.0, kNearShare = 0.1;

// Every field once, for both directions.
template <class Record, class Visitor>
void for_each_field(Record& record, Visitor&& field) {
  field("seed", record.seed);
  field("mode", record.mode);
  field("group", record.group);
  field("part", record.part);
  field("content", record.content);
  field("stratum", record.stratum);
  field("sensor", record.sensor);
  field("hidden", record.hidden);
  field("occlusion", record.occlusion);
  field("clutter", record.clutter);
  field("noise_ratio", record.noise_ratio);
  field("deviation_ratio", record.deviation_ratio);
  field("diameter_mm", record.diameter_mm);
  field("points", record.points);
  field("part_points", record.part_points);
  field("status", record.status);
  field("reason_code", record.reason_code);
  field("reason", record.reason);
  field("best", record.best);
  field("unverified", record.unverified);
  field("votes", record.votes);
  field("support", record.support);
  field("visible_share", record.visible_share);
  field("normal_agreement", record.normal_agreement);
  field("contradiction_share", record.contradiction_share);
  field("hidden_share", record.hidden_share);
  field("missing_share", record.missing_share);
  field("facing_share", record.facing_share);
  field("residual_ratio", record.residual_ratio);
  field("weakest_direction", record.weakest_direction);
  field("slip_lead", record.slip_lead);
  field("size_hold", record.size_hold);
  field("size_lead", record.size_lead);
  field("lost_end_share", record.lost_end_share);
  field("pierced_share", record.pierced_share);
  field("overrun_share", record.overrun_share);
  field("explained_samples", record.explained_samples);
  field("loose_directions", record.loose_directions);
  field("votes_cast", record.votes_cast);
  field("looks", record.looks);
  field("hypotheses", record.hypotheses);
  field("right_rank", record.right_rank);
  field("verdict_on_truth", record.verdict_on_truth);
  field("prepare_model", record.prepare_model);
  field("prepare_scan", record.prepare_scan);
  field("detect", record.detect);
  field("verify", record.verify);
}

template <class T>
Json json_of(const T& value) {
  return value;
}
template <class T>
Json json_of(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}
Json json_of(const StepTime& time) { return {{"wall", time.wall}, {"cpu", time.cpu}}; }
Json json_of(const Judged& judged) {
  return {{"has_pose", judged.has_pose},
          {"right", judged.right},
          {"displacement", json_of(judged.displacement)},
          {"score", judged.score}};
}

template <class T>
void take(const Json& json, T& value) {
  json.get_to(value);
}
template <class T>
void take(const Json& json, std::optional<T>& value) {
  value = json.is_null() ? std::nullopt : std::optional<T>(json.get<T>());
}
void take(const Json& json, StepTime& time) {
  json.at("wall").get_to(time.wall);
  json.at("cpu").get_to(time.cpu);
}
void take(const Json& json, Judged& judged) {
  json.at("has_pose").get_to(judged.has_pose);
  json.at("right").get_to(judged.right);
  take(json.at("displacement"), judged.displacement);
  json.at("score").get_to(judged.score);
}

}  // namespace

Timed::Timed(StepTime& time) : time_(time) {}
Timed::~Timed() {
  time_.cpu += watch_.cpu_seconds();
  time_.wall += watch_.seconds();
}

Judged judged(const Pose& model_from_scan, const std::optional<Pose>& true_model_from_scan, const SuitePart& part) {
  Judged result;
  result.has_pose = true;
  if (!true_model_from_scan) return result;
  const auto error = evaluate::pose_error(model_from_scan, *true_model_from_scan, part.mesh, part.symmetries);
  result.displacement = error.max_vertex_mm / diameter(part.mesh);
  result.right = *result.displacement <= evaluate::EvaluateOptions{}.right_ratio;
  return result;
}

std::optional<std::size_t> first_near(std::span<const Pose> model_from_scan,
                                      const std::optional<Pose>& true_model_from_scan, const SuitePart& part) {
  if (!true_model_from_scan) return std::nullopt;
  const double reach = kNearShare * diameter(part.mesh);
  const auto near = std::ranges::find_if(model_from_scan, [&](const Pose& pose) {
    const auto error = evaluate::pose_error(pose, *true_model_from_scan, part.mesh, part.symmetries);
    return error.angle_deg <= kNearAngleDeg && error.translation_mm <= reach;
  });
  if (near == model_from_scan.end()) return std::nullopt;
  return static_cast<std::size_t>(near - model_from_scan.begin());
}

CaseRecord record_of(const Case& the_case, const SuitePart& part, const CaseScan& scan) {
  CaseRecord record;
  record.seed = the_case.seed;
  record.part = part.name;
  record.content = name_of(the_case.content);
  record.sensor = the_case.options.sensor;
  record.hidden = scan.hidden;
  record.occlusion = scan.occlusion;
  record.clutter = scan.clutter;
  record.noise_ratio = the_case.options.noise_ratio;
  record.deviation_ratio = scan.deviation_ratio;
  record.diameter_mm = diameter(part.mesh);
  record.points = scan.points_in_scan.size();
  record.part_points = scan.part_points;
  if (!record.present()) return record;
  const std::size_t stratum = stratum_of(scan.hidden);
  record.stratum = stratum < kStrataCount ? kStrata[stratum].name : "outside";
  return record;
}

std::string to_line(const CaseRecord& record) {
  Json json = Json::object();
  for_each_field(record, [&](const char* name, const auto& value) { json[name] = json_of(value); });
  return json.dump();
}

Result<CaseRecord> record_of(const std::string& line) {
  try {
    const Json json = Json::parse(line);
    CaseRecord record;
    for_each_field(record, [&](const char* name, auto& value) { take(json.at(name), value); });
    return record;
  } catch (const Json::exception& error) {
    return fail(ErrorCode::unreadable_input, error.what());
  }
}

Result<std::vector<CaseRecord>> read_records(const std::filesystem::path& path) {
  std::vector<CaseRecord> records;
  if (!std::filesystem::exists(path)) return records;
  ASBUILT_TRY(text, io::read_file(path));
  std::size_t number = 1;
  for (std::size_t begin = 0; begin < text.size(); ++number) {
    const std::size_t end = text.find('\n', begin);
    if (end == std::string::npos) break;
    const auto record = record_of(text.substr(begin, end - begin));
    begin = end + 1;
    if (!record) {
      return fail(ErrorCode::unreadable_input,
                  fmt::format("{}, line {}: {}", path.string(), number, record.error().message));
    }
    records.push_back(*record);
  }
  std::ranges::sort(records, {}, [](const CaseRecord& r) { return std::tie(r.mode, r.group, r.seed); });
  return records;
}

Result<void> append(const std::filesystem::path& path, const CaseRecord& record) {
  std::ofstream file(path, std::ios::app);
  const std::string line = to_line(record) + "\n";
  file.write(line.data(), static_cast<std::streamsize>(line.size()));
  file.flush();
  if (file) return {};
  return fail(ErrorCode::unwritable_output, fmt::format("{}: cannot be written", path.string()));
}

}  // namespace asbuilt::bench
