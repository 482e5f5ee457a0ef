// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "accuracy.h"
#include "asbuilt/graph/pose_graph.h"
#include "scene.h"

namespace asbuilt::bench {

/// One run of the suite and what came out. Lengths in units of the sensor's noise where the name says sigma.
struct Trial {
  std::string kind;  ///< "start", "own", "cad", "wrong", "scale", "ablation", "peer"
  std::string scene, variant;
  std::uint64_t seed = 0;
  std::map<std::string, double> figures;
  std::string note;
};

/// Poses of the views that stayed, the dropped ones, and the time of it all.
struct JointRun {
  std::vector<Pose> poses;   ///< one a view; those of dropped views are where they started
  std::vector<int> members;  ///< views that were refined together: the largest component
  std::vector<int> dropped;
  std::size_t links = 0;
  refine::Refinement refinement;  ///< the last one, of the members
  double seconds = 0.0;           ///< graph and refinement, trees and normals included
  double cpu_seconds = 0.0;       ///< the same, processor time of all threads
};

/// Graph, refinement, and once more without a view that the others contradict, as `asbuilt register` does it.
[[nodiscard]] Result<JointRun> joint_run(const RefinementScene& scene, std::vector<refine::View> views,
                                         const refine::RefineOptions& options, const Context& context,
                                         const graph::PoseGraphOptions& graph_options = {});

/// Starts that are off: where it ends, and how far from the run that starts at the true poses.
[[nodiscard]] Result<std::vector<Trial>> start_trials(const RefinementScene& scene, int seeds, const Context& context);

/// Each switch of the refinement turned over, from 1 degree and 1 % off.
[[nodiscard]] Result<std::vector<Trial>> ablation_trials(const RefinementScene& scene, const Context& context);

/// One view stands wrong: turned by half about an axis of the box, slid by 2 to 5 % of the diameter, or anywhere.
/// Which view and how follows from `seed`; of four seeds in a row three are plausible.
[[nodiscard]] Result<Trial> wrong_trial(const RefinementScene& scene, int seed, const Context& context);

/// A part that scenes are made of.
struct ScenePart {
  std::string name;
  TriangleMesh mesh;  ///< CAD, mm
};

/// Three that are made by code: a valve body, a stepped block and a profile.
[[nodiscard]] std::vector<ScenePart> own_scene_parts();

/// The parts of a folder of CAD files (bench/README.md) that no motion maps onto themselves.
[[nodiscard]] Result<std::vector<ScenePart>> cad_scene_parts(const std::filesystem::path& folder);

/// Scene `number` of our own simulator, of part `number` modulo their count, with an as-built deviation of 0.2 to 1 %
/// of the diameter, or of `deviation_ratio` if that is not negative, 8 scans of `points` points. `parts` may not be
/// empty.
[[nodiscard]] Result<RefinementScene> own_scene(int number, std::span<const ScenePart> parts, int points,
                                                double deviation_ratio, const Context& context);

/// Many scans of `part`, from 1 degree and 1 % off: time and error against the number of scans, for each number of
/// links that a scan may have (0: all, up to 128 scans). Under such a cap a scan in a dense network needs no further
/// link once it has `enough_firm` firm ones (0: links up to the cap). Each scan sees the share `window` of the part's
/// length (1: all it can). Of several numbers of scans the smallest runs first and last. Neither list may be empty.
[[nodiscard]] Result<std::vector<Trial>> scale_trials(const ScenePart& part, std::span<const int> scans,
                                                      std::span<const int> degrees, int enough_firm, double window,
                                                      const Context& context);

}  // namespace asbuilt::bench
