// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>

#include "asbuilt/io/file.h"
#include "commands.h"
#include "options.h"

namespace asbuilt::cli {
namespace {

struct Arguments {
  std::string model, cloud, output;
  pipeline::Options options;
};

std::string summary(const inspect::DeviationReport& report, const std::string& folder) {
  const auto& area = report.over_area;
  const std::size_t points = report.deviation_mm.size();
  std::string text = fmt::format("{} points, {:.0f} % of the surface scanned\n", points, 100.0 * report.coverage);
  if (2 * report.far_points > points) {
    text += fmt::format(
        "{} of the points lie too far from the part to count: is the cloud in the model's frame, and is --scan-unit "
        "its unit?\n",
        report.far_points == points
            ? "all"
            : fmt::format("{:.0f} %", 100.0 * static_cast<double>(report.far_points) / static_cast<double>(points)));
  }
  if (area.count > 0) {
    text += fmt::format(
        "deviation over the scanned surface: mean {:+.4g} mm, sigma {:.4g} mm, rms {:.4g} mm, 95 % within {:.4g} mm\n",
        area.mean, area.sigma, area.rms, area.p95);
  } else if (report.verdict) {
    text += fmt::format("tolerance: {}\n", inspect::name_of(*report.verdict));
  }
  if (area.in_tolerance) {
    text += fmt::format("tolerance: {}, {:.2f} % within, {:.2f} % over, {:.2f} % under\n",
                        inspect::name_of(report.verdict.value_or(inspect::Verdict::not_scanned)),
                        100.0 * *area.in_tolerance, 100.0 * area.over_tolerance.value_or(0.0),
                        100.0 * area.under_tolerance.value_or(0.0));
  }
  return text + fmt::format("report: {}\n", (std::filesystem::path(folder) / "report.html").string());
}

Result<int> run(const Arguments& arguments, Shell& shell) {
  ASBUILT_TRY(report, pipeline::inspect_cloud(arguments.model, arguments.cloud, arguments.options,
                                              output_of(arguments.output, shell), shell.context()));
  ASBUILT_TRY(json, io::read_file(std::filesystem::path(arguments.output) / "report.json"));
  shell.print_json(json);
  shell.print_result(summary(report, arguments.output));
  if (report.over_area.count == 0) return kNotDone;
  return report.verdict.value_or(inspect::Verdict::pass) == inspect::Verdict::pass ? kDone : kOutOfTolerance;
}

}  // namespace

void add_inspect_command(CLI::App& app, Shell& shell) {
  CLI::App* command = app.add_subcommand("inspect", "Deviation report of a cloud or mesh in the model frame");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("MODEL", arguments->model, "CAD model or prepared model")->required();
  command->add_option("CLOUD", arguments->cloud, "Cloud or mesh, already in the model frame")->required();
  command->add_option("-o,--output", arguments->output, "Folder to write")->required();
  add_common_options(*command, shell);
  add_pipeline_options(*command, arguments->options, {pipeline::Half::model});
  add_unit_option(*command, "--scan-unit", arguments->options.scan_unit, "Unit of the cloud");
  add_inspection_options(*command, arguments->options);
  for_each_field(arguments->options.inspect, [&](const char* name, auto& value, const char* help) {
    add_field(*command, std::string("inspect_") + name, value, help, "Inspection");
  });
  command->footer(
      "Examples:\n"
      "  asbuilt inspect part.stl result/reconstruction.ply -o deviation\n"
      "  asbuilt inspect part.step cloud.ply -o deviation --tolerance tolerances.csv --alignment best-fit --views");
  run_on_call(*command, shell, [arguments, &shell] { return run(*arguments, shell); });
}

}  // namespace asbuilt::cli
