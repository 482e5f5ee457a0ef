// SPDX-License-Identifier: Apache-2.0
// asbuilt_measure: gathers the figures of finished runs in one JSON file and prints them as Markdown tables.
// bench/real/run and bench/pipeline/run call it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "../program.h"
#include "asbuilt/io/file.h"
#include "asbuilt/io/run_record.h"
#include "figures.h"
#include "tables.h"

namespace asbuilt::bench {
namespace {

using Json = nlohmann::ordered_json;

struct Arguments {
  std::filesystem::path figures_json;
  std::string name, unit = "mm";
  int exit_code = 0;
  RealRun real;
  std::filesystem::path evaluation_json;
};

Result<Json> read_figures(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path)) return Json::object();
  ASBUILT_TRY(text, io::read_file(path));
  Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return fail(ErrorCode::unreadable_input, fmt::format("{}: no JSON object", path.string()));
  return json;
}

Result<void> store(const Arguments& arguments, const char* section, Json value) {
  ASBUILT_TRY(figures, read_figures(arguments.figures_json));
  figures[section][arguments.name] = std::move(value);
  return io::write_file(arguments.figures_json, figures.dump(1) + "\n");
}

Json to_json(const PoseFigures& pose) {
  Json json{
      {"scan", pose.scan},           {"status", pose.status},           {"right", pose.right},
      {"angle_deg", pose.angle_deg}, {"centroid_mm", pose.centroid_mm}, {"worst_vertex_mm", pose.worst_vertex_mm}};
  if (!pose.accepted) json["reason"] = pose.reason;
  return json;
}

Json to_json(const RealFigures& figures) {
  Json json{{"given", figures.given}, {"accepted", figures.accepted},     {"right", figures.right},
            {"wrong", figures.wrong}, {"components", figures.components}, {"diameter_mm", figures.diameter_mm}};
  if (figures.mean_distance_mm) {
    json["mean_distance_mm"] = *figures.mean_distance_mm;
    json["reference_distance_mm"] = *figures.reference_distance_mm;
    double angle = 0.0, centroid = 0.0;
    for (const PoseFigures& pose : figures.poses) {
      if (!pose.accepted) continue;
      angle = std::max(angle, pose.angle_deg);
      centroid = std::max(centroid, pose.centroid_mm);
    }
    json["worst_angle_deg"] = angle;
    json["worst_centroid_mm"] = centroid;
  }
  for (const PoseFigures& pose : figures.poses) json["poses"].push_back(to_json(pose));
  return json;
}

Result<void> measure_real(Arguments arguments) {
  ASBUILT_TRY(unit, io::unit_from_name(arguments.unit));
  arguments.real.unit = unit;
  Json json{{"given", 0}, {"accepted", 0}, {"right", 0}, {"wrong", 0}, {"components", 0}};
  if (std::filesystem::exists(arguments.real.result_dir / "result.json")) {
    ASBUILT_TRY(figures, measure(arguments.real, Context()));
    json = to_json(figures);
  }
  json["exit_code"] = arguments.exit_code;
  return store(arguments, "real", std::move(json));
}

Result<void> measure_simulated(const Arguments& arguments) {
  Json evaluation = Json::object();
  if (std::filesystem::exists(arguments.evaluation_json)) {
    ASBUILT_TRY(text, io::read_file(arguments.evaluation_json));
    evaluation = Json::parse(text, nullptr, false);
    if (!evaluation.is_object()) evaluation = Json::object();
  }
  return store(arguments, "simulated", {{"evaluation", evaluation}, {"exit_code", arguments.exit_code}});
}

// The time of a stage is the sum over its scans; memory is the process's peak at the end of the stage.
Result<void> measure_stages(const Arguments& arguments) {
  ASBUILT_TRY(timing, io::read_timing_record(arguments.real.result_dir / "timing.json"));
  Json stages = Json::array();
  for (const io::StageTime& time : timing.stages) {
    auto known = std::ranges::find_if(stages, [&](const Json& stage) { return stage.at("stage") == time.stage; });
    if (known == stages.end()) {
      stages.push_back({{"stage", time.stage}, {"seconds", 0.0}, {"peak_memory_mb", 0.0}});
      known = stages.end() - 1;
    }
    Json& stage = *known;
    stage["seconds"] = stage["seconds"].get<double>() + time.seconds;
    stage["peak_memory_mb"] =
        std::max(stage["peak_memory_mb"].get<double>(), static_cast<double>(time.peak_memory_bytes) / 1e6);
  }
  return store(arguments, "stages", {{"threads", timing.threads}, {"seconds", timing.seconds}, {"stages", stages}});
}

Result<void> print_tables(const Arguments& arguments) {
  ASBUILT_TRY(figures, read_figures(arguments.figures_json));
  fmt::print("{}", tables(figures));
  return {};
}

int run(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Figures of finished asbuilt runs");
  app.add_option("--figures", arguments.figures_json, "JSON file that the figures are gathered in")->required();
  app.require_subcommand(1);

  CLI::App* real = app.add_subcommand("real", "A run on real scans against reference poses");
  real->add_option("name", arguments.name)->required();
  real->add_option("result", arguments.real.result_dir, "DIR of asbuilt reconstruct")->required();
  real->add_option("--model", arguments.real.model)->required();
  real->add_option("--unit", arguments.unit, "of model, scans and reference poses");
  real->add_option("--reference", arguments.real.reference, "file, or folder with NAME.txt a scan")->required();
  real->add_option("--exit-code", arguments.exit_code, "of asbuilt reconstruct");

  CLI::App* simulated = app.add_subcommand("simulated", "A run on simulated scans, as asbuilt evaluate judged it");
  simulated->add_option("name", arguments.name)->required();
  simulated->add_option("evaluation", arguments.evaluation_json, "what asbuilt evaluate --json printed")->required();
  simulated->add_option("--exit-code", arguments.exit_code, "of asbuilt reconstruct");

  CLI::App* stages = app.add_subcommand("stages", "Time and memory of a run");
  stages->add_option("name", arguments.name)->required();
  stages->add_option("result", arguments.real.result_dir, "DIR of asbuilt reconstruct")->required();

  const CLI::App* print = app.add_subcommand("tables", "Print what was gathered");
  CLI11_PARSE(app, argc, argv);

  const Result<void> done = real->parsed()        ? measure_real(arguments)
                            : simulated->parsed() ? measure_simulated(arguments)
                            : stages->parsed()    ? measure_stages(arguments)
                            : print->parsed()     ? print_tables(arguments)
                                                  : Result<void>{};
  if (done) return 0;
  fmt::print(stderr, "asbuilt_measure: {}\n", done.error().message);
  return 1;
}

}  // namespace
}  // namespace asbuilt::bench

int main(int argc, char** argv) {
  return asbuilt::bench::run_program("asbuilt_measure", asbuilt::bench::run, argc, argv);
}
