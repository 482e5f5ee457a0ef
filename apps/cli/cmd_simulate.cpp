// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>

#include "asbuilt/core/parallel.h"
#include "asbuilt/io/file.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/pipeline/run_folder.h"
#include "asbuilt/simulate/parts.h"
#include "asbuilt/simulate/simulate.h"
#include "commands.h"
#include "options.h"

namespace asbuilt::cli {
namespace {

struct Arguments {
  std::string model, output;
  io::Unit unit = io::Unit::stated;
  simulate::SimulateOptions options;
};

Result<TriangleMesh> model_of(const Arguments& arguments) {
  if (arguments.model == "demo:valve_body") return simulate::valve_body();
  if (arguments.model.starts_with("demo:")) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("{}: there is no such demonstration part; there is demo:valve_body", arguments.model));
  }
  return io::read_mesh(arguments.model, arguments.unit);
}

Result<int> run(const Arguments& arguments, Shell& shell) {
  ASBUILT_CHECK(arguments.options.validate());
  const Context context = shell.context();
  ASBUILT_TRY(folder,
              pipeline::RunFolder::open(arguments.output, "simulate", shell.common.force, context.arena().threads()));
  ASBUILT_TRY(model, model_of(arguments));
  shell.show_stage("simulate", "");
  auto simulation = simulate::simulate(model, arguments.options, context);
  if (!simulation && simulation.error().code == ErrorCode::not_possible) {
    return fail(ErrorCode::unreadable_input, fmt::format("{}: {}", arguments.model, simulation.error().message));
  }
  if (!simulation) return tl::unexpected(simulation.error());
  ASBUILT_CHECK(simulate::write_simulation(arguments.output, *simulation));
  ASBUILT_CHECK(folder.finish());
  for (const auto& scan : simulation->scans) {
    const std::string part = !scan.model_from_scan ? "no part"
                             : scan.other_placements.empty()
                                 ? "the part is there"
                                 : fmt::format("the part is there in {} places", scan.other_placements.size() + 1);
    shell.print_result(fmt::format("{}: {} points, {}, clutter {:.2f}, hidden {:.2f}\n", scan.name,
                                   scan.points_in_scan.size(), part, scan.clutter, scan.hidden));
  }
  const auto truth = std::filesystem::path(arguments.output) / "truth.json";
  ASBUILT_TRY(json, io::read_file(truth));
  shell.print_json(json);
  shell.print_result(fmt::format("truth: {}\n", truth.string()));
  return kDone;
}

}  // namespace

void add_simulate_command(CLI::App& app, Shell& shell) {
  CLI::App* command = app.add_subcommand("simulate", "Scans with ground truth, from a virtual scanner");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("MODEL", arguments->model, "CAD model (STL, PLY, OBJ, OFF), or demo:valve_body")->required();
  command->add_option("-o,--output", arguments->output, "Folder to write")->required();
  add_unit_option(*command, "--unit", arguments->unit, "Unit of the model: mm, cm, m, inch or foot");
  add_common_options(*command, shell);
  for_each_field(arguments->options, [&](const char* name, auto& value, const char* help) {
    add_field(*command, name, value, help, "The scenes and the scanner");
  });
  command->footer(
      "Examples:\n"
      "  asbuilt simulate demo:valve_body -o scans --scans 8 --seed 1\n"
      "  asbuilt simulate part.stl -o scans --sensor laser-scanner --absent-share 0.5 --decoys 1");
  run_on_call(*command, shell, [arguments, &shell] { return run(*arguments, shell); });
}

}  // namespace asbuilt::cli
