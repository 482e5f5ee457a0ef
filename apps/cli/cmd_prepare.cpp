// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "asbuilt/io/file.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/model/prepared_file.h"
#include "asbuilt/pipeline/load_model.h"
#include "commands.h"
#include "options.h"

namespace asbuilt::cli {
namespace {

struct Arguments {
  std::string model, output, skin;
  pipeline::Options options;
};

/// Before the long work: whether the file may be written. A prepared model may be replaced, nothing else without
/// --force.
Result<void> check_output(const std::string& path, bool force) {
  std::error_code ignored;
  const bool exists = std::filesystem::exists(path, ignored);
  if (exists && !force && !model::is_prepared_file(path)) {
    return fail(ErrorCode::unwritable_output,
                fmt::format("{}: exists and is no prepared model; choose another --output, or give --force", path));
  }
  if (exists) return {};
  auto written = io::write_file(path, "");
  std::filesystem::remove(path, ignored);
  return written;
}

/// What was found in the mesh and done to it, as far as there was something.
std::string findings(const model::PreparationReport& report) {
  std::string text;
  const auto add = [&](std::size_t count, std::string_view what) {
    if (count > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, what);
  };
  add(report.vertices_welded, "vertices welded");
  add(report.degenerate_dropped, "degenerate faces dropped");
  add(report.duplicates_dropped, "duplicated faces dropped");
  add(report.inner_dropped, "inner faces dropped");
  add(report.flipped, "faces turned outwards");
  if (text.empty()) text = "nothing to mend";
  return text + (report.open_edges > 0 ? fmt::format("; the skin is open along {} edges", report.open_edges)
                                       : "; the skin is closed");
}

std::size_t count_cad_faces(const TriangleMesh& skin) {
  std::vector<int> faces = skin.cad_faces;
  std::ranges::sort(faces);
  return static_cast<std::size_t>(std::ranges::unique(faces).begin() - faces.begin());
}

std::string summary(const pipeline::LoadedModel& model, const std::string& output) {
  const auto& prepared = model.prepared;
  const std::string near = prepared.symmetry.describe_near();
  return fmt::format(
      "{}: {} triangles read, {} in the outer skin{}\n"
      "{}\n"
      "diameter {:.6g} mm (the diagonal of the bounding box), sampling distance {:.4g} mm, {} samples\n"
      "symmetry: {}{}\n"
      "prepared model: {}\n",
      model.record.path, prepared.report.triangles_in, prepared.skin.triangles.size(),
      prepared.skin.cad_faces.empty() ? "" : fmt::format(" on {} CAD faces", count_cad_faces(prepared.skin)),
      findings(prepared.report), prepared.diameter, prepared.sampling_distance, prepared.samples.size(),
      prepared.symmetry.describe(), near.empty() ? "" : "; nearly the same: " + near, output);
}

Result<int> run(const Arguments& arguments, Shell& shell) {
  ASBUILT_CHECK(arguments.options.validate());
  ASBUILT_CHECK(check_output(arguments.output, shell.common.force));
  shell.show_stage("prepare_model", "");
  ASBUILT_TRY(model, pipeline::load_model(arguments.model, arguments.options, shell.context()));
  ASBUILT_CHECK(model::save_prepared(arguments.output, model.prepared));
  if (!arguments.skin.empty()) ASBUILT_CHECK(io::write_mesh_ply(arguments.skin, model.prepared.skin));
  shell.print_result(summary(model, arguments.output));
  const model::PreparationReport& report = model.prepared.report;
  shell.print_json(fmt::format(
      "{{\"schema\": 1, \"sha256\": \"{}\", \"triangles\": {}, \"diameter\": {}, "
      "\"sampling_distance\": {}, \"samples\": {}, \"symmetry\": \"{}\", \"near_symmetry\": \"{}\", "
      "\"triangles_read\": {}, \"vertices_welded\": {}, \"degenerate_dropped\": {}, \"duplicates_dropped\": {}, "
      "\"inner_dropped\": {}, \"flipped\": {}, \"open_edges\": {}, \"cad_faces\": {}}}\n",
      model.record.sha256, model.record.triangles, model.record.diameter, model.record.sampling_distance,
      model.prepared.samples.size(), model.prepared.symmetry.describe(), model.prepared.symmetry.describe_near(),
      report.triangles_in, report.vertices_welded, report.degenerate_dropped, report.duplicates_dropped,
      report.inner_dropped, report.flipped, report.open_edges, count_cad_faces(model.prepared.skin)));
  return kDone;
}

}  // namespace

void add_prepare_command(CLI::App& app, Shell& shell) {
  CLI::App* command = app.add_subcommand("prepare", "A prepared model, usable wherever MODEL stands");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("MODEL", arguments->model, "CAD model (STEP, IGES, BREP, STL, PLY, OBJ, OFF)")->required();
  command->add_option("-o,--output", arguments->output, "File to write")->required();
  command->add_option("--skin", arguments->skin, "Also write the cleaned outer skin, as PLY");
  add_common_options(*command, shell);
  add_pipeline_options(*command, arguments->options, {pipeline::Half::model});
  command->footer(
      "Examples:\n"
      "  asbuilt prepare part.stl -o part.asbuilt\n"
      "  asbuilt prepare part_in_metres.stl -o part.asbuilt --unit m --skin skin.ply");
  run_on_call(*command, shell, [arguments, &shell] { return run(*arguments, shell); });
}

}  // namespace asbuilt::cli
