// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>

#include "asbuilt/io/file.h"
#include "asbuilt/model/prepared_file.h"
#include "asbuilt/pipeline/load_model.h"
#include "commands.h"
#include "options.h"

namespace asbuilt::cli {
namespace {

struct Arguments {
  std::string model, output;
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

std::string summary(const pipeline::LoadedModel& model, const std::string& output) {
  const auto& prepared = model.prepared;
  const std::string near = prepared.symmetry.describe_near();
  return fmt::format(
      "{}: {} triangles in the outer skin ({} read, {} inner dropped, {} flipped)\n"
      "diameter {:.6g} mm (the diagonal of the bounding box), sampling distance {:.4g} mm, {} samples\n"
      "symmetry: {}{}\n"
      "prepared model: {}\n",
      model.record.path, prepared.skin.triangles.size(), prepared.report.triangles_in, prepared.report.inner_dropped,
      prepared.report.flipped, prepared.diameter, prepared.sampling_distance, prepared.samples.size(),
      prepared.symmetry.describe(), near.empty() ? "" : "; nearly the same: " + near, output);
}

Result<int> run(const Arguments& arguments, Shell& shell) {
  ASBUILT_CHECK(arguments.options.validate());
  ASBUILT_CHECK(check_output(arguments.output, shell.common.force));
  shell.show_stage("prepare_model", "");
  ASBUILT_TRY(model, pipeline::load_model(arguments.model, arguments.options, shell.context()));
  ASBUILT_CHECK(model::save_prepared(arguments.output, model.prepared));
  shell.print_result(summary(model, arguments.output));
  shell.print_json(fmt::format(
      "{{\"schema\": 1, \"sha256\": \"{}\", \"triangles\": {}, \"diameter\": {}, "
      "\"sampling_distance\": {}, \"samples\": {}, \"symmetry\": \"{}\", \"near_symmetry\": \"{}\"}}\n",
      model.record.sha256, model.record.triangles, model.record.diameter, model.record.sampling_distance,
      model.prepared.samples.size(), model.prepared.symmetry.describe(), model.prepared.symmetry.describe_near()));
  return kDone;
}

}  // namespace

void add_prepare_command(CLI::App& app, Shell& shell) {
  CLI::App* command = app.add_subcommand("prepare", "A prepared model, usable wherever MODEL stands");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("MODEL", arguments->model, "CAD model (STL, PLY, OBJ, OFF)")->required();
  command->add_option("-o,--output", arguments->output, "File to write")->required();
  add_common_options(*command, shell);
  add_pipeline_options(*command, arguments->options, {pipeline::Half::model});
  command->footer(
      "Examples:\n"
      "  asbuilt prepare part.stl -o part.asbuilt\n"
      "  asbuilt prepare part_in_metres.stl -o part.asbuilt --unit m --sampling-ratio 0.03");
  run_on_call(*command, shell, [arguments, &shell] { return run(*arguments, shell); });
}

}  // namespace asbuilt::cli
