// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/posed_scans.h"

#include <fmt/format.h>

#include <algorithm>

#include "asbuilt/pipeline/segment_file.h"
#include "asbuilt/refine/gauge.h"
#include "asbuilt/refine/suspicious_view.h"

namespace asbuilt::pipeline {
namespace {

std::vector<refine::View> views_of(const std::vector<int>& members, const std::vector<PosedScan>& scans) {
  std::vector<refine::View> views;
  for (const int member : members) {
    const PosedScan& scan = scans[static_cast<std::size_t>(member)];
    views.push_back({scan.part, scan.model_from_local_detected, scan.noise_sigma_mm});
  }
  return views;
}

/// The graph's edges among the members, numbered by their place in `members`.
std::vector<refine::Link> links_among(const std::vector<int>& members, const graph::PoseGraph& graph) {
  const auto place = [&](int scan) {
    const auto found = std::ranges::find(members, scan);
    return found == members.end() ? -1 : static_cast<int>(found - members.begin());
  };
  std::vector<refine::Link> links;
  for (const graph::PairOverlap& edge : graph.edges) {
    const int first = place(edge.first), second = place(edge.second);
    if (first >= 0 && second >= 0) links.push_back({first, second});
  }
  return links;
}

/// How a twist applied on the left changes with the frame it is told in.
Matrix6d adjoint(const Pose& b_from_a) {
  Matrix6d matrix = Matrix6d::Zero();
  const Eigen::Matrix3d rotation = b_from_a.linear();
  matrix.topLeftCorner<3, 3>() = rotation;
  matrix.bottomRightCorner<3, 3>() = rotation;
  matrix.bottomLeftCorner<3, 3>() = cross_matrix(b_from_a.translation()) * rotation;
  return matrix;
}

Result<refine::Refinement> refined(const std::vector<refine::View>& views, const std::vector<refine::Link>& links,
                                   const Options& options, const Context& context) {
  if (views.size() > 1) return refine::refine(views, links, options.refine, context);
  refine::Refinement alone;
  alone.model_from_scan = {views.front().model_from_scan};
  alone.covariance = {Matrix6d::Zero()};
  alone.converged = true;
  return alone;
}

}  // namespace

Result<std::vector<PosedScan>> load_posed_scans(const io::RunRecord& record, const RunFolder& folder) {
  std::vector<PosedScan> scans;
  for (std::size_t i = 0; i < record.scans.size(); ++i) {
    const io::ScanRecord& scan = record.scans[i];
    if (scan.status != io::ScanStatus::accepted || !scan.model_from_scan) continue;
    ASBUILT_TRY(part, read_part(folder.file(io::segment_file(i, scan.name)), scan.offset));
    PosedScan posed;
    posed.index = static_cast<int>(i);
    posed.part = std::move(part);
    posed.model_from_local_detected = *scan.model_from_scan * Eigen::Translation3d(scan.offset);
    posed.noise_sigma_mm = scan.noise_sigma;
    posed.spacing_mm = scan.spacing;
    scans.push_back(std::move(posed));
  }
  return scans;
}

Result<graph::PoseGraph> link(const std::vector<PosedScan>& scans, const LoadedModel& model, const Options& options,
                              const Context& context) {
  std::vector<graph::PosedSegment> segments;
  for (const PosedScan& scan : scans) segments.push_back({scan.part, scan.model_from_local_detected});
  return graph::build_graph(segments, model.prepared, options.graph, context);
}

Result<RefinedComponent> refine_component(const std::vector<int>& members, const graph::PoseGraph& graph,
                                          std::vector<PosedScan>& scans, const LoadedModel& model,
                                          const Options& options, const Context& context) {
  const std::vector<refine::View> views = views_of(members, scans);
  RefinedComponent component{members, {}, Pose::Identity()};
  ASBUILT_TRY(refinement, refined(views, links_among(members, graph), options, context));
  component.refinement = std::move(refinement);
  if (options.gauge == Gauge::best_fit) {
    ASBUILT_TRY(gauge, refine::best_fit_gauge(views, component.refinement.model_from_scan, *model.prepared.surface,
                                              model.prepared.diameter, context));
    component.model_from_refined = gauge;
  }
  const Matrix6d turned = adjoint(component.model_from_refined);
  for (std::size_t i = 0; i < members.size(); ++i) {
    PosedScan& scan = scans[static_cast<std::size_t>(members[i])];
    scan.model_from_local = orthonormalised(component.model_from_refined * component.refinement.model_from_scan[i]);
    scan.covariance = turned * component.refinement.covariance[i] * turned.transpose();
  }
  return component;
}

std::optional<Contradiction> contradiction_in(const RefinedComponent& component, const std::vector<PosedScan>& scans) {
  // Two scans of one part never agree better than noise and spacing let them.
  double floor_mm = 0.0;
  for (const int member : component.members) {
    const PosedScan& scan = scans[static_cast<std::size_t>(member)];
    floor_mm = std::max(floor_mm, std::max(scan.noise_sigma_mm, 0.1 * scan.spacing_mm));
  }
  const auto suspicious =
      refine::suspicious_view(static_cast<int>(component.members.size()), component.refinement.edges, floor_mm);
  if (!suspicious) return std::nullopt;
  return Contradiction{component.members[static_cast<std::size_t>(suspicious->view)], suspicious->spread_mm,
                       suspicious->others_spread_mm};
}

}  // namespace asbuilt::pipeline
