// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
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
#include "asbuilt/scan/viewpoint.h"

namespace asbuilt::pipeline {

/// An accepted scan as the joint half needs it.
struct PosedScan {
  int index = 0;                                      ///< in the record
  PointCloud part;                                    ///< in the scan frame minus the offset
  std::vector<std::uint8_t> beside_occluder;          ///< of each point of `part` as read; empty: not known
  PointCloud taken_out;                               ///< by remove_seen_through
  std::vector<std::uint32_t> taken_from;              ///< where these stood in `part` as read, ascending
  std::shared_ptr<const refine::SampledView> sample;  ///< of `part` as it is now, for the next refinement; or none
  Pose model_from_local_detected = Pose::Identity();  ///< for those coordinates
  Pose model_from_local_start = Pose::Identity();     ///< where the next refinement starts: detected, or refined before
  Pose model_from_local = Pose::Identity();           ///< refined, once it is
  refine::HandedOn earlier;  ///< where the next refinement goes on from the last
  Matrix6d covariance = Matrix6d::Zero();
  refine::ViewHold hold;  ///< in the model frame
  double noise_sigma_mm = 0.0, spacing_mm = 0.0;
  scan::Viewpoint viewpoint;      ///< for the coordinates of `part`
  int individual = 0;             ///< scans of different ones are not linked, whatever they overlap
  std::string individual_reason;  ///< what tells its individual from another; empty while there is one only
};

/// One component of the graph after its refinement.
struct RefinedComponent {
  std::vector<int> members;         ///< indices into the posed scans
  std::vector<refine::Link> links;  ///< among the members, by their place in `members`
  refine::Refinement refinement;
  Pose model_from_refined = Pose::Identity();  ///< the gauge, already applied to the posed scans
};

/// A posed scan that the others contradict.
struct Contradiction {
  int member = 0;  ///< index into the posed scans
  std::string reason;
};

/// The same motion in another frame.
[[nodiscard]] refine::Motion moved(const refine::Motion& motion, const Pose& b_from_a);

/// What the refinement works with: the members' parts at their starting poses.
[[nodiscard]] std::vector<refine::View> views_of(const std::vector<int>& members, const std::vector<PosedScan>& scans);

/// An accepted scan with its part, read from its segment file. `index` is its place in the record.
/// Errors: unreadable_input.
[[nodiscard]] Result<PosedScan> posed_scan(const io::ScanRecord& scan, int index, const std::filesystem::path& segment);

/// The parts of all accepted scans, read from the folder's segments.
[[nodiscard]] Result<std::vector<PosedScan>> load_posed_scans(const io::RunRecord& record, const RunFolder& folder);

/// Lets the next refinement start from the detected poses; those that lie off the CAD are fitted to it first
/// (refine::start_near_model).
[[nodiscard]] Result<void> start_as_detected(std::vector<PosedScan>& scans, const LoadedModel& model,
                                             const Context& context);

/// The graph under the starting poses, without links between different individuals.
[[nodiscard]] Result<graph::PoseGraph> link(const std::vector<PosedScan>& scans, const LoadedModel& model,
                                            const Options& options, const Context& context);

/// Refines the members jointly, from where they start, and brings them into the model frame. A lone scan keeps its
/// pose up to the gauge. The posed scans get their refined poses.
[[nodiscard]] Result<RefinedComponent> refine_component(const std::vector<int>& members, const graph::PoseGraph& graph,
                                                        std::vector<PosedScan>& scans, const LoadedModel& model,
                                                        const Options& options, const Context& context);

/// Takes points out of the members' parts that other scans looked straight through under the refined poses and none
/// measured: clutter that was cut out with the part, flying points. Precondition: nothing is taken out yet.
[[nodiscard]] Result<void> remove_seen_through(const RefinedComponent& component, std::vector<PosedScan>& scans,
                                               const Context& context);

/// Undoes remove_seen_through: what only a scan saw through that has turned out to stand wrong is the part's again.
void restore_seen_through(std::vector<PosedScan>& scans);

/// The scan, if there is one, that the others of its component contradict: they saw through its points, or it through
/// theirs, or its residuals are much wider than theirs.
[[nodiscard]] Result<std::optional<Contradiction>> contradiction_in(const RefinedComponent& component,
                                                                    const std::vector<PosedScan>& scans,
                                                                    const Context& context);

}  // namespace asbuilt::pipeline
