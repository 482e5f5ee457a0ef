// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>

#include "asbuilt/io/run_record.h"
#include "asbuilt/pipeline/export_run.h"
#include "commands.h"
#include "options.h"

namespace asbuilt::cli {
namespace {

struct Arguments {
  std::string folder, output;
};

Result<int> run(const Arguments& arguments, Shell& shell) {
  const std::filesystem::path folder(arguments.folder);
  ASBUILT_TRY(record, io::read_run_record(folder / "result.json"));
  std::error_code ignored;
  if (std::filesystem::exists(arguments.output, ignored) && !shell.common.force) {
    return fail(ErrorCode::unwritable_output,
                fmt::format("{}: exists; choose another --output, or give --force", arguments.output));
  }
  ASBUILT_TRY(scans, pipeline::export_run(folder, record, arguments.output));
  if (scans < record.scans.size()) {
    shell.warn(fmt::format("{} of {} scans were not accepted and are not in {}", record.scans.size() - scans,
                           record.scans.size(), arguments.output));
  }
  shell.print_result(fmt::format("{} scans in the model frame: {}\n", scans, arguments.output));
  shell.print_json(fmt::format("{{\"schema\": 1, \"scans\": {}}}\n", scans));
  return kDone;
}

}  // namespace

void add_export_command(CLI::App& app, Shell& shell) {
  CLI::App* command = app.add_subcommand("export", "The accepted scans in the model frame, for other software");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("DIR", arguments->folder, "Folder that detect, register or reconstruct wrote")->required();
  command
      ->add_option(
          "-o,--output", arguments->output,
          "File to write: .csv (name,a11,...,a44, model_from_scan in mm) or .e57 (the part's points with poses)")
      ->required();
  add_common_options(*command, shell);
  command->footer(
      "Examples:\n"
      "  asbuilt export result -o poses.csv\n"
      "  asbuilt export result -o aligned.e57");
  run_on_call(*command, shell, [arguments, &shell] { return run(*arguments, shell); });
}

}  // namespace asbuilt::cli
