// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>
#include <string_view>

#include "asbuilt/io/file.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/io/ply_writer.h"
#include "asbuilt/simulate/simulate.h"

namespace asbuilt::simulate {
namespace {

using Json = nlohmann::ordered_json;

Json matrix(const std::optional<Pose>& pose) {
  if (!pose) return nullptr;
  Json rows = Json::array();
  for (int row = 0; row < 4; ++row) {
    Json values = Json::array();
    for (int column = 0; column < 4; ++column) values.push_back(pose->matrix()(row, column));
    rows.push_back(values);
  }
  return rows;
}

Json truth_of(const SimulatedScan& scan) {
  Json truth{{"path", scan.name + ".ply"},
             {"labels", scan.name + ".labels"},
             {"model_from_scan", matrix(scan.model_from_scan)},
             {"occlusion", scan.occlusion},
             {"hidden", scan.hidden},
             {"clutter", scan.clutter}};
  for (const OtherPlacement& other : scan.other_placements) {
    truth["other_placements"].push_back({{"model_from_scan", matrix(other.model_from_scan)},
                                         {"label", other.label},
                                         {"occlusion", other.occlusion},
                                         {"hidden", other.hidden}});
  }
  return truth;
}

}  // namespace

Result<void> write_points(const std::filesystem::path& path, const std::vector<Eigen::Vector3f>& points) {
  std::array<std::vector<float>, 3> columns;
  for (const Eigen::Vector3f& point : points) {
    for (std::size_t k = 0; k < 3; ++k) columns[k].push_back(point[static_cast<Eigen::Index>(k)]);
  }
  const std::array<io::PlyColumn, 3> table{{{"x", std::span<const float>(columns[0])},
                                            {"y", std::span<const float>(columns[1])},
                                            {"z", std::span<const float>(columns[2])}}};
  return io::write_ply(path, table);
}

Result<void> write_simulation(const std::filesystem::path& folder, const Simulation& simulation) {
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (failure) {
    return fail(ErrorCode::unwritable_output,
                fmt::format("{}: the folder cannot be made: {}", folder.string(), failure.message()));
  }
  // A truth of an earlier run must not stand beside new scans while they are being written.
  std::filesystem::remove(folder / "truth.json", failure);
  ASBUILT_CHECK(io::write_mesh_ply(folder / "model.ply", simulation.model));
  ASBUILT_CHECK(io::write_mesh_ply(folder / "as_built.ply", simulation.as_built));
  Json truth{{"schema", 1},
             {"unit", "mm"},
             {"model", "model.ply"},
             {"as_built", "as_built.ply"},
             {"noise_sigma", simulation.noise_sigma_mm},
             {"deviation_rms", simulation.deviation_rms_mm},
             {"deviation_max", simulation.deviation_max_mm},
             {"scans", Json::array()}};
  for (const SimulatedScan& scan : simulation.scans) {
    ASBUILT_CHECK(write_points(folder / (scan.name + ".ply"), scan.points_in_scan));
    ASBUILT_CHECK(io::write_file(folder / (scan.name + ".labels"),
                                 {reinterpret_cast<const char*>(scan.labels.data()), scan.labels.size()}));
    truth["scans"].push_back(truth_of(scan));
  }
  return io::write_file(folder / "truth.json", truth.dump(1) + "\n");
}

}  // namespace asbuilt::simulate
