// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "asbuilt/core/result.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/io/cad_face_name.h"
#include "asbuilt/io/unit.h"

namespace asbuilt::io {

/// What a user can say about a model file. A unit alone will do.
struct ModelReadOptions {
  Unit unit = Unit::stated;              ///< overrides what the file states
  double tessellation_tolerance = 1e-4;  ///< of CAD surfaces: distance of triangles to surface / diameter

  ModelReadOptions() = default;
  ModelReadOptions(Unit of_the_file) : unit(of_the_file) {}  // NOLINT(google-explicit-constructor)
};

/// A model as its file has it, in millimetres: not welded, not cleaned.
struct ModelFile {
  TriangleMesh mesh;                         ///< from CAD with the CAD face of each triangle
  std::string format;                        ///< for example "stl binary", "step"
  bool is_cad = false;                       ///< surfaces that were tessellated here, not a mesh
  std::size_t cad_faces = 0, cad_parts = 0;  ///< faces, and solids or shells, with every use in an assembly counted
  CadFaceNames face_names;                   ///< of STEP files, as far as they name faces or parts
  Unit unit = Unit::millimetre;              ///< in which the file was taken to be
  std::vector<std::string> notes;            ///< what should be known, a sentence each
};

/// Reads a model: meshes (PLY, STL, OBJ, OFF; ascii and binary; polygons are split into fans) and CAD surfaces (STEP,
/// IGES, OpenCASCADE BREP; assemblies with every part at its place). Errors: unreadable_input, also for a mesh without
/// triangles or a vertex index out of range, and for CAD files when this program was built without OpenCASCADE.
[[nodiscard]] Result<ModelFile> read_model(const std::filesystem::path& path, const ModelReadOptions& options);

/// The mesh of read_model alone.
[[nodiscard]] Result<TriangleMesh> read_mesh(const std::filesystem::path& path, Unit unit);

/// Whether a file of this name can only be a model (STEP, STL, ...), so that what is wrong with it is wrong with a
/// model.
[[nodiscard]] bool is_model_name(const std::filesystem::path& path);

/// Whether this program was built with OpenCASCADE and so reads STEP, IGES and BREP.
[[nodiscard]] bool reads_cad();

/// Binary little-endian PLY, written whole or not at all. CAD faces, where known, become the property `cad_face`.
[[nodiscard]] Result<void> write_mesh_ply(const std::filesystem::path& path, const TriangleMesh& mesh);

/// What a mesh can carry at its vertices; each empty or one per vertex.
struct VertexValues {
  std::vector<float> deviation_mm;
  std::vector<std::array<std::uint8_t, 3>> colours;
  std::vector<std::uint8_t> filled = {};  ///< 1 where nothing was measured
};
/// The same with the properties `deviation`, `red`, `green`, `blue` and `filled`, as far as they are given.
[[nodiscard]] Result<void> write_mesh_ply(const std::filesystem::path& path, const TriangleMesh& mesh,
                                          const VertexValues& values);

}  // namespace asbuilt::io
