// SPDX-License-Identifier: Apache-2.0
#include "commands.h"
#include "options.h"

namespace asbuilt::cli {
namespace {

struct Arguments {
  std::string model, output;
  std::vector<std::string> scans;
  pipeline::Options options;
};

Result<int> reported(const Result<io::RunRecord>& record, const Arguments& arguments, Shell& shell) {
  if (!record) return tl::unexpected(record.error());
  shell.print_json(io::to_json(*record));
  shell.print_result(summary_of(*record, arguments.output));
  return exit_code_of(*record);
}

std::shared_ptr<Arguments> add_inputs(CLI::App& command) {
  auto arguments = std::make_shared<Arguments>();
  command.add_option("MODEL", arguments->model, "CAD model (STL, PLY, OBJ, OFF) or prepared model")->required();
  command.add_option("SCAN", arguments->scans, "Scans (PLY, PCD, XYZ, PTS, ASC, TXT, CSV)")->required();
  command.add_option("-o,--output", arguments->output, "Folder to write")->required();
  return arguments;
}

}  // namespace

void add_reconstruct_command(CLI::App& app, Shell& shell) {
  CLI::App* command = app.add_subcommand("reconstruct", "The whole way: scans in, reconstruction and report out");
  const auto arguments = add_inputs(*command);
  add_common_options(*command, shell);
  add_pipeline_options(*command, arguments->options,
                       {pipeline::Half::model, pipeline::Half::scan, pipeline::Half::joint});
  command->footer(
      "Examples:\n"
      "  asbuilt reconstruct part.stl scans/*.ply -o result\n"
      "  asbuilt reconstruct part.stl scans/*.ply -o result --scan-unit m --tolerance -0.5,0.5 --json > result.json");
  run_on_call(*command, shell, [arguments, &shell] {
    arguments->options.memory_gb = shell.common.memory_gb;
    return reported(pipeline::reconstruct(arguments->model, arguments->scans, arguments->options,
                                          output_of(arguments->output, shell), shell.context()),
                    *arguments, shell);
  });
}

void add_detect_command(CLI::App& app, Shell& shell) {
  CLI::App* command =
      app.add_subcommand("detect", "The per-scan half: poses and segments (can be spread over machines)");
  const auto arguments = add_inputs(*command);
  add_common_options(*command, shell);
  add_pipeline_options(*command, arguments->options, {pipeline::Half::model, pipeline::Half::scan});
  command->footer(
      "Examples:\n"
      "  asbuilt detect part.stl scans/scan_00.ply -o detected_00\n"
      "  asbuilt detect part.stl scans/*.ply -o detected --viewpoint none --noise 0.1");
  run_on_call(*command, shell, [arguments, &shell] {
    arguments->options.memory_gb = shell.common.memory_gb;
    return reported(pipeline::detect(arguments->model, arguments->scans, arguments->options,
                                     output_of(arguments->output, shell), shell.context()),
                    *arguments, shell);
  });
}

void add_register_command(CLI::App& app, Shell& shell) {
  CLI::App* command =
      app.add_subcommand("register", "The joint half, from one or more detect results: graph, refine, fuse");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("DIR", arguments->scans, "Folders that asbuilt detect wrote")->required();
  command->add_option("-o,--output", arguments->output, "Folder to write")->required();
  command->add_option("--model", arguments->model, "The model, if it has moved since");
  add_common_options(*command, shell);
  add_pipeline_options(*command, arguments->options, {pipeline::Half::joint});
  command->footer(
      "Examples:\n"
      "  asbuilt register detected -o result\n"
      "  asbuilt register detected_00 detected_01 detected_02 -o result --exclude scan_01");
  run_on_call(*command, shell, [arguments, &shell] {
    const auto model = arguments->model.empty() ? std::nullopt : std::optional(arguments->model);
    return reported(pipeline::register_runs(arguments->scans, model, arguments->options,
                                            output_of(arguments->output, shell), shell.context()),
                    *arguments, shell);
  });
}

}  // namespace asbuilt::cli
