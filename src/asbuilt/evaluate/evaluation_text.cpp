// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "asbuilt/evaluate/evaluate.h"

namespace asbuilt::evaluate {
namespace {

using Json = nlohmann::ordered_json;

Json value_or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

Json json_of(const ScanFigures& scan) {
  Json json{{"name", scan.name},
            {"status", scan.status},
            {"present", scan.present},
            {"accepted", scan.accepted},
            {"right", scan.right},
            {"occlusion", scan.occlusion},
            {"hidden", scan.hidden},
            {"clutter", scan.clutter},
            {"rotation_error_deg", nullptr},
            {"translation_error_mm", nullptr},
            {"add_mm", nullptr},
            {"max_vertex_mm", nullptr},
            {"segment_precision", value_or_null(scan.segment_precision)},
            {"segment_recall", value_or_null(scan.segment_recall)}};
  if (scan.error) {
    json["rotation_error_deg"] = scan.error->angle_deg;
    json["translation_error_mm"] = scan.error->translation_mm;
    json["add_mm"] = scan.error->add_mm;
    json["max_vertex_mm"] = scan.error->max_vertex_mm;
  }
  return json;
}

std::string figure(const std::optional<double>& value, int digits) {
  return value ? fmt::format("{:.{}f}", *value, digits) : "-";
}

std::string line_of(const ScanFigures& scan) {
  const std::string verdict = !scan.accepted ? (scan.present ? "missed" : "absent") : scan.right ? "right" : "WRONG";
  const auto error = [&](double PoseError::*member) {
    return scan.error ? std::optional<double>((*scan.error).*member) : std::nullopt;
  };
  return fmt::format("{:<20} {:<12} {:<7} {:>9} {:>9} {:>9} {:>9} {:>6} {:>6} {:>6.2f} {:>6.2f} {:>6.2f}\n", scan.name,
                     scan.status, verdict, figure(error(&PoseError::angle_deg), 3),
                     figure(error(&PoseError::translation_mm), 3), figure(error(&PoseError::add_mm), 3),
                     figure(error(&PoseError::max_vertex_mm), 3), figure(scan.segment_precision, 3),
                     figure(scan.segment_recall, 3), scan.occlusion, scan.hidden, scan.clutter);
}

std::string percent(const std::optional<double>& share, int digits) {
  return share ? fmt::format("{:.{}f} %", 100.0 * *share, digits) : "-";
}

std::string reconstruction_line(const Evaluation& evaluation) {
  if (!evaluation.reconstruction_beyond_share && !evaluation.reconstruction_completeness) return {};
  return fmt::format(
      "reconstruction: {} mm from the true surface in the mean, {} of {} points beyond 6 sigma ({}; true "
      "points under true poses {}), completeness {}\n",
      figure(evaluation.reconstruction_distance_mm, 4), evaluation.reconstruction_beyond,
      evaluation.reconstruction_points, percent(evaluation.reconstruction_beyond_share, 3),
      percent(evaluation.oracle_beyond_share, 3), percent(evaluation.reconstruction_completeness, 2));
}

}  // namespace

std::string to_json(const Evaluation& evaluation) {
  Json json{{"schema", 1},
            {"diameter", evaluation.diameter_mm},
            {"noise_sigma", evaluation.noise_sigma_mm},
            {"scans", evaluation.scans},
            {"present", evaluation.present},
            {"accepted", evaluation.accepted},
            {"right", evaluation.right},
            {"wrong", evaluation.wrong},
            {"disconnected_right", evaluation.disconnected_right},
            {"recall", value_or_null(evaluation.recall)},
            {"precision", value_or_null(evaluation.precision)},
            {"part_points", evaluation.part_points},
            {"mean_distance_mm", value_or_null(evaluation.mean_distance_mm)},
            {"oracle_distance_mm", value_or_null(evaluation.oracle_distance_mm)},
            {"ratio_to_oracle", value_or_null(evaluation.ratio_to_oracle)},
            {"relative_pose_error_mm", value_or_null(evaluation.relative_pose_error_mm)},
            {"relative_pose_error_sigma", value_or_null(evaluation.relative_pose_error_sigma)},
            {"reconstruction_distance_mm", value_or_null(evaluation.reconstruction_distance_mm)},
            {"reconstruction_points", evaluation.reconstruction_points},
            {"reconstruction_beyond", evaluation.reconstruction_beyond},
            {"reconstruction_beyond_share", value_or_null(evaluation.reconstruction_beyond_share)},
            {"oracle_beyond_share", value_or_null(evaluation.oracle_beyond_share)},
            {"reconstruction_completeness", value_or_null(evaluation.reconstruction_completeness)},
            {"per_scan", Json::array()}};
  for (const ScanFigures& scan : evaluation.per_scan) json["per_scan"].push_back(json_of(scan));
  return json.dump(2) + "\n";
}

std::string to_table(const Evaluation& evaluation) {
  std::string text =
      fmt::format("{:<20} {:<12} {:<7} {:>9} {:>9} {:>9} {:>9} {:>6} {:>6} {:>6} {:>6} {:>6}\n", "scan", "status",
                  "verdict", "rot deg", "trans mm", "ADD mm", "max mm", "s.prec", "s.rec", "occl", "hidden", "clutt");
  for (const ScanFigures& scan : evaluation.per_scan) text += line_of(scan);
  text += fmt::format("\naccepted {} of {} with the part: {} right, {} wrong (recall {}, precision {})\n",
                      evaluation.accepted, evaluation.present, evaluation.right, evaluation.wrong,
                      figure(evaluation.recall, 3), figure(evaluation.precision, 3));
  if (evaluation.disconnected_right > 0) {
    text += fmt::format("right, but in another component: {}\n", evaluation.disconnected_right);
  }
  text += fmt::format("ratio to oracle {} ({} mm, true poses {} mm, {} points), accepted / present {}/{}\n",
                      figure(evaluation.ratio_to_oracle, 4), figure(evaluation.mean_distance_mm, 4),
                      figure(evaluation.oracle_distance_mm, 4), evaluation.part_points, evaluation.accepted,
                      evaluation.present);
  text += fmt::format("relative pose error {} sigma ({} mm)\n", figure(evaluation.relative_pose_error_sigma, 3),
                      figure(evaluation.relative_pose_error_mm, 4));
  return text + reconstruction_line(evaluation);
}

}  // namespace asbuilt::evaluate
