// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/inspect/reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/matrix_factors.h"
#include "asbuilt/io/file.h"
#include "asbuilt/io/input.h"
#include "asbuilt/io/lines.h"
#include "asbuilt/io/text_layout.h"

namespace asbuilt::inspect {
namespace {

constexpr std::size_t kPlanePoints = 24;
constexpr double kSearchRatio = 0.01;
constexpr double kSignificant = 3.0;

bool is_header(const std::vector<std::string_view>& fields, io::Separator separator) {
  return std::ranges::none_of(
      fields, [&](std::string_view field) { return !field.empty() && io::parse_field(field, separator).has_value(); });
}

Result<ReferencePoint> point_of(const io::Input& input, std::size_t line, const std::vector<std::string_view>& fields,
                                io::Separator separator, double mm_per_unit) {
  const bool has_name = !fields.empty() && (fields[0].empty() || !io::parse_field(fields[0], separator).has_value());
  const std::size_t first = has_name ? 1 : 0;
  if (fields.size() != first + 3 && fields.size() != first + 4) {
    return input.error_at_line(line, fmt::format("found {} fields, expected x,y,z or name,x,y,z, with or without a "
                                                 "sigma behind",
                                                 fields.size()));
  }
  std::vector<double> numbers;
  for (std::size_t i = first; i < fields.size(); ++i) {
    const auto number = io::parse_field(fields[i], separator);
    if (!number || !std::isfinite(*number)) {
      return input.error_at_line(
          line, fmt::format("field {} is {}, expected a finite number", i + 1, io::in_quotes(fields[i])));
    }
    numbers.push_back(*number * mm_per_unit);
  }
  ReferencePoint point{
      std::string(has_name ? fields[0] : std::string_view()), {numbers[0], numbers[1], numbers[2]}, {}};
  if (numbers.size() < 4) return point;
  if (!(numbers[3] >= 0.0)) {
    return input.error_at_line(line, fmt::format("sigma is {}, it must not be negative", io::in_quotes(fields.back())));
  }
  point.sigma_mm = numbers[3];
  return point;
}

/// A plane through the points about a place, its normal turned as theirs are.
struct LocalPlane {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  double rms = 0.0;
  std::size_t points = 0;
};

LocalPlane plane_about(const std::vector<KdTree::Neighbour>& near, const std::vector<Eigen::Vector3f>& positions,
                       std::span<const Eigen::Vector3f> normals) {
  LocalPlane plane;
  plane.points = near.size();
  const auto count = static_cast<double>(near.size());
  Eigen::Vector3d outwards = Eigen::Vector3d::Zero();
  for (const auto& n : near) {
    plane.centre += positions[n.index].cast<double>() / count;
    outwards += normals[n.index].cast<double>();
  }
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto& n : near) {
    const Eigen::Vector3d offset = positions[n.index].cast<double>() - plane.centre;
    scatter += offset * offset.transpose() / count;
  }
  const SymmetricEigen<3> eigen(scatter);
  plane.normal = eigen.eigenvectors().col(0);
  if (plane.normal.dot(outwards) < 0.0) plane.normal = -plane.normal;
  plane.rms = std::sqrt(std::max(0.0, eigen.eigenvalues()[0]));
  return plane;
}

}  // namespace

Result<std::vector<ReferencePoint>> reference_points_in(std::string_view content, const std::string& name,
                                                        double mm_per_unit) {
  const io::Input input{name, content};
  io::LineCursor lines(content);
  std::vector<std::string_view> fields;
  std::vector<ReferencePoint> points;
  bool is_first = true;
  while (lines.next()) {
    if (io::is_comment(lines.line())) continue;
    auto separator = io::Separator::blanks;
    if (lines.line().find(',') != std::string_view::npos) separator = io::Separator::comma;
    if (lines.line().find(';') != std::string_view::npos) separator = io::Separator::semicolon;
    io::split_fields(lines.line(), separator, fields);
    if (std::exchange(is_first, false) && is_header(fields, separator)) continue;
    ASBUILT_TRY(point, point_of(input, lines.number(), fields, separator, mm_per_unit));
    if (point.name.empty()) point.name = fmt::format("{}", points.size() + 1);
    points.push_back(std::move(point));
  }
  if (points.empty()) return input.error("the file holds no point, expected lines x,y,z or name,x,y,z,sigma");
  return points;
}

Result<std::vector<ReferencePoint>> read_reference_points(const std::filesystem::path& path, double mm_per_unit) {
  ASBUILT_TRY(content, io::read_file(path));
  return reference_points_in(content, path.string(), mm_per_unit);
}

ReferenceReport compared_with(const std::vector<ReferencePoint>& points, const PointCloud& cloud,
                              std::span<const Eigen::Vector3f> outward_normals, const Pose& model_from_cloud,
                              double diameter_mm, double noise_sigma_mm, double search_distance_mm) {
  ReferenceReport report;
  report.points = points;
  report.search_distance_mm = search_distance_mm > 0.0 ? search_distance_mm : kSearchRatio * diameter_mm;
  const Pose cloud_from_model = model_from_cloud.inverse();
  const KdTree tree(cloud.positions);
  std::vector<double> measured;
  std::vector<KdTree::Neighbour> near;
  for (const ReferencePoint& point : points) {
    ReferenceDeviation& deviation = report.deviations.emplace_back();
    const Eigen::Vector3d query = cloud_from_model * point.position;
    tree.nearest(query.cast<float>(), kPlanePoints, near);
    const auto far = static_cast<float>(report.search_distance_mm * report.search_distance_mm);
    std::erase_if(near, [&](const auto& n) { return n.squared_distance > far; });
    if (near.size() < 3) continue;
    const LocalPlane plane = plane_about(near, cloud.positions, outward_normals);
    deviation.measured = true;
    const double height = (query - plane.centre).dot(plane.normal);
    deviation.deviation_mm = -height;
    deviation.distance_mm = std::abs(height);
    const double noise = std::max(noise_sigma_mm, plane.rms);
    const double own = point.sigma_mm.value_or(0.0);
    deviation.standard_error_mm = std::hypot(noise / std::sqrt(static_cast<double>(plane.points)), own);
    if (deviation.standard_error_mm > 0.0) {
      deviation.significant = deviation.distance_mm > kSignificant * deviation.standard_error_mm;
    }
    measured.push_back(deviation.deviation_mm);
  }
  report.statistics = statistics(std::move(measured), std::nullopt);
  return report;
}

}  // namespace asbuilt::inspect
