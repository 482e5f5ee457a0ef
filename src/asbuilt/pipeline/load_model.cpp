// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/load_model.h"

#include <fmt/format.h>

#include "asbuilt/io/file.h"
#include "asbuilt/io/mesh_file.h"

namespace asbuilt::pipeline {

namespace {

Result<model::PreparedModel> prepared_from_file(const std::string& path, std::string sha256, const Options& options,
                                                io::Unit& unit, const Context& context) {
  ASBUILT_TRY(file, io::read_model(path, model_reading(options)));
  unit = file.unit;
  auto prepared = model::prepare(file.mesh, options.model, context);
  if (!prepared && prepared.error().code == ErrorCode::cancelled) return tl::unexpected(prepared.error());
  // A mesh that cannot be a part is no readable input, whatever its syntax.
  if (!prepared) return fail(ErrorCode::unreadable_input, fmt::format("{}: {}", path, prepared.error().message));
  prepared->report.notes.insert(prepared->report.notes.begin(), file.notes.begin(), file.notes.end());
  prepared->face_names = std::move(file.face_names);
  prepared->source_path = path;
  prepared->source_sha256 = std::move(sha256);
  return std::move(*prepared);
}

}  // namespace

Result<LoadedModel> load_model(const std::string& path, const Options& options, const Context& context,
                               model::PreparedFor use) {
  std::string sha256;
  {
    ASBUILT_TRY(content, io::FileContent::open(path));
    sha256 = io::sha256(content.view());
    ASBUILT_CHECK(content.whole());
  }
  LoadedModel loaded;
  ASBUILT_TRY(prepared, model::is_prepared_file(path)
                            ? model::load_prepared(path, context, use)
                            : prepared_from_file(path, sha256, options, loaded.unit, context));
  for (const std::string& note : prepared.report.notes) context.warn(fmt::format("{}: {}", path, note));
  // A prepared model is the same model as the mesh it came from.
  if (!prepared.source_sha256.empty()) sha256 = prepared.source_sha256;
  loaded.record = {path,
                   std::move(sha256),
                   prepared.skin.triangles.size(),
                   prepared.diameter,
                   prepared.sampling_distance,
                   prepared.symmetry.describe()};
  loaded.prepared = std::move(prepared);
  return loaded;
}

}  // namespace asbuilt::pipeline
