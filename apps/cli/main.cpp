// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <new>

#include "asbuilt/io/run_record.h"
#include "commands.h"
#include "config.h"
#include "interruption.h"
#include "version.h"

namespace {

using namespace asbuilt;
using namespace asbuilt::cli;

void add_commands(CLI::App& app, Shell& shell) {
  add_reconstruct_command(app, shell);
  add_prepare_command(app, shell);
  add_detect_command(app, shell);
  add_register_command(app, shell);
  add_inspect_command(app, shell);
  add_explain_command(app, shell);
  add_simulate_command(app, shell);
  add_evaluate_command(app, shell);
  add_export_command(app, shell);
  add_live_command(app, shell);
  add_info_command(app, shell);
}

/// CLI11 has a code of its own for every kind of mistake; ours know only "usage".
int leave_after(const CLI::App& app, const CLI::ParseError& error) { return app.exit(error) == 0 ? kDone : kUsage; }

int run(std::vector<std::string> arguments, Shell& shell) {
  CLI::App app("Parts as built, from a CAD model and cluttered 3D scans", "asbuilt");
  app.set_version_flag("--version", fmt::format("asbuilt {} (result schema {})", kVersion, io::RunRecord::kSchema));
  app.require_subcommand(1);
  app.fallthrough(false);
  add_commands(app, shell);
  try {
    auto complete = with_config(app, std::move(arguments));
    if (!complete) {
      shell.finish(complete.error());
      return shell.leave();
    }
    shell.arguments = *complete;
    std::ranges::reverse(*complete);  // CLI11 takes them from the back
    app.parse(std::move(*complete));
  } catch (const CLI::ParseError& error) {
    return leave_after(app, error);
  }
  return shell.leave();
}

}  // namespace

int main(int argc, char** argv) {
  Shell shell(watch_for_interruption());
  try {
    return run({argv + 1, argv + argc}, shell);
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "asbuilt: there is not enough memory for this; thin the input, or raise --memory\n");
  } catch (const std::exception& error) {
    fmt::print(stderr, "asbuilt: a defect in asbuilt itself: {}; please report it with the command you gave\n",
               error.what());
  }
  return kNotDone;
}
