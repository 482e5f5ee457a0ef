// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "asbuilt/core/parallel.h"
#include "asbuilt/inspect/closed_mesh.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/io/ply_writer.h"

namespace asbuilt::pipeline {
namespace {

constexpr std::array<const char*, 6> kColumnNames{"x", "y", "z", "nx", "ny", "nz"};

/// The columns of a cloud; keeps what the PLY writer only looks at.
class CloudColumns {
 public:
  explicit CloudColumns(const PointCloud& cloud) : count_(cloud.has_normals() ? 6 : 3) {
    for (std::size_t column = 0; column < count_; ++column) {
      const auto& vectors = column < 3 ? cloud.positions : cloud.normals;
      values_[column].reserve(vectors.size());
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

/// Colours of deviations as three columns; as CloudColumns.
class ColourColumns {
 public:
  ColourColumns(std::span<const float> deviation_mm, const report::ColourMap& colours) {
    for (auto& channel : channels_) channel.reserve(deviation_mm.size());
    for (const float deviation : deviation_mm) {
      const report::Rgb rgb = colours.colour(static_cast<double>(deviation));
      for (std::size_t c = 0; c < 3; ++c) channels_[c].push_back(rgb[c]);
    }
  }

  void append_to(std::vector<io::PlyColumn>& columns) const {
    constexpr std::array<const char*, 3> kNames{"red", "green", "blue"};
    for (std::size_t c = 0; c < 3; ++c) columns.push_back({kNames[c], std::span<const std::uint8_t>(channels_[c])});
  }

 private:
  std::array<std::vector<std::uint8_t>, 3> channels_;
};

/// What the sensors saw beside the places, as columns of their own; as CloudColumns.
class SeenColumns {
 public:
  explicit SeenColumns(const fuse::Reconstruction& reconstruction) : intensities_(reconstruction.intensities) {
    for (const fuse::Colour& colour : reconstruction.colours) {
      for (std::size_t c = 0; c < 3; ++c) channels_[c].push_back(colour[c]);
    }
  }

  void append_to(std::vector<io::PlyColumn>& columns) const {
    constexpr std::array<const char*, 3> kNames{"scan_red", "scan_green", "scan_blue"};
    for (std::size_t c = 0; c < 3 && !channels_[c].empty(); ++c) {
      columns.push_back({kNames[c], std::span<const std::uint8_t>(channels_[c])});
    }
    if (!intensities_.empty()) columns.push_back({"intensity", intensities_});
  }

 private:
  std::array<std::vector<std::uint8_t>, 3> channels_;
  std::span<const float> intensities_;
};

}  // namespace

io::DeviationRecord recorded_deviation(const inspect::DeviationReport& deviations) {
  const inspect::DeviationStatistics& area = deviations.over_area;
  return {area.mean,
          area.sigma,
          area.rms,
          area.p95,
          area.in_tolerance,
          deviations.coverage,
          deviations.verdict ? std::string(inspect::name_of(*deviations.verdict)) : std::string()};
}

Result<void> write_reconstruction(const std::filesystem::path& path, const fuse::Reconstruction& reconstruction,
                                  std::span<const float> deviation_mm, const report::ColourMap& colours) {
  const CloudColumns cloud(reconstruction.cloud);
  std::vector<io::PlyColumn> columns = cloud.columns();
  columns.push_back({"scan", std::span<const std::uint16_t>(reconstruction.scan)});
  columns.push_back({"support", std::span<const std::uint16_t>(reconstruction.support)});
  columns.push_back({"sigma", std::span<const float>(reconstruction.sigma_mm)});
  columns.push_back({"deviation", deviation_mm});
  const ColourColumns coloured(deviation_mm, colours);
  coloured.append_to(columns);
  const SeenColumns seen(reconstruction);
  seen.append_to(columns);
  const std::vector<std::string> comments{"asbuilt reconstruction: model frame, mm; deviation positive outside"};
  return io::write_ply(path, columns, comments);
}

Result<void> write_deviations(const std::filesystem::path& path, const PointCloud& cloud_in_model,
                              std::span<const float> deviation_mm, const report::ColourMap& colours) {
  const CloudColumns cloud(cloud_in_model);
  std::vector<io::PlyColumn> columns = cloud.columns();
  columns.push_back({"deviation", deviation_mm});
  const ColourColumns coloured(deviation_mm, colours);
  coloured.append_to(columns);
  const std::vector<std::string> comments{"asbuilt inspect: model frame, mm; deviation positive outside"};
  return io::write_ply(path, columns, comments);
}

Result<void> write_coloured_mesh(const std::filesystem::path& path, const TriangleMesh& mesh,
                                 const model::PreparedModel& model, const inspect::DeviationReport& deviations,
                                 const report::ColourMap& colours, const Context& context) {
  io::VertexValues values;
  values.deviation_mm.resize(mesh.vertices.size());
  values.colours.resize(mesh.vertices.size());
  parallel_for(context, mesh.vertices.size(), 1024, [&](std::size_t i) {
    const Eigen::Vector3d vertex = deviations.alignment.model_from_given * mesh.vertices[i];
    const double deviation = model.surface->nearest(vertex).signed_distance;
    values.deviation_mm[i] = static_cast<float>(deviation);
    values.colours[i] = colours.colour(deviation);
  });
  return io::write_mesh_ply(path, mesh, values);
}

Result<void> write_closed_mesh(const std::filesystem::path& path, const model::PreparedModel& model,
                               const inspect::DeviationReport& deviations, const report::ColourMap& colours,
                               const Context& context) {
  constexpr double kEdgeInSpacings = 2.0, kFinestRatio = 1.0 / 2000;  // no finer than the points, nor than is of use
  inspect::ClosedMeshOptions options;
  options.edge_length_mm = std::max(kEdgeInSpacings * deviations.spacing_mm, kFinestRatio * model.diameter);
  ASBUILT_TRY(closed, inspect::closed_mesh(model, *deviations.finder, options, context));
  io::VertexValues values;
  for (const float deviation : closed.deviation_mm) {
    const bool measured = !std::isnan(deviation);
    values.colours.push_back(measured ? colours.colour(static_cast<double>(deviation))
                                      : report::ColourMap::kNotScanned);
  }
  values.deviation_mm = std::move(closed.deviation_mm);
  values.filled = std::move(closed.filled);
  const Pose given_from_model = deviations.alignment.model_from_given.inverse(Eigen::Isometry);
  for (Eigen::Vector3d& vertex : closed.mesh.vertices) vertex = given_from_model * vertex;
  return io::write_mesh_ply(path, closed.mesh, values);
}

}  // namespace asbuilt::pipeline
