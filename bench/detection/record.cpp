// SPDX-License-Identifier: Apache-2.0
#include "record.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>
#include <tuple>

#include "asbuilt/io/file.h"

namespace asbuilt::bench {
namespace {

using Json = nlohmann::ordered_json;

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
  field("residual_ratio", record.residual_ratio);
  field("weakest_direction", record.weakest_direction);
  field("explained_samples", record.explained_samples);
  field("hypotheses", record.hypotheses);
  field("right_rank", record.right_rank);
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
