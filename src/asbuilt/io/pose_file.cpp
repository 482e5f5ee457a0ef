// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/pose_file.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>

#include "asbuilt/io/file.h"
#include "asbuilt/io/input.h"
#include "asbuilt/io/named_rows.h"
#include "asbuilt/io/readers.h"

namespace asbuilt::io {
namespace {

using Json = nlohmann::json;

/// What is wrong with the matrix as a rigid motion; empty if nothing is.
std::string flaw_of(const Eigen::Matrix4d& matrix) {
  if (!matrix.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1), 1e-9)) return "the last row is not 0 0 0 1";
  if (is_rigid(matrix)) return {};
  const double determinant = matrix.topLeftCorner<3, 3>().determinant();
  return fmt::format(
      "the matrix is not a rigid motion (determinant {:.6g}, expected a rotation without scale or mirroring)",
      determinant);
}

/// The nearest exactly rigid motion in millimetres: a file has rounded numbers.
Pose pose_in_mm(const Eigen::Matrix4d& matrix, Unit unit) {
  Pose pose;
  pose.matrix() = matrix;
  pose = orthonormalised(pose);
  pose.translation() *= millimetres_per(unit);
  return pose;
}

Result<std::vector<NamedPose>> read_csv(const Input& input, Unit unit) {
  ASBUILT_TRY(rows, read_named_rows(input, 16, "name,a11,a12,...,a44"));
  std::vector<NamedPose> poses;
  for (const NamedRow& row : rows) {
    const Eigen::Matrix4d matrix = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(row.values.data());
    if (const std::string flaw = flaw_of(matrix); !flaw.empty()) return input.error_at_line(row.line, flaw);
    poses.push_back({row.name, pose_in_mm(matrix, unit)});
  }
  return poses;
}

/// A 4x4 array of numbers, or nothing.
std::optional<Eigen::Matrix4d> matrix_of(const Json& json) {
  Eigen::Matrix4d matrix;
  if (!json.is_array() || json.size() != 4) return std::nullopt;
  for (std::size_t row = 0; row < 4; ++row) {
    if (!json[row].is_array() || json[row].size() != 4) return std::nullopt;
    for (std::size_t column = 0; column < 4; ++column) {
      if (!json[row][column].is_number()) return std::nullopt;
      matrix(static_cast<int>(row), static_cast<int>(column)) = json[row][column].get<double>();
    }
  }
  return matrix;
}

Result<NamedPose> pose_of(const Input& input, const Json& entry, std::size_t index, Unit unit) {
  const auto wrong = [&](std::string_view what) { return input.error(fmt::format("entry {}: {}", index, what)); };
  if (!entry.is_object() || !entry.contains("scan") || !entry["scan"].is_string()) {
    return wrong(R"(expected {"scan": name, "model_from_scan": [[4x4]]})");
  }
  if (!entry.contains("model_from_scan")) return wrong("there is no 'model_from_scan'");
  const auto matrix = matrix_of(entry["model_from_scan"]);
  if (!matrix) return wrong("'model_from_scan' is not a 4x4 array of numbers");
  if (const std::string flaw = flaw_of(*matrix); !flaw.empty()) return wrong(flaw);
  return NamedPose{entry["scan"].get<std::string>(), pose_in_mm(*matrix, unit)};
}

Result<std::vector<NamedPose>> read_json(const Input& input, Unit unit) {
  Json json;
  try {
    json = Json::parse(input.content);
  } catch (const Json::parse_error& error) {
    return input.error_at_byte(error.byte, "is not valid JSON");
  } catch (const Json::exception&) {
    return input.error("is not valid JSON: a number is too large");
  }
  if (!json.is_array() || json.empty()) return input.error("expected a JSON array of poses");
  std::vector<NamedPose> poses;
  std::set<std::string> names;
  for (std::size_t i = 0; i < json.size(); ++i) {
    ASBUILT_TRY(pose, pose_of(input, json[i], i, unit));
    if (!names.insert(pose.scan).second) {
      return input.error(fmt::format("entry {}: scan {} is named a second time", i, in_quotes(pose.scan)));
    }
    poses.push_back(std::move(pose));
  }
  return poses;
}

}  // namespace

Result<std::vector<NamedPose>> poses_from(const Input& input, Unit unit) {
  const std::size_t first = input.content.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) return input.error("the file is empty, expected poses as CSV or JSON");
  const bool is_json = input.content[first] == '[' || input.content[first] == '{';
  return is_json ? read_json(input, unit) : read_csv(input, unit);
}

Result<void> write_poses_csv(const std::filesystem::path& path, std::span<const NamedPose> poses) {
  std::string text = "name";
  for (int row = 1; row <= 4; ++row) {
    for (int column = 1; column <= 4; ++column) text += fmt::format(",a{}{}", row, column);
  }
  for (const NamedPose& pose : poses) {
    text += '\n' + pose.scan;
    for (int i = 0; i < 16; ++i) text += fmt::format(",{}", pose.model_from_scan.matrix()(i / 4, i % 4));
  }
  return write_file(path, text + '\n');
}

Result<std::vector<NamedPose>> read_poses(const std::filesystem::path& path, Unit unit) {
  ASBUILT_TRY(content, read_file(path));
  return poses_from({path.string(), content}, unit);
}

}  // namespace asbuilt::io
