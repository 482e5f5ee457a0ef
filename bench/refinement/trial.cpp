// SPDX-License-Identifier: Apache-2.0
#include "trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "../detection/parts.h"
#include "../stopwatch.h"
#include "asbuilt/core/random.h"
#include "asbuilt/graph/pose_graph.h"
#include "asbuilt/refine/gauge.h"
#include "asbuilt/refine/loose_views.h"
#include "asbuilt/refine/suspicious_view.h"
#include "asbuilt/simulate/parts.h"

namespace asbuilt::bench {
namespace {

std::vector<refine::View> chosen(const std::vector<refine::View>& views, const std::vector<int>& members) {
  std::vector<refine::View> result;
  for (const int member : members) result.push_back(views[static_cast<std::size_t>(member)]);
  return result;
}

std::vector<Pose> poses_of(const std::vector<refine::View>& views) {
  std::vector<Pose> poses;
  for (const refine::View& view : views) poses.push_back(view.model_from_scan);
  return poses;
}

// The links among `members` (indices into `left`), numbered by their place in `members`.
std::vector<refine::Link> links_among(const graph::PoseGraph& graph, const std::vector<int>& members) {
  std::vector<int> place(static_cast<std::size_t>(*std::ranges::max_element(members)) + 1, -1);
  for (std::size_t i = 0; i < members.size(); ++i) place[static_cast<std::size_t>(members[i])] = static_cast<int>(i);
  const auto at = [&](int scan) {
    return static_cast<std::size_t>(scan) < place.size() ? place[static_cast<std::size_t>(scan)] : -1;
  };
  std::vector<refine::Link> links;
  for (const graph::PairOverlap& edge : graph.edges) {
    if (at(edge.first) >= 0 && at(edge.second) >= 0) links.push_back({at(edge.first), at(edge.second)});
  }
  return links;
}

// Leaves of each view what lies in a window of that share of the part's length, as of a sensor that is carried along
// it. The middles of the first views are spread as evenly as those of all.
void look_along(RefinementScene& scene, double window) {
  const Eigen::AlignedBox3d& box = scene.prepared.box;
  Eigen::Index axis = 0;
  const double length = box.sizes().maxCoeff(&axis);
  constexpr double kGoldenRatio = 0.6180339887498949;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    const double part = std::fmod(kGoldenRatio * static_cast<double>(v), 1.0);
    const double middle = box.min()[axis] + length * (0.5 * window + (1.0 - window) * part);
    const PointCloud& whole = scene.views[v].segment_in_scan;
    PointCloud kept;
    for (std::size_t i = 0; i < whole.size(); ++i) {
      const double along = (scene.truth[v] * whole.positions[i].cast<double>())[axis];
      if (std::abs(along - middle) > 0.5 * window * length) continue;
      kept.positions.push_back(whole.positions[i]);
      kept.normals.push_back(whole.normals[i]);
    }
    scene.views[v].segment_in_scan = std::move(kept);
  }
}

// What tells trials of `scale` apart.
std::string scale_variant(int scans, int max_degree, int enough_firm, double window) {
  const std::string seen = window < 1.0 ? fmt::format("{} scans of {:.0f} % of the length", scans, 100.0 * window)
                                        : fmt::format("{} scans", scans);
  if (max_degree == 0) return seen + ", all links";
  const std::string text = fmt::format("{}, at most {} links each", seen, max_degree);
  return enough_firm == 0 ? text : fmt::format("{}, {} firm ones enough", text, enough_firm);
}

Trial trial_of(const char* kind, const RefinementScene& scene, std::string variant, std::uint64_t seed,
               const JointRun& run) {
  Trial trial{kind, scene.name, std::move(variant), seed, {}, {}};
  trial.figures["views"] = static_cast<double>(scene.views.size());
  trial.figures["points"] = static_cast<double>(scene.points());
  trial.figures["links"] = static_cast<double>(run.links);
  trial.figures["iterations"] = run.refinement.iterations;
  trial.figures["converged"] = run.refinement.converged ? 1.0 : 0.0;
  trial.figures["seconds"] = run.seconds;
  trial.figures["cpu_seconds"] = run.cpu_seconds;
  trial.figures["dropped"] = static_cast<double>(run.dropped.size());
  return trial;
}

// The part turned by half about an axis of its box, slid, or anywhere near where it is.
Pose wrong_motion(const RefinementScene& scene, int kind, Random& random) {
  const Eigen::Vector3d middle = scene.prepared.box.center();
  Eigen::Vector3d direction(random.normal(), random.normal(), random.normal());
  direction.normalize();
  if (kind == 0) {
    const Eigen::Vector3d axis = Eigen::Vector3d::Unit(static_cast<Eigen::Index>(random.below(3)));
    return Eigen::Translation3d(middle) * Eigen::AngleAxisd(std::numbers::pi, axis) * Eigen::Translation3d(-middle);
  }
  if (kind == 1) return Pose(Eigen::Translation3d(random.uniform(0.02, 0.05) * scene.diameter_mm() * direction));
  return Eigen::Translation3d(middle + 0.1 * scene.diameter_mm() * direction) *
         Eigen::AngleAxisd(random.uniform(0.5, 3.0), direction) * Eigen::Translation3d(-middle);
}

}  // namespace

Result<JointRun> joint_run(const RefinementScene& scene, std::vector<refine::View> views,
                           const refine::RefineOptions& options, const Context& context,
                           const graph::PoseGraphOptions& graph_options) {
  const Stopwatch watch;
  JointRun run;
  run.poses = poses_of(views);
  std::vector<int> left(views.size());
  std::iota(left.begin(), left.end(), 0);
  if (!options.paper_mode) {
    for (refine::View& view : views) {
      ASBUILT_TRY(near, refine::start_near_model(view, *scene.prepared.surface, scene.diameter_mm(), context));
      view.model_from_scan = near;
    }
  }
  refine::sample_views(views, options, context);
  const std::vector<refine::View> start = views;
  const auto timed = [&] {
    run.seconds = watch.seconds();
    run.cpu_seconds = watch.cpu_seconds();
    return run;
  };
  graph::PoseGraph graph_before;
  constexpr int kMostRounds = 3;
  for (int round = 1;; ++round) {
    const std::vector<refine::View> remaining = chosen(views, left);
    std::vector<graph::PosedSegment> segments;
    for (const refine::View& view : remaining) segments.push_back({view.segment_in_scan, view.model_from_scan});
    ASBUILT_TRY(graph, graph::build_graph(segments, scene.prepared, graph_options, context));
    if (round > 2 && graph::links_alike(graph, graph_before)) return timed();
    const std::vector<int>& members = graph.components.front();
    std::vector<refine::View> together = chosen(remaining, members);
    if (graph.components != graph_before.components) {
      for (refine::View& view : together) view.earlier = {};
    }
    graph_before = graph;
    const std::vector<refine::Link> links = links_among(graph, members);
    ASBUILT_TRY(refinement, refine::refine_on_model(together, links, *scene.prepared.surface, scene.diameter_mm(),
                                                    options, context));
    ASBUILT_TRY(suspect, refine::view_against_others(together, links, refinement, context));
    if (suspect && round > 1) {
      const int at = members[static_cast<std::size_t>(suspect->view)];
      run.dropped.push_back(left[static_cast<std::size_t>(at)]);
      left.erase(left.begin() + at);
      views = start;
      round = 0;
      continue;
    }
    run.members.clear();
    for (std::size_t i = 0; i < members.size(); ++i) {
      const int view = left[static_cast<std::size_t>(members[i])];
      run.members.push_back(view);
      run.poses[static_cast<std::size_t>(view)] = refinement.model_from_scan[i];
      views[static_cast<std::size_t>(view)].model_from_scan = refinement.model_from_scan[i];
      // One that has gone astray must find its way back from afar.
      views[static_cast<std::size_t>(view)].earlier = suspect ? refine::HandedOn{} : refinement.handed_on[i];
    }
    run.links = links.size();
    run.refinement = refinement;
    if (round == kMostRounds || options.paper_mode) return timed();
  }
}

Result<std::vector<Trial>> start_trials(const RefinementScene& scene, int seeds, const Context& context) {
  const AccuracyJudge judge(scene);
  std::vector<Trial> trials;
  ASBUILT_TRY(reference, joint_run(scene, scene.views, {}, context));
  const auto add = [&](std::string variant, int seed, const JointRun& run, bool with_surface) {
    Trial trial = trial_of("start", scene, std::move(variant), static_cast<std::uint64_t>(seed), run);
    trial.figures["error_sigma"] = judge.relative_pose_error(run.poses, run.members);
    trial.figures["from_reference_sigma"] = judge.difference(run.poses, reference.poses, run.members);
    if (with_surface) trial.figures["ratio"] = judge.judge(run.poses, context, run.members).ratio_to_oracle();
    trials.push_back(std::move(trial));
  };
  add("0 deg 0 %", 0, reference, true);
  trials.back().figures["fits_to_truth_sigma"] = judge.error_of_fits_to_truth(context);
  for (const auto& [name, angle, shift] : {std::tuple("3 deg 3 %", 3.0, 0.03), std::tuple("6 deg 5 %", 6.0, 0.05)}) {
    for (int seed = 0; seed < seeds; ++seed) {
      ASBUILT_TRY(run, joint_run(scene, perturbed(scene, angle, shift, static_cast<std::uint64_t>(seed)), {}, context));
      add(name, seed, run, seed == 0);
    }
  }
  return trials;
}

Result<std::vector<Trial>> ablation_trials(const RefinementScene& scene, const Context& context) {
  const AccuracyJudge judge(scene);
  const auto start = perturbed(scene, 1.0, 0.01, 0);
  std::vector<Trial> trials;
  const auto add = [&](const std::string& name, const refine::RefineOptions& options) -> Result<void> {
    ASBUILT_TRY(run, joint_run(scene, start, options, context));
    Trial trial = trial_of("ablation", scene, name, 0, run);
    trial.figures["error_sigma"] = judge.relative_pose_error(run.poses, run.members);
    trials.push_back(std::move(trial));
    return {};
  };
  ASBUILT_CHECK(add("default", {}));
  std::vector<std::string> switches;
  refine::RefineOptions named;
  for_each_field(named, [&](std::string_view name, auto& value, std::string_view) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, bool>) switches.emplace_back(name);
  });
  for (const std::string& name : switches) {
    refine::RefineOptions options;
    bool now = false;
    for_each_field(options, [&](std::string_view field, auto& value, std::string_view) {
      if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, bool>) {
        if (field == name) now = value = !value;
      }
    });
    ASBUILT_CHECK(add(fmt::format("{} {}", name, now ? "on" : "off"), options));
  }
  ASBUILT_CHECK(add("paper", refine::RefineOptions{}.as_published()));
  return trials;
}

Result<Trial> wrong_trial(const RefinementScene& scene, int seed, const Context& context) {
  constexpr const char* kKinds[] = {"flip", "slide", "anywhere"};
  constexpr double kAsIfNeverThere = 0.1;  // sigma
  const AccuracyJudge judge(scene);
  Random random(static_cast<std::uint64_t>(seed), "wrong pose", 0);
  const int kind = seed % 4 == 3 ? 2 : seed % 2;  // three quarters plausible
  const auto wrong = random.below(scene.views.size());
  auto views = perturbed(scene, 0.5, 0.005, static_cast<std::uint64_t>(seed));
  auto without = views;
  without[wrong].segment_in_scan = {};
  views[wrong].model_from_scan = wrong_motion(scene, kind, random) * scene.truth[wrong];
  const double off_mm = [&] {
    double largest = 0.0;
    for (const Eigen::Vector3f& p : views[wrong].segment_in_scan.positions) {
      const Eigen::Vector3d x = p.cast<double>();
      largest = std::max(largest, (views[wrong].model_from_scan * x - scene.truth[wrong] * x).norm());
    }
    return largest;
  }();
  ASBUILT_TRY(run, joint_run(scene, views, {}, context));
  Trial trial = trial_of("wrong", scene, kKinds[kind], static_cast<std::uint64_t>(seed), run);
  trial.figures["off_ratio"] = off_mm / scene.diameter_mm();
  const bool found = std::ranges::find(run.dropped, static_cast<int>(wrong)) != run.dropped.end();
  const bool separate = std::ranges::find(run.members, static_cast<int>(wrong)) == run.members.end();
  trial.figures["found"] = found ? 1.0 : 0.0;
  trial.figures["apart"] = separate ? 1.0 : 0.0;  // dropped, or left outside the largest component
  trial.figures["others_dropped"] = static_cast<double>(run.dropped.size()) - (found ? 1.0 : 0.0);
  trial.figures["error_sigma"] = judge.relative_pose_error(run.poses, run.members);
  std::vector<int> others = run.members;
  std::erase(others, static_cast<int>(wrong));
  RefinementScene smaller;
  smaller.prepared = scene.prepared;
  std::vector<refine::View> rest_views;
  for (const int other : others) rest_views.push_back(without[static_cast<std::size_t>(other)]);
  ASBUILT_TRY(clean, joint_run(smaller, rest_views, {}, context));
  std::vector<Pose> clean_poses = scene.truth;
  for (std::size_t k = 0; k < others.size(); ++k) clean_poses[static_cast<std::size_t>(others[k])] = clean.poses[k];
  trial.figures["rest_moved_sigma"] = judge.difference(run.poses, clean_poses, others);
  // Refinement that brings the pose back where it belongs has mended it: then there is nothing to drop.
  const bool mended = !separate && judge.relative_pose_error(run.poses, run.members) <
                                       judge.relative_pose_error(clean_poses, others) + 0.25;
  trial.figures["mended"] = mended ? 1.0 : 0.0;
  trial.figures["rest_as_if_never_there"] = trial.figures["rest_moved_sigma"] < kAsIfNeverThere ? 1.0 : 0.0;
  trial.note = fmt::format("{} {}", scene.names[wrong], kKinds[kind]);
  return trial;
}

std::vector<ScenePart> own_scene_parts() {
  return {{"valve_body", simulate::valve_body()},
          {"stepped_block", simulate::stepped_block()},
          {"l_profile", simulate::l_profile(120.0, 80.0, 12.0, 300.0)}};
}

Result<std::vector<ScenePart>> cad_scene_parts(const std::filesystem::path& folder) {
  ASBUILT_TRY(all, parts_of(folder));
  std::vector<ScenePart> parts;
  for (SuitePart& part : all) {
    if (part.symmetries.empty()) parts.push_back({part.name, std::move(part.mesh)});
  }
  if (!parts.empty()) return parts;
  return fail(ErrorCode::unreadable_input,
              fmt::format("{}: holds none of the CAD files that bench/README.md lists", folder.string()));
}

Result<RefinementScene> own_scene(int number, std::span<const ScenePart> parts, int points, double deviation_ratio,
                                  const Context& context) {
  const ScenePart& part = parts[static_cast<std::size_t>(number) % parts.size()];
  Random random(static_cast<std::uint64_t>(number), "own scene", 0);
  simulate::SimulateOptions options;
  options.scans = 8;
  options.points = points;
  options.seed = static_cast<std::uint64_t>(number) + 1;
  options.pose = "any";
  options.clutter_objects = 4;
  options.noise_ratio = 0.0003 * std::pow(5.0, random.uniform());
  // Warp and dents together make 0.2 to 1 % of the diameter.
  const double drawn = random.uniform(0.002, 0.01), deviation = deviation_ratio < 0.0 ? drawn : deviation_ratio;
  options.as_built.warp_ratio = 0.6 * deviation;
  options.as_built.bump_height_ratio = 0.4 * deviation;
  options.as_built.dents = 2;
  options.as_built.bosses = 1;
  return simulated_scene(fmt::format("{}_{:02}", part.name, number), part.mesh, options, context);
}

Result<std::vector<Trial>> scale_trials(const ScenePart& part, std::span<const int> scans, std::span<const int> degrees,
                                        int enough_firm, double window, const Context& context) {
  std::vector<Trial> trials;
  const int most = *std::ranges::max_element(scans);
  simulate::SimulateOptions options;
  options.scans = most;
  options.points = static_cast<int>(12000 / window);
  options.clutter_objects = 0;
  options.pose = "any";
  ASBUILT_TRY(all, simulated_scene(part.name, part.mesh, options, context));
  if (window < 1.0) look_along(all, window);
  const auto add = [&](int count, int max_degree) -> Result<void> {
    RefinementScene scene;
    scene.name = all.name;
    scene.noise_sigma_mm = all.noise_sigma_mm;
    scene.as_built = all.as_built;
    scene.prepared = all.prepared;
    for (std::size_t v = 0; v < static_cast<std::size_t>(count) && v < all.views.size(); ++v) {
      scene.views.push_back(all.views[v]);
      scene.truth.push_back(all.truth[v]);
      scene.names.push_back(all.names[v]);
    }
    graph::PoseGraphOptions graph_options;
    graph_options.edges.max_degree = max_degree;
    graph_options.edges.enough_firm = enough_firm;
    ASBUILT_TRY(run, joint_run(scene, perturbed(scene, 1.0, 0.01, 0), {}, context, graph_options));
    Trial trial = trial_of("scale", scene, scale_variant(count, max_degree, enough_firm, window), 0, run);
    trial.figures["error_sigma"] = AccuracyJudge(scene).relative_pose_error(run.poses, run.members);
    trials.push_back(std::move(trial));
    return {};
  };
  constexpr int kMostWithoutCap = 128;
  for (const int count : scans) {
    for (const int degree : degrees) {
      if (degree > 0 || count <= kMostWithoutCap) ASBUILT_CHECK(add(count, degree));
    }
  }
  if (scans.size() > 1) ASBUILT_CHECK(add(*std::ranges::min_element(scans), degrees.front()));
  return trials;
}

}  // namespace asbuilt::bench
