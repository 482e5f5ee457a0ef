// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "asbuilt/core/result.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/io/file_kind.h"
#include "asbuilt/io/readers.h"

namespace asbuilt::test {

inline void require(bool condition, const std::string& what) {
  if (!condition) throw std::runtime_error("a reader broke its promise: " + what);
}

template <class T>
void require_sound_error(const Result<T>& result) {
  require(result.error().code == ErrorCode::unreadable_input, "the code of the error");
  require(result.error().message.size() < 2000, "an error of one sentence");
  for (const char c : result.error().message) require(c >= ' ' && c <= '~', "an error that can be printed");
}

/// What holds for any input whatsoever: an error, or values that keep their invariants.
inline void require_sound(const Result<std::vector<io::ScanFile>>& scans) {
  if (!scans) return require_sound_error(scans);
  require(!scans->empty(), "at least one scan");
  for (const io::ScanFile& scan : *scans) {
    const bool may_be_empty =
        scan.format.starts_with("e57") || scan.format.starts_with("las") || scan.format.starts_with("ptx");
    require(may_be_empty || !scan.cloud.empty(), "no scan without points");
    require(scan.colours.empty() || scan.colours.size() == scan.cloud.size(), "a colour for each point");
    require(scan.intensities.empty() || scan.intensities.size() == scan.cloud.size(), "an intensity for each point");
    require(!scan.file_from_scan || is_rigid(scan.file_from_scan->matrix(), 1e-6), "a rigid pose");
    require(!scan.cloud.has_normals() || scan.cloud.normals.size() == scan.cloud.size(), "a normal for each point");
    require(!scan.viewpoint_mm || scan.viewpoint_mm->allFinite(), "a finite viewpoint");
    require(scan.offset_mm.allFinite(), "a finite offset");
  }
}

inline void require_sound(const Result<TriangleMesh>& mesh) {
  if (!mesh) return require_sound_error(mesh);
  require(!mesh->empty(), "at least one triangle");
  const auto count = static_cast<int>(mesh->vertices.size());
  for (const Eigen::Vector3i& triangle : mesh->triangles) {
    require(triangle.minCoeff() >= 0 && triangle.maxCoeff() < count, "triangles of vertices that exist");
  }
}

inline void require_sound(const Result<std::vector<io::NamedPose>>& poses) {
  if (!poses) return require_sound_error(poses);
  for (const io::NamedPose& pose : *poses) require(is_rigid(pose.model_from_scan.matrix(), 1e-9), "rigid poses");
}

inline void require_sound(const Result<std::vector<io::NamedViewpoint>>& viewpoints) {
  if (!viewpoints) return require_sound_error(viewpoints);
  for (const io::NamedViewpoint& viewpoint : *viewpoints) {
    require(viewpoint.viewpoint_mm.allFinite(), "finite viewpoints");
  }
}

/// Options with which every kind of scan can be read.
inline io::ReadOptions reading(io::Unit unit) {
  io::ReadOptions options = unit;
  options.camera = "500,500,1,1";
  return options;
}

/// Reads a content as the file of this name, in every way in which it can be read.
inline void read_in_every_way(const std::string& name, std::string_view content) {
  const io::Input input{name, content};
  require_sound(io::scans_in(name, content, reading(io::Unit::metre)));
  // What reads CAD surfaces is not ours, and not to be fuzzed here.
  const bool is_mesh = !io::kind_of(name, input) || !io::is_cad(*io::kind_of(name, input));
  if (is_mesh) require_sound(io::mesh_from(name, input, io::Unit::inch));
  require_sound(io::poses_from(input, io::Unit::stated));
  require_sound(io::viewpoints_from(input, io::Unit::stated));
}

}  // namespace asbuilt::test
