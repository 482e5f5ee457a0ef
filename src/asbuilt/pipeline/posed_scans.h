// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/result.h"
#include "asbuilt/graph/pose_graph.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/pipeline/load_model.h"
#include "asbuilt/pipeline/options.h"
#include "asbuilt/pipeline/run_folder.h"
#include "asbuilt/refine/refine.h"

namespace asbuilt::pipeline {

/// An accepted scan as the joint half needs it.
struct PosedScan {
  int index = 0;                                      ///< in the record
  PointCloud part;                                    ///< in the scan frame minus the offset
  Pose model_from_local_detected = Pose::Identity();  ///< for those coordinates
  Pose model_from_local = Pose::Identity();           ///< refined, once it is
  Matrix6d covariance = Matrix6d::Zero();
  double noise_sigma_mm = 0.0, spacing_mm = 0.0;
};

/// One component of the graph after its refinement.
struct RefinedComponent {
  std::vector<int> members;  ///< indices into the posed scans
  refine::Refinement refinement;
  Pose model_from_refined = Pose::Identity();  ///< the gauge, already applied to the posed scans
};

/// A posed scan that the others contradict.
struct Contradiction {
  int member = 0;  ///< index into the posed scans
  double spread_mm = 0.0, others_spread_mm = 0.0;
};

/// The parts of all accepted scans, read from the folder's segments.
[[nodiscard]] Result<std::vector<PosedScan>> load_posed_scans(const io::RunRecord& record, const RunFolder& folder);

[[nodiscard]] Result<graph::PoseGraph> link(const std::vector<PosedScan>& scans, const LoadedModel& model,
                                            const Options& options, const Context& context);

/// Refines the members jointly, from their detected poses, and brings them into the model frame. A lone scan keeps its
/// pose up to the gauge. The posed scans get their refined poses.
[[nodiscard]] Result<RefinedComponent> refine_component(const std::vector<int>& members, const graph::PoseGraph& graph,
                                                        std::vector<PosedScan>& scans, const LoadedModel& model,
                                                        const Options& options, const Context& context);

/// The scan, if there is one, that the others of its component contradict.
[[nodiscard]] std::optional<Contradiction> contradiction_in(const RefinedComponent& component,
                                                            const std::vector<PosedScan>& scans);

}  // namespace asbuilt::pipeline
