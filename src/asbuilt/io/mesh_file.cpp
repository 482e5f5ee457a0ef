// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/mesh_file.h"

#include <new>

#include "asbuilt/io/file.h"
#include "asbuilt/io/file_kind.h"
#include "asbuilt/io/readers.h"

namespace asbuilt::io {
namespace {

Result<TriangleMesh> read_kind(FileKind kind, const Input& input) {
  switch (kind) {
    case FileKind::ply:
      return read_ply_mesh(input);
    case FileKind::stl:
      return read_stl_mesh(input);
    case FileKind::off:
      return read_off_mesh(input);
    case FileKind::obj:
      return read_obj_mesh(input);
    case FileKind::pcd:
    case FileKind::text:
      return input.error("is a point cloud, expected a mesh (.ply, .stl, .obj, .off)");
  }
  throw std::logic_error("asbuilt: expected a kind of file");
}

}  // namespace

Result<TriangleMesh> mesh_from(const std::filesystem::path& path, const Input& input, Unit unit) {
  try {
    ASBUILT_TRY(kind, kind_of(path, input));
    ASBUILT_TRY(mesh, read_kind(kind, input));
    if (mesh.empty()) return input.error("the file holds no triangles, expected a mesh");
    for (Eigen::Vector3d& vertex : mesh.vertices) vertex *= millimetres_per(unit);
    return std::move(mesh);
  } catch (const std::bad_alloc&) {
    return input.error("the mesh does not fit into memory");
  }
}

Result<TriangleMesh> read_mesh(const std::filesystem::path& path, Unit unit) {
  ASBUILT_TRY(content, read_file(path));
  return mesh_from(path, {path.string(), content}, unit);
}

}  // namespace asbuilt::io
