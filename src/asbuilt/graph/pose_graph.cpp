// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/graph/pose_graph.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

namespace asbuilt::graph {
namespace {

Result<void> check(const PosedSegment& segment, int index) {
  const PointCloud& cloud = segment.segment_in_scan;
  if (!is_rigid(segment.model_from_scan.matrix())) {
    return fail(ErrorCode::invalid_argument, fmt::format("pose of segment {} is not a rigid motion", index));
  }
  if (cloud.normals.size() != cloud.positions.size()) {
    return fail(ErrorCode::invalid_argument, fmt::format("segment {} has {} normals for {} points", index,
                                                         cloud.normals.size(), cloud.positions.size()));
  }
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (cloud.positions[i].allFinite() && cloud.normals[i].allFinite()) continue;
    return fail(ErrorCode::invalid_argument, fmt::format("segment {}: point {} is not finite", index, i));
  }
  return {};
}

}  // namespace

Result<void> PoseGraphOptions::validate() const {
  if (!(voxel_ratio >= 1e-4 && voxel_ratio <= 0.5)) {
    return fail(ErrorCode::invalid_argument, fmt::format("voxel_ratio = {} must be in [0.0001, 0.5]", voxel_ratio));
  }
  return edges.validate();
}

Result<PoseGraphBuilder> PoseGraphBuilder::create(const model::PreparedModel& model, const PoseGraphOptions& options) {
  ASBUILT_CHECK(options.validate());
  if (!(model.diameter > 0.0)) {
    return fail(ErrorCode::invalid_argument, fmt::format("the model's diameter is {}", model.diameter));
  }
  PoseGraphBuilder builder;
  builder.model_samples_ = model.dense_samples.empty() ? model.samples : model.dense_samples;
  const double voxel = options.voxel_ratio * model.diameter;
  const Eigen::AlignedBox3d& box = model.box;
  builder.grid_.voxels = {box.isEmpty() ? Eigen::Vector3d::Zero() : box.min(), voxel};
  builder.grid_.by_side = !options.paper_mode;
  builder.selection_ = options.edges;
  if (options.paper_mode) {
    builder.selection_.bridges_only = false;
    builder.selection_.max_degree = 0;
  }
  return builder;
}

Result<int> PoseGraphBuilder::insert(const PosedSegment& segment, const Context& context) {
  ASBUILT_CHECK(check(segment, scan_count()));
  if (context.cancelled()) return fail(ErrorCode::cancelled, "cancelled while building the pose graph");
  return histogram_.insert(
      visible_cells(segment.segment_in_scan, segment.model_from_scan, model_samples_, grid_, context));
}

PoseGraph PoseGraphBuilder::graph() const {
  PoseGraph graph;
  graph.overlaps = histogram_.bars();
  EdgeSelection selection = select_edges(scan_count(), graph.overlaps, selection_).value();
  graph.candidates = std::move(selection.candidates);
  graph.edges = std::move(selection.edges);
  graph.components = std::move(selection.components);
  return graph;
}

Result<PoseGraph> build_graph(std::span<const PosedSegment> segments, const model::PreparedModel& model,
                              const PoseGraphOptions& options, const Context& context) {
  ASBUILT_TRY(builder, PoseGraphBuilder::create(model, options));
  for (std::size_t i = 0; i < segments.size(); ++i) {
    ASBUILT_CHECK(builder.insert(segments[i], context));
    context.report_progress(static_cast<double>(i + 1) / static_cast<double>(segments.size()));
  }
  return builder.graph();
}

bool links_alike(const PoseGraph& a, const PoseGraph& b) {
  constexpr std::size_t kOneIn = 50;
  const auto pairs = [](const PoseGraph& graph) {
    std::vector<std::pair<int, int>> all;
    for (const std::vector<PairOverlap>* some : {&graph.candidates, &graph.edges}) {
      for (const PairOverlap& pair : *some) all.emplace_back(pair.first, pair.second);
    }
    std::ranges::sort(all);
    all.erase(std::ranges::unique(all).begin(), all.end());
    return all;
  };
  const std::vector<std::pair<int, int>> first = pairs(a), second = pairs(b);
  std::vector<std::pair<int, int>> of_one;
  std::ranges::set_symmetric_difference(first, second, std::back_inserter(of_one));
  return a.components == b.components && kOneIn * of_one.size() <= first.size() + second.size();
}

PairOverlap best_missing_link(const PoseGraph& graph) {
  std::vector<int> component_of;
  for (std::size_t c = 0; c < graph.components.size(); ++c) {
    for (const int scan : graph.components[c]) {
      const auto at = static_cast<std::size_t>(scan);
      if (component_of.size() <= at) component_of.resize(at + 1, -1);
      component_of[at] = static_cast<int>(c);
    }
  }
  for (const PairOverlap& pair : graph.overlaps) {
    const int a = component_of[static_cast<std::size_t>(pair.first)];
    const int b = component_of[static_cast<std::size_t>(pair.second)];
    if (a != b) return pair;
  }
  return {-1, -1, 0.0};
}

}  // namespace asbuilt::graph
