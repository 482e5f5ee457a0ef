// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/evaluate/truth.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "asbuilt/io/file.h"
#include "asbuilt/io/scan_file.h"

namespace asbuilt::evaluate {
namespace {

using Json = nlohmann::json;

// Thrown by the readers of single fields below, and turned into an Error at the end of read_truth.
struct WrongField {
  std::string message;
};

const Json& field(const Json& object, const char* name, const std::string& where) {
  const auto found = object.find(name);
  if (found == object.end()) throw WrongField{fmt::format("{} has no '{}'", where, name)};
  return *found;
}

std::string text_field(const Json& object, const char* name, const std::string& where) {
  const Json& value = field(object, name, where);
  if (!value.is_string()) throw WrongField{fmt::format("'{}' of {} is not a text", name, where)};
  return value.get<std::string>();
}

double number_or_zero(const Json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_number() ? found->get<double>() : 0.0;
}

Pose pose_of(const Json& rows, const std::string& where) {
  Eigen::Matrix4d matrix;
  const bool has_shape = rows.is_array() && rows.size() == 4;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      const auto r = static_cast<std::size_t>(row), c = static_cast<std::size_t>(column);
      if (!has_shape || !rows[r].is_array() || rows[r].size() != 4 || !rows[r][c].is_number()) {
        throw WrongField{fmt::format("{} is not a matrix of 4 x 4 numbers", where)};
      }
      matrix(row, column) = rows[r][c].get<double>();
    }
  }
  if (!is_rigid(matrix)) throw WrongField{fmt::format("{} is not a rigid motion", where)};
  return orthonormalised(Pose(matrix));
}

TruePlacement other_placement_of(const Json& json, const std::string& scan) {
  const std::string where = "a further placement of " + scan;
  if (!json.is_object()) throw WrongField{where + " is not an object"};
  const Json& label = field(json, "label", where);
  if (!label.is_number_integer() || label < 2 || label > 254) {
    throw WrongField{fmt::format("'label' of {} is {}, expected 2 to 254", where, label.dump())};
  }
  return {pose_of(field(json, "model_from_scan", where), "'model_from_scan' of " + where), label.get<std::uint8_t>(),
          number_or_zero(json, "occlusion"), number_or_zero(json, "hidden")};
}

TrueScan scan_of(const Json& json, std::size_t index) {
  const std::string where = fmt::format("scan {}", index);
  if (!json.is_object()) throw WrongField{where + " is not an object"};
  TrueScan scan;
  scan.path = text_field(json, "path", where);
  if (json.contains("labels") && !json["labels"].is_null()) scan.labels = text_field(json, "labels", where);
  const Json& pose = field(json, "model_from_scan", where);
  if (!pose.is_null()) scan.model_from_scan = pose_of(pose, "'model_from_scan' of " + where);
  scan.occlusion = number_or_zero(json, "occlusion");
  scan.hidden = number_or_zero(json, "hidden");
  scan.clutter = number_or_zero(json, "clutter");
  if (const auto others = json.find("other_placements"); others != json.end() && others->is_array()) {
    for (const Json& other : *others) scan.other_placements.push_back(other_placement_of(other, where));
  }
  return scan;
}

Truth truth_of(const Json& json) {
  const std::string where = "the truth";
  if (!json.is_object()) throw WrongField{"it holds no JSON object"};
  const Json& schema = field(json, "schema", where);
  if (schema != 1) throw WrongField{fmt::format("schema is {}, expected 1", schema.dump())};
  if (const std::string unit = text_field(json, "unit", where); unit != "mm") {
    throw WrongField{fmt::format("unit is {}, expected mm", unit)};
  }
  Truth truth;
  truth.model = text_field(json, "model", where);
  truth.as_built = text_field(json, "as_built", where);
  truth.noise_sigma_mm = number_or_zero(json, "noise_sigma");
  const Json& scans = field(json, "scans", where);
  if (!scans.is_array()) throw WrongField{"'scans' is not a list"};
  for (std::size_t i = 0; i < scans.size(); ++i) truth.scans.push_back(scan_of(scans[i], i));
  if (const auto found = json.find("symmetries"); found != json.end() && found->is_array()) {
    for (const Json& motion : *found) truth.symmetries.push_back(pose_of(motion, "a symmetry"));
  }
  return truth;
}

}  // namespace

std::vector<TruePlacement> TrueScan::placements() const {
  std::vector<TruePlacement> all;
  if (model_from_scan) all.push_back({*model_from_scan, 1, occlusion, hidden});
  all.insert(all.end(), other_placements.begin(), other_placements.end());
  return all;
}

Result<Truth> read_truth(const std::filesystem::path& path) {
  std::error_code ignored;
  const std::filesystem::path file = std::filesystem::is_directory(path, ignored) ? path / "truth.json" : path;
  ASBUILT_TRY(text, io::read_file(file));
  try {
    Truth truth = truth_of(Json::parse(text));
    truth.folder = file.parent_path();
    return truth;
  } catch (const WrongField& wrong) {
    return fail(ErrorCode::unreadable_input, fmt::format("{}: {}", file.string(), wrong.message));
  } catch (const Json::exception& wrong) {
    return fail(ErrorCode::unreadable_input, fmt::format("{}: not valid JSON: {}", file.string(), wrong.what()));
  }
}

Result<LabelledPoints> read_labelled_points(const Truth& truth, const TrueScan& scan) {
  const std::filesystem::path points_file = truth.folder / scan.path, labels_file = truth.folder / scan.labels;
  ASBUILT_TRY(scans, io::read_scans(points_file, io::Unit::millimetre));
  if (scans.size() != 1) {
    return fail(ErrorCode::unreadable_input,
                fmt::format("{}: holds {} scans, expected 1", points_file.string(), scans.size()));
  }
  LabelledPoints result;
  for (const Eigen::Vector3f& point : scans.front().cloud.positions) {
    result.points_in_scan.emplace_back(point.cast<double>() + scans.front().offset_mm);
  }
  ASBUILT_TRY(bytes, io::read_file(labels_file));
  if (bytes.size() != result.points_in_scan.size()) {
    return fail(ErrorCode::unreadable_input,
                fmt::format("{}: has {} labels, but the scan has {} points", labels_file.string(), bytes.size(),
                            result.points_in_scan.size()));
  }
  for (const char byte : bytes) result.labels.push_back(static_cast<std::uint8_t>(byte));
  return result;
}

Result<Pose> read_reference_pose(const std::filesystem::path& path, io::Unit unit) {
  ASBUILT_TRY(text, io::read_file(path));
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  Eigen::Matrix4d matrix;
  int count = 0;
  for (double value = 0.0; count < 16 && stream >> value; ++count) matrix(count / 4, count % 4) = value;
  if (count < 16) {
    return fail(ErrorCode::unreadable_input, fmt::format("{}: has {} numbers, expected 16", path.string(), count));
  }
  if (!is_rigid(matrix, 1e-3)) {  // such files are written with few digits
    return fail(ErrorCode::unreadable_input, fmt::format("{}: the matrix is not a rigid motion", path.string()));
  }
  Pose scan_from_model = orthonormalised(Pose(matrix));
  scan_from_model.translation() *= io::millimetres_per(unit);
  return scan_from_model.inverse();
}

}  // namespace asbuilt::evaluate
