// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/evaluate/evaluate.h"
#include "commands.h"
#include "options.h"

namespace asbuilt::cli {
namespace {

struct Arguments {
  std::string truth, folder;
  evaluate::EvaluateOptions options;
};

Result<int> run(const Arguments& arguments, Shell& shell) {
  ASBUILT_CHECK(arguments.options.validate());
  ASBUILT_TRY(evaluation, evaluate::evaluate(arguments.truth, arguments.folder, arguments.options, shell.context()));
  shell.print_json(evaluate::to_json(evaluation));
  shell.print_result(evaluate::to_table(evaluation));
  return kDone;
}

}  // namespace

void add_evaluate_command(CLI::App& app, Shell& shell) {
  CLI::App* command = app.add_subcommand("evaluate", "Figures of a result against ground truth");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("TRUTH", arguments->truth, "truth.json, or the folder that holds it")->required();
  command->add_option("DIR", arguments->folder, "Folder that detect, register or reconstruct wrote")->required();
  add_common_options(*command, shell, false);
  for_each_field(arguments->options, [&](const char* name, auto& value, const char* help) {
    add_field(*command, name, value, help, "Evaluation");
  });
  command->footer(
      "Examples:\n"
      "  asbuilt evaluate scans/truth.json result\n"
      "  asbuilt evaluate scans result --json > figures.json");
  run_on_call(*command, shell, [arguments, &shell] { return run(*arguments, shell); });
}

}  // namespace asbuilt::cli
