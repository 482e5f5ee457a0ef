// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/report.h"

#include <array>

#include "asbuilt/io/file.h"
#include "asbuilt/io/json_text.h"
#include "asbuilt/io/ply_writer.h"

namespace asbuilt::pipeline {
namespace {

using Json = nlohmann::ordered_json;
using io::json_number;

constexpr std::array<const char*, 6> kColumnNames{"x", "y", "z", "nx", "ny", "nz"};

/// The columns of a cloud; keeps what the PLY writer only looks at.
class CloudColumns {
 public:
  explicit CloudColumns(const PointCloud& cloud) : count_(cloud.has_normals() ? 6 : 3) {
    for (std::size_t column = 0; column < count_; ++column) {
      const auto& vectors = column < 3 ? cloud.positions : cloud.normals;
      for (const Eigen::Vector3f& v : vectors) values_[column].push_back(v[static_cast<Eigen::Index>(column % 3)]);
    }
  }

  [[nodiscard]] std::vector<io::PlyColumn> columns() const {
    std::vector<io::PlyColumn> columns;
    for (std::size_t column = 0; column < count_; ++column) {
      columns.push_back({kColumnNames[column], std::span<const float>(values_[column])});
    }
    return columns;
  }

 private:
  std::size_t count_;
  std::array<std::vector<float>, 6> values_;
};

Json optional_number(const std::optional<double>& value) { return value ? json_number(*value) : Json(nullptr); }

Json json_of(const inspect::DeviationStatistics& s) {
  return {{"count", s.count},
          {"min", json_number(s.min)},
          {"max", json_number(s.max)},
          {"mean", json_number(s.mean)},
          {"mean_absolute", json_number(s.mean_absolute)},
          {"rms", json_number(s.rms)},
          {"sigma", json_number(s.sigma)},
          {"mean_positive", json_number(s.mean_positive)},
          {"mean_negative", json_number(s.mean_negative)},
          {"median", json_number(s.median)},
          {"p95", json_number(s.p95)},
          {"p99", json_number(s.p99)},
          {"in_tolerance", optional_number(s.in_tolerance)},
          {"over_tolerance", optional_number(s.over_tolerance)},
          {"under_tolerance", optional_number(s.under_tolerance)}};
}

Json tolerance_json(const inspect::DeviationReport& deviations, const inspect::InspectOptions& options) {
  if (!options.tolerance) return nullptr;
  const bool holds = deviations.within_tolerance(options).value_or(false);
  const char* verdict = deviations.over_area.count == 0 ? "not scanned" : holds ? "pass" : "fail";
  return {{"low", json_number(options.tolerance->low_mm)},
          {"high", json_number(options.tolerance->high_mm)},
          {"required_share", json_number(options.required_share)},
          {"verdict", verdict}};
}

Json alignment_json(const io::RunRecord& record) {
  if (!record.refinement || record.refinement->empty()) return "as given: the cloud was taken to be in the model frame";
  return record.refinement->front().gauge_method == "best_fit"
             ? "best fit of all segments to the CAD: one rigid motion, robust, without scale"
             : "the frame of the fixed scan, as it was detected";
}

Json scans_json(const io::RunRecord& record) {
  Json scans = Json::array();
  for (const io::ScanRecord& scan : record.scans) {
    scans.push_back({{"name", scan.name},
                     {"sha256", scan.sha256},
                     {"status", io::name_of(scan.status)},
                     {"noise_sigma", json_number(scan.noise_sigma)},
                     {"segment_points", scan.segment_points}});
  }
  return scans;
}

}  // namespace

io::DeviationRecord recorded_deviation(const inspect::DeviationReport& deviations) {
  const inspect::DeviationStatistics& area = deviations.over_area;
  return {area.mean, area.sigma, area.rms, area.p95, area.in_tolerance, deviations.coverage};
}

Result<void> write_report(const std::filesystem::path& path, const io::RunRecord& record,
                          const inspect::DeviationReport& deviations, const inspect::InspectOptions& options) {
  const Json report{{"asbuilt", {{"version", record.version}, {"schema", io::RunRecord::kSchema}}},
                    {"unit", "mm"},
                    {"model",
                     {{"path", record.model.path},
                      {"sha256", record.model.sha256},
                      {"diameter", json_number(record.model.diameter)}}},
                    {"scans", scans_json(record)},
                    {"alignment", alignment_json(record)},
                    {"sign", "positive: outside the material"},
                    {"coverage", json_number(deviations.coverage)},
                    {"far_points", deviations.far_points},
                    {"tolerance", tolerance_json(deviations, options)},
                    {"over_area", json_of(deviations.over_area)},
                    {"over_points", json_of(deviations.over_points)}};
  return io::write_file(path, io::json_text(report));
}

Result<void> write_reconstruction(const std::filesystem::path& path, const fuse::Reconstruction& reconstruction,
                                  std::span<const float> deviation_mm) {
  const CloudColumns cloud(reconstruction.cloud);
  std::vector<io::PlyColumn> columns = cloud.columns();
  columns.push_back({"scan", std::span<const std::uint16_t>(reconstruction.scan)});
  columns.push_back({"support", std::span<const std::uint16_t>(reconstruction.support)});
  columns.push_back({"sigma", std::span<const float>(reconstruction.sigma_mm)});
  columns.push_back({"deviation", deviation_mm});
  const std::vector<std::string> comments{"asbuilt reconstruction: model frame, mm; deviation positive outside"};
  return io::write_ply(path, columns, comments);
}

Result<void> write_deviations(const std::filesystem::path& path, const PointCloud& cloud_in_model,
                              std::span<const float> deviation_mm) {
  const CloudColumns cloud(cloud_in_model);
  std::vector<io::PlyColumn> columns = cloud.columns();
  columns.push_back({"deviation", deviation_mm});
  const std::vector<std::string> comments{"asbuilt inspect: model frame, mm; deviation positive outside"};
  return io::write_ply(path, columns, comments);
}

}  // namespace asbuilt::pipeline
