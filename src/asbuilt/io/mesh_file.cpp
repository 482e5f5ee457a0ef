// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/mesh_file.h"

#include <new>
#include <utility>

#include "asbuilt/io/cad_mesh.h"
#include "asbuilt/io/file.h"
#include "asbuilt/io/file_kind.h"
#include "asbuilt/io/gzip.h"
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
    default:
      return input.error("is a scan, expected a model (.step, .iges, .brep, .stl, .ply, .obj, .off)");
  }
}

Result<ModelFile> read_mesh_file(FileKind kind, const Input& input, Unit unit) {
  ModelFile model;
  ASBUILT_TRY(mesh, read_kind(kind, input));
  if (mesh.empty()) return input.error("the file holds no triangles, expected a mesh");
  model.mesh = std::move(mesh);
  model.format = name_of(kind);
  if (kind == FileKind::stl) model.format += is_ascii_stl(input.content) ? " ascii" : " binary";
  model.unit = unit == Unit::stated ? Unit::millimetre : unit;
  for (Eigen::Vector3d& vertex : model.mesh.vertices) vertex *= millimetres_per(unit);
  return model;
}

}  // namespace

Result<ModelFile> model_from(const std::filesystem::path& path, const Input& input, const ModelReadOptions& options) {
  const double tolerance = options.tessellation_tolerance;
  if (!(tolerance >= 1e-6 && tolerance <= 0.05)) {
    return fail(ErrorCode::invalid_argument, "the tessellation tolerance must be in [1e-6, 0.05] of the diameter");
  }
  try {
    ASBUILT_TRY(kind, kind_of(path, input));
    if (is_cad(kind)) return read_cad(path, kind, input, options);
    return read_mesh_file(kind, input, options.unit);
  } catch (const std::bad_alloc&) {
    return input.error("the mesh does not fit into memory");
  }
}

Result<TriangleMesh> mesh_from(const std::filesystem::path& path, const Input& input, Unit unit) {
  ASBUILT_TRY(model, model_from(path, input, unit));
  return std::move(model.mesh);
}

Result<ModelFile> read_model(const std::filesystem::path& path, const ModelReadOptions& options) {
  ASBUILT_TRY(content, FileContent::open(path));
  const Input input{path.string(), content.view()};
  if (!is_gzip(input.content)) {
    auto model = model_from(path, input, options);
    ASBUILT_CHECK(content.whole());
    return model;
  }
  ASBUILT_TRY(unpacked, gunzip(input));
  return model_from(name_without_gz(path), {path.string(), unpacked}, options);
}

bool is_model_name(const std::filesystem::path& path) {
  const auto kind = kind_from_extension(lower_case(name_without_gz(path).extension().string()));
  return kind && (is_cad(*kind) || kind == FileKind::stl || kind == FileKind::off || kind == FileKind::obj);
}

Result<TriangleMesh> read_mesh(const std::filesystem::path& path, Unit unit) {
  ASBUILT_TRY(model, read_model(path, unit));
  return std::move(model.mesh);
}

}  // namespace asbuilt::io
