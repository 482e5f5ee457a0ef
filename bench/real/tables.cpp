// SPDX-License-Identifier: Apache-2.0
#include "tables.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace asbuilt::bench {
namespace {

using Json = nlohmann::ordered_json;

// A number with so many digits, times `units`, or a dash where there is none.
std::string number(const Json& object, const char* key, int digits, double units = 1.0) {
  if (!object.contains(key) || !object.at(key).is_number()) return "-";
  return fmt::format("{:.{}f}", units * object.at(key).get<double>(), digits);
}

// The same of a share, in %.
std::string percent(const Json& object, const char* key, int digits) { return number(object, key, digits, 100.0); }

// The mean over the scans that have it, in %.
std::string mean_percent(const Json& evaluation, const char* key, int digits) {
  if (!evaluation.contains("per_scan")) return "-";
  double sum = 0.0;
  int count = 0;
  for (const Json& scan : evaluation.at("per_scan")) {
    if (!scan.contains(key) || !scan.at(key).is_number()) continue;
    sum += scan.at(key).get<double>();
    ++count;
  }
  return count > 0 ? fmt::format("{:.{}f}", 100.0 * sum / count, digits) : "-";
}

std::string real_table(const Json& sets) {
  std::string text =
      "| real scans | accepted | right | wrong | components | worst angle, deg | worst at the centroid, mm | mean "
      "distance, mm | under the reference poses, mm | exit code |\n|---|---|---|---|---|---|---|---|---|---|\n";
  for (const auto& [name, set] : sets.items()) {
    text += fmt::format("| {} | {} of {} | {} | {} | {} | {} | {} | {} | {} | {} |\n", name, set.at("accepted").dump(),
                        set.at("given").dump(), set.at("right").dump(), set.at("wrong").dump(),
                        set.at("components").dump(), number(set, "worst_angle_deg", 2),
                        number(set, "worst_centroid_mm", 2), number(set, "mean_distance_mm", 3),
                        number(set, "reference_distance_mm", 3), set.at("exit_code").dump());
  }
  return text;
}

std::string simulated_table(const Json& sets) {
  std::string text =
      "| simulated scans | accepted | present | right | wrong | ratio to oracle | relative pose error, sigma | exit "
      "code "
      "|\n|---|---|---|---|---|---|---|---|\n";
  for (const auto& [name, set] : sets.items()) {
    const Json& figures = set.at("evaluation");
    text += fmt::format("| {} | {} | {} | {} | {} | {} | {} | {} |\n", name, number(figures, "accepted", 0),
                        number(figures, "present", 0), number(figures, "right", 0), number(figures, "wrong", 0),
                        number(figures, "ratio_to_oracle", 4), number(figures, "relative_pose_error_sigma", 2),
                        set.at("exit_code").dump());
  }
  return text;
}

// The clouds and segments of the same runs.
std::string reconstruction_table(const Json& sets) {
  std::string text =
      "| simulated scans | points beyond 6 sigma, % | the same of true points under true poses, % | completeness, % | "
      "label precision, mean, % | label recall, mean, % |\n|---|---|---|---|---|---|\n";
  for (const auto& [name, set] : sets.items()) {
    const Json& figures = set.at("evaluation");
    text += fmt::format("| {} | {} | {} | {} | {} | {} |\n", name, percent(figures, "reconstruction_beyond_share", 3),
                        percent(figures, "oracle_beyond_share", 3), percent(figures, "reconstruction_completeness", 2),
                        mean_percent(figures, "segment_precision", 2), mean_percent(figures, "segment_recall", 2));
  }
  return text;
}

std::string stage_table(const std::string& name, const Json& timing) {
  std::string text = fmt::format("| {} | seconds | peak memory so far, MB |\n|---|---|---|\n", name);
  for (const Json& stage : timing.at("stages")) {
    text += fmt::format("| {} | {} | {} |\n", stage.at("stage").get<std::string>(), number(stage, "seconds", 2),
                        number(stage, "peak_memory_mb", 0));
  }
  return text + fmt::format("| all, {} threads | {} | |\n", timing.at("threads").dump(), number(timing, "seconds", 2));
}

}  // namespace

std::string tables(const Json& figures) {
  std::string text;
  if (figures.contains("real")) text += real_table(figures.at("real")) + "\n";
  if (figures.contains("simulated")) {
    text += simulated_table(figures.at("simulated")) + "\n";
    text += reconstruction_table(figures.at("simulated")) + "\n";
  }
  if (figures.contains("stages")) {
    for (const auto& [name, timing] : figures.at("stages").items()) text += stage_table(name, timing) + "\n";
  }
  return text;
}

}  // namespace asbuilt::bench
