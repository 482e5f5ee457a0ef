// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/result.h"
#include "asbuilt/graph/covisibility.h"
#include "asbuilt/graph/edge_selection.h"
#include "asbuilt/graph/overlap_histogram.h"
#include "asbuilt/model/prepared_model.h"

namespace asbuilt::graph {

/// What the graph needs of an accepted scan: its segment and pose.
struct PosedSegment {
  PointCloud segment_in_scan;  ///< with normals turned to the sensor; an even subset is enough
  Pose model_from_scan = Pose::Identity();
};

struct PoseGraphOptions {
  double voxel_ratio = 0.02;   ///< voxel edge / diameter (our value)
  EdgeSelectionOptions edges;  ///< alpha_l, alpha_h
  bool paper_mode = false;     ///< exactly the published rules: plain voxels, any weak pair until connected, no cap

  [[nodiscard]] Result<void> validate() const;
};

template <class Visitor>
void for_each_field(PoseGraphOptions& options, Visitor&& field) {
  field("voxel_ratio", options.voxel_ratio, "voxel edge / diameter, of the grid that measures overlap");
  for_each_field(options.edges, field);
}

/// Nodes are the given segments, by index.
struct PoseGraph {
  std::vector<PairOverlap> overlaps;         ///< the histogram of pairwise overlaps, by decreasing overlap
  std::vector<PairOverlap> candidates;       ///< those that overlap enough to be links, but for the cap on these
  std::vector<PairOverlap> edges;            ///< accepted ones: the paper's A, symmetric
  std::vector<std::vector<int>> components;  ///< largest first
};

/// Builds the pose graph scan by scan, as they arrive; the outcome is that of `build_graph` on the same scans.
/// A new scan costs its points plus the scans it overlaps; `graph()` replays the hysteresis on the histogram, so that
/// no decision hangs on the order in which scans came.
class PoseGraphBuilder {
 public:
  /// Keeps a copy of the model's dense samples. Errors: invalid_argument if the options fail validate() or the model
  /// has no extent.
  [[nodiscard]] static Result<PoseGraphBuilder> create(const model::PreparedModel& model,
                                                       const PoseGraphOptions& options);

  /// Gives the new scan's node. Errors: invalid_argument for a segment without normals, with a non-finite value, or a
  /// pose that is not rigid; the graph is then unchanged.
  [[nodiscard]] Result<int> insert(const PosedSegment& segment, const Context& context);

  [[nodiscard]] int scan_count() const { return histogram_.scan_count(); }
  [[nodiscard]] PoseGraph graph() const;

 private:
  PoseGraphBuilder() = default;

  PointCloud model_samples_;
  CovisibilityGrid grid_;
  EdgeSelectionOptions selection_;
  OverlapHistogram histogram_;
};

/// All scans at once. Source: Sec. 3.2. Errors: as PoseGraphBuilder.
[[nodiscard]] Result<PoseGraph> build_graph(std::span<const PosedSegment> segments, const model::PreparedModel& model,
                                            const PoseGraphOptions& options, const Context& context);

/// Whether two graphs of the same scans have the same components and, but for one in fifty, the same pairs that were
/// links but for the cap, so that a refinement under one has nothing to add to that under the other. Which of them the
/// cap keeps in a dense network is hardly ever quite alike twice, and matters little.
[[nodiscard]] bool links_alike(const PoseGraph& a, const PoseGraph& b);

/// The pair of scans from different components with the greatest overlap: the link that is missing most.
/// overlap = 0 with first = second = -1 when there is none (a connected graph, or components that share nothing).
[[nodiscard]] PairOverlap best_missing_link(const PoseGraph& graph);

}  // namespace asbuilt::graph
