// SPDX-License-Identifier: Apache-2.0
// asbuilt_refinement: what bench/refinement/run calls. Each subcommand appends its trials, one JSON object a line.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <type_traits>

#include "../program.h"
#include "asbuilt/graph/pose_graph.h"
#include "peer.h"
#include "summary.h"
#include "trial.h"

namespace asbuilt::bench {
namespace {

struct Arguments {
  std::filesystem::path out, cad;
  std::string part = "valve_body";  // of `scale`
  std::vector<std::string> folders, settings;
  std::vector<int> scans{8, 128}, own;
  std::vector<int> degrees{graph::PoseGraphOptions{}.edges.max_degree, 0};
  int enough_firm = graph::PoseGraphOptions{}.edges.enough_firm;
  double angle = 0.0, shift = 0.0;
  double deviation = -1.0;  // drawn for each scene
  double window = 1.0;
  int seeds = 10, count = 40, first = 0, scenes = 20, points = 60000, threads = 0;
};

Result<void> append(const Arguments& args, const std::vector<Trial>& trials) {
  if (trials.empty()) return {};  // `one` prints, and has no folder
  std::ofstream file(args.out / "trials.jsonl", std::ios::app);
  for (const Trial& trial : trials) {
    const nlohmann::ordered_json json{{"kind", trial.kind}, {"scene", trial.scene},     {"variant", trial.variant},
                                      {"seed", trial.seed}, {"figures", trial.figures}, {"note", trial.note}};
    file << json.dump() << "\n";
    fmt::print(stderr, "{}\n", json.dump());
  }
  file.flush();
  if (file) return {};
  return fail(ErrorCode::unwritable_output, fmt::format("{}: cannot be written", (args.out / "trials.jsonl").string()));
}

template <class Trials>
Result<void> for_each_folder(const Arguments& args, const Trials& trials_of) {
  const Context context(args.threads);
  for (const std::string& folder : args.folders) {
    ASBUILT_TRY(scene, scene_of_folder(folder, context));
    ASBUILT_TRY(trials, trials_of(scene, context));
    ASBUILT_CHECK(append(args, trials));
  }
  return {};
}

// Parts that --cad names, or our own.
Result<std::vector<ScenePart>> scene_parts(const Arguments& args) {
  if (!args.cad.empty()) return cad_scene_parts(args.cad);
  return own_scene_parts();
}

Result<void> run_own(const Arguments& args) {
  const Context context(args.threads);
  ASBUILT_TRY(parts, scene_parts(args));
  for (int number = args.first; number < args.first + args.scenes; ++number) {
    ASBUILT_TRY(scene, own_scene(number, parts, args.points, args.deviation, context));
    ASBUILT_TRY(trials, start_trials(scene, 1, context));
    for (Trial& trial : trials) trial.kind = args.cad.empty() ? "own" : "cad";
    ASBUILT_CHECK(append(args, trials));
  }
  return {};
}

// A set of trials each, written as they end.
Result<void> run_wrong(const Arguments& args) {
  const Context context(args.threads);
  const auto run_on = [&](const RefinementScene& scene) -> Result<void> {
    for (int seed = args.first; seed < args.first + args.count; ++seed) {
      ASBUILT_TRY(trial, wrong_trial(scene, seed, context));
      ASBUILT_CHECK(append(args, {std::move(trial)}));
    }
    return {};
  };
  for (const std::string& folder : args.folders) {
    ASBUILT_TRY(scene, scene_of_folder(folder, context));
    ASBUILT_CHECK(run_on(scene));
  }
  ASBUILT_TRY(parts, scene_parts(args));
  for (int number = 0; number < args.scenes; ++number) {
    ASBUILT_TRY(scene, own_scene(number, parts, args.points, args.deviation, context));
    ASBUILT_CHECK(run_on(scene));
  }
  return {};
}

Result<void> run_scale(const Arguments& args) {
  ASBUILT_TRY(parts, scene_parts(args));
  const auto part = std::ranges::find(parts, args.part, &ScenePart::name);
  if (part == parts.end()) {
    std::vector<std::string> names;
    for (const ScenePart& known : parts) names.push_back(known.name);
    return fail(ErrorCode::invalid_argument,
                fmt::format("--part {}: expected one of {}", args.part, fmt::join(names, ", ")));
  }
  ASBUILT_TRY(trials,
              scale_trials(*part, args.scans, args.degrees, args.enough_firm, args.window, Context(args.threads)));
  return append(args, trials);
}

template <class Options>
Result<void> apply(Options& options, const std::string& setting) {
  const auto at = setting.find('=');
  bool found = false;
  for_each_field(options, [&](std::string_view field, auto& target, std::string_view) {
    if (at == std::string::npos || field != setting.substr(0, at)) return;
    using Value = std::remove_cvref_t<decltype(target)>;
    const double value = std::stod(setting.substr(at + 1));
    if constexpr (std::is_same_v<Value, bool>) {
      target = value != 0.0;
    } else {
      target = static_cast<Value>(value);
    }
    found = true;
  });
  if (found) return {};
  return fail(ErrorCode::invalid_argument,
              fmt::format("--set {}: expected NAME=NUMBER of an option of graph or refinement", setting));
}

// One scene, one start, for development.
Result<void> run_one(const Arguments& args) {
  refine::RefineOptions options;
  graph::PoseGraphOptions graph_options;
  for (const std::string& setting : args.settings) {
    if (!apply(graph_options, setting)) ASBUILT_CHECK(apply(options, setting));
  }
  const auto one = [&](const RefinementScene& scene, const Context& context) -> Result<std::vector<Trial>> {
    const AccuracyJudge judge(scene);
    ASBUILT_TRY(run, joint_run(scene, perturbed(scene, args.angle, args.shift, 0), options, context, graph_options));
    const Accuracy accuracy = judge.judge(run.poses, context, run.members);
    fmt::print("{}: {} links, {} dropped, {} of {} together, {:.3f} sigma, ratio {:.4f}, {} iterations{}, {:.2f} s\n",
               scene.name, run.links, run.dropped.size(), run.members.size(), scene.views.size(),
               accuracy.relative_pose_error_sigma, accuracy.ratio_to_oracle(), run.refinement.iterations,
               run.refinement.converged ? "" : " (not converged)", run.seconds);
    fmt::print("  views fitted to the true surface: {:.3f} sigma\n", judge.error_of_fits_to_truth(context));
    for (std::size_t i = 0; i < run.members.size(); ++i) {
      const std::vector<int> pair{run.members[static_cast<std::size_t>(run.refinement.fixed_view)], run.members[i]};
      if (run.refinement.view_holds.empty() || pair[0] == pair[1]) continue;
      const auto& hold = run.refinement.view_holds[i];
      fmt::print("  {} against {}: {:.2f} sigma; 1 sigma of the hold {:.2f} to {:.3f} sigma{}\n",
                 scene.names[static_cast<std::size_t>(pair[1])], scene.names[static_cast<std::size_t>(pair[0])],
                 judge.relative_pose_error(run.poses, pair), hold.sigma_mm[0] / scene.noise_sigma_mm,
                 hold.sigma_mm[5] / scene.noise_sigma_mm, hold.loose.empty() ? "" : ", loose");
      for (const refine::LooseMotion& loose : hold.loose) {
        const Eigen::Vector3d& d = loose.motion.direction;
        fmt::print(
            "    {} ({:.2f}, {:.2f}, {:.2f}) {}\n", loose.motion.is_turn ? "turn" : "slide", d.x(), d.y(), d.z(),
            loose.unheld ? std::string("unheld") : fmt::format("{:.2f} sigma", loose.sigma_mm / scene.noise_sigma_mm));
      }
    }
    std::fflush(stdout);
    return std::vector<Trial>{};
  };
  ASBUILT_CHECK(for_each_folder(args, one));
  const Context context(args.threads);
  ASBUILT_TRY(parts, scene_parts(args));
  for (const int number : args.own) {
    ASBUILT_TRY(scene, own_scene(number, parts, args.points, args.deviation, context));
    ASBUILT_CHECK(one(scene, context));
  }
  return {};
}

int run(int argc, char** argv) {
  Arguments args;
  CLI::App app("The refinement suite (bench/README.md)");
  app.require_subcommand(1);
  app.add_option("--threads", args.threads, "0: all cores");
  const auto with_out = [&](CLI::App* command) { command->add_option("out", args.out, "folder")->required(); };
  const auto with_folders = [&](CLI::App* command) {
    command->add_option("folders", args.folders, "folders with truth.json")->required();
  };
  CLI::App* starts = app.add_subcommand("starts", "from starts that are off");
  CLI::App* ablation = app.add_subcommand("ablation", "each switch turned over");
  CLI::App* wrong = app.add_subcommand("wrong", "one pose is wrong");
  CLI::App* own = app.add_subcommand("own", "scenes of our own simulator");
  CLI::App* scale = app.add_subcommand("scale", "many scans");
  CLI::App* peer = app.add_subcommand("peer", "Open3D's multiway registration");
  CLI::App* summary = app.add_subcommand("summary", "tables and pictures of what was run");
  CLI::App* one = app.add_subcommand("one", "one start, printed");
  for (CLI::App* command : {starts, ablation, wrong, own, scale, peer, summary}) with_out(command);
  for (CLI::App* command : {starts, ablation, peer}) with_folders(command);
  one->add_option("folders", args.folders, "folders with truth.json");
  one->add_option("--own", args.own, "numbers of scenes of our own simulator");
  wrong->add_option("folders", args.folders, "folders with truth.json");
  wrong->add_option("--own", args.scenes, "scenes of our own simulator after them")->default_val(0);
  wrong->add_option("--first", args.first, "first seed");
  for (CLI::App* command : {starts, peer}) command->add_option("--seeds", args.seeds);
  wrong->add_option("--count", args.count, "trials a set");
  own->add_option("--scenes", args.scenes);
  own->add_option("--first", args.first, "first scene");
  for (CLI::App* command : {own, wrong, one, scale}) {
    command->add_option("--cad", args.cad, "scenes of the parts of this folder");
  }
  for (CLI::App* command : {own, wrong, one}) {
    command->add_option("--points", args.points, "of a scan of our own simulator");
    command->add_option("--deviation", args.deviation, "as-built deviation / diameter (default: 0.2 to 1 %, drawn)");
  }
  scale->add_option("--scans", args.scans);
  scale->add_option("--part", args.part, "one of our own, or of --cad")->capture_default_str();
  scale->add_option("--degrees", args.degrees, "links that a scan may have; 0: all");
  scale->add_option("--enough-firm", args.enough_firm, "firm links with which it needs no more; 0: up to the cap");
  scale->add_option("--window", args.window, "share of the part's length that a scan sees; 1: all it can")
      ->check(CLI::Range(0.05, 1.0));
  one->add_option("--set", args.settings, "NAME=NUMBER");
  one->add_option("--angle", args.angle);
  one->add_option("--shift", args.shift);
  CLI11_PARSE(app, argc, argv);

  if (!args.out.empty()) std::filesystem::create_directories(args.out);
  Result<void> done;
  if (starts->parsed()) {
    done = for_each_folder(
        args, [&](const auto& scene, const auto& context) { return start_trials(scene, args.seeds, context); });
  } else if (ablation->parsed()) {
    done =
        for_each_folder(args, [](const auto& scene, const auto& context) { return ablation_trials(scene, context); });
  } else if (wrong->parsed()) {
    done = run_wrong(args);
  } else if (peer->parsed()) {
    done = for_each_folder(
        args, [&](const auto& scene, const auto& context) { return peer_trials(scene, args.seeds, context); });
  } else if (own->parsed()) {
    done = run_own(args);
  } else if (scale->parsed()) {
    done = run_scale(args);
  } else if (summary->parsed()) {
    done = write_summary(args.out);
  } else {
    done = run_one(args);
  }
  if (done) return 0;
  fmt::print(stderr, "asbuilt_refinement: {}\n", done.error().message);
  return 1;
}

}  // namespace
}  // namespace asbuilt::bench

int main(int argc, char** argv) {
  return asbuilt::bench::run_program("asbuilt_refinement", asbuilt::bench::run, argc, argv);
}
