// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>

#include "asbuilt/io/run_record.h"
#include "asbuilt/pipeline/scan_hints.h"
#include "commands.h"
#include "explain_text.h"
#include "options.h"

namespace asbuilt::cli {
namespace {

struct Arguments {
  std::string folder, scan;
};

std::string state_sentence(const io::RunRecord& record) {
  if (record.state != io::RunState::partial) return {};
  return "The run is not finished: give its command again, it goes on from there.\n";
}

Result<int> run(const Arguments& arguments, Shell& shell) {
  ASBUILT_TRY(record, io::read_run_record(std::filesystem::path(arguments.folder) / "result.json"));
  std::string text = state_sentence(record);
  bool found = false;
  for (std::size_t i = 0; i < record.scans.size(); ++i) {
    const io::ScanRecord& scan = record.scans[i];
    if (!arguments.scan.empty() && !pipeline::names_entry(arguments.scan, scan)) continue;
    found = true;
    text += explanation_of(record, i);
  }
  if (!found && !arguments.scan.empty()) {
    return fail(ErrorCode::invalid_argument, fmt::format("{}: has no scan '{}'; asbuilt explain {} lists them all",
                                                         arguments.folder, arguments.scan, arguments.folder));
  }
  shell.print_json(io::to_json(record));
  shell.print_result(text);
  return kDone;
}

}  // namespace

void add_explain_command(CLI::App& app, Shell& shell) {
  CLI::App* command = app.add_subcommand("explain", "Why a scan was accepted or rejected, in words and numbers");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("DIR", arguments->folder, "Folder that detect, register or reconstruct wrote")->required();
  command->add_option("SCAN", arguments->scan, "One scan, by name or path (default: all)");
  add_common_options(*command, shell, false);
  command->footer(
      "Examples:\n"
      "  asbuilt explain result\n"
      "  asbuilt explain result scan_03");
  run_on_call(*command, shell, [arguments, &shell] { return run(*arguments, shell); });
}

}  // namespace asbuilt::cli
