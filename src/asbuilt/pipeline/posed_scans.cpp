// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/posed_scans.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "asbuilt/pipeline/segment_file.h"
#include "asbuilt/refine/gauge.h"
#include "asbuilt/refine/link_evidence.h"
#include "asbuilt/refine/loose_views.h"
#include "asbuilt/refine/suspicious_view.h"

namespace asbuilt::pipeline {
namespace {

/// The graph's edges among the members, numbered by their place in `members`.
std::vector<refine::Link> links_among(const std::vector<int>& members, const graph::PoseGraph& graph) {
  std::vector<int> places(static_cast<std::size_t>(*std::ranges::max_element(members)) + 1, -1);
  for (std::size_t i = 0; i < members.size(); ++i) places[static_cast<std::size_t>(members[i])] = static_cast<int>(i);
  const auto place = [&](int scan) {
    return static_cast<std::size_t>(scan) < places.size() ? places[static_cast<std::size_t>(scan)] : -1;
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
                                   const LoadedModel& model, const Options& options, const Context& context) {
  if (views.size() > 1) {
    return refine::refine_on_model(views, links, *model.prepared.surface, model.prepared.diameter, options.refine,
                                   context);
  }
  refine::Refinement alone;
  alone.model_from_scan = {views.front().model_from_scan};
  alone.covariance = {Matrix6d::Zero()};
  alone.converged = true;
  return alone;
}

scan::Viewpoint local_viewpoint(const io::ScanRecord& scan) {
  scan::Viewpoint viewpoint;
  if (!scan.viewpoint) return viewpoint;
  const bool is_point = scan.viewpoint_kind == "point";
  viewpoint.kind = is_point ? scan::Viewpoint::Kind::point : scan::Viewpoint::Kind::direction;
  viewpoint.value = is_point ? Eigen::Vector3d(*scan.viewpoint - scan.offset) : *scan.viewpoint;
  return viewpoint;
}

}  // namespace

std::vector<refine::View> views_of(const std::vector<int>& members, const std::vector<PosedScan>& scans) {
  std::vector<refine::View> views;
  for (const int member : members) {
    const PosedScan& scan = scans[static_cast<std::size_t>(member)];
    views.push_back({scan.part, scan.model_from_local_start, scan.noise_sigma_mm, scan.viewpoint});
    if (scan.taken_from.empty()) views.back().beside_occluder = scan.beside_occluder;
    views.back().spacing_mm = scan.spacing_mm;
    views.back().sample = scan.sample;
    views.back().earlier = scan.earlier;
  }
  return views;
}

refine::Motion moved(const refine::Motion& motion, const Pose& b_from_a) {
  return {motion.is_turn, b_from_a.linear() * motion.direction, b_from_a * motion.through};
}

Result<PosedScan> posed_scan(const io::ScanRecord& scan, int index, const std::filesystem::path& segment) {
  ASBUILT_EXPECT(scan.model_from_scan.has_value(), "a scan with a pose");
  ASBUILT_TRY(part, read_part(segment, scan.offset));
  PosedScan posed;
  posed.index = index;
  posed.part = std::move(part.cloud);
  posed.beside_occluder = std::move(part.beside_occluder);
  posed.model_from_local_detected = *scan.model_from_scan * Eigen::Translation3d(scan.offset);
  posed.model_from_local_start = posed.model_from_local_detected;
  posed.noise_sigma_mm = scan.noise_sigma;
  posed.spacing_mm = scan.spacing;
  posed.viewpoint = local_viewpoint(scan);
  return posed;
}

Result<std::vector<PosedScan>> load_posed_scans(const io::RunRecord& record, const RunFolder& folder) {
  std::vector<PosedScan> scans;
  for (std::size_t i = 0; i < record.scans.size(); ++i) {
    const io::ScanRecord& scan = record.scans[i];
    if (scan.status != io::ScanStatus::accepted || !scan.model_from_scan) continue;
    ASBUILT_TRY(posed, posed_scan(scan, static_cast<int>(i), folder.file(io::segment_file(i, scan.name))));
    scans.push_back(std::move(posed));
  }
  return scans;
}

Result<void> start_as_detected(std::vector<PosedScan>& scans, const LoadedModel& model, const Context& context) {
  for (PosedScan& scan : scans) {
    const refine::View view{scan.part, scan.model_from_local_detected, scan.noise_sigma_mm, scan.viewpoint};
    ASBUILT_TRY(start, refine::start_near_model(view, *model.prepared.surface, model.prepared.diameter, context));
    scan.model_from_local_start = start;
    scan.earlier = {};
  }
  return {};
}

Result<graph::PoseGraph> link(const std::vector<PosedScan>& scans, const LoadedModel& model, const Options& options,
                              const Context& context) {
  std::vector<graph::PosedSegment> segments;
  for (const PosedScan& scan : scans) segments.push_back({scan.part, scan.model_from_local_start});
  ASBUILT_TRY(graph, graph::build_graph(segments, model.prepared, options.graph, context));
  const auto same = [&](const graph::PairOverlap& pair) {
    return scans[static_cast<std::size_t>(pair.first)].individual ==
           scans[static_cast<std::size_t>(pair.second)].individual;
  };
  if (std::ranges::all_of(graph.overlaps, same)) return graph;
  // Chosen anew among the pairs that are left: one that seemed superfluous may now be what holds an individual
  // together.
  std::vector<graph::PairOverlap> pairs;
  std::ranges::copy_if(graph.overlaps, std::back_inserter(pairs), same);
  ASBUILT_TRY(selection, graph::select_edges(static_cast<int>(scans.size()), pairs, options.graph.edges));
  graph.candidates = std::move(selection.candidates);
  graph.edges = std::move(selection.edges);
  graph.components = std::move(selection.components);
  return graph;
}

Result<RefinedComponent> refine_component(const std::vector<int>& members, const graph::PoseGraph& graph,
                                          std::vector<PosedScan>& scans, const LoadedModel& model,
                                          const Options& options, const Context& context) {
  std::vector<refine::View> views = views_of(members, scans);
  if (views.size() > 1) refine::sample_views(views, options.refine, context);
  for (std::size_t i = 0; i < members.size(); ++i) scans[static_cast<std::size_t>(members[i])].sample = views[i].sample;
  RefinedComponent component{members, links_among(members, graph), {}, Pose::Identity()};
  ASBUILT_TRY(refinement, refined(views, component.links, model, options, context));
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
    scan.hold = component.refinement.view_holds.empty() ? refine::ViewHold{} : component.refinement.view_holds[i];
    for (refine::LooseMotion& loose : scan.hold.loose) {
      loose.motion = moved(loose.motion, component.model_from_refined);
    }
  }
  return component;
}

Result<void> remove_seen_through(const RefinedComponent& component, std::vector<PosedScan>& scans,
                                 const Context& context) {
  const std::vector<refine::View> views = views_of(component.members, scans);
  ASBUILT_TRY(marked, refine::seen_through(views, component.refinement.model_from_scan, component.links, context));
  for (std::size_t v = 0; v < views.size(); ++v) {
    PosedScan& scan = scans[static_cast<std::size_t>(component.members[v])];
    ASBUILT_EXPECT(scan.taken_from.empty(), "a part of which nothing was taken");
    PointCloud kept, taken;
    std::vector<std::uint32_t> from;
    for (std::size_t i = 0; i < scan.part.size(); ++i) {
      PointCloud& to = marked[v][i] != 0 ? taken : kept;
      to.positions.push_back(scan.part.positions[i]);
      to.normals.push_back(scan.part.normals[i]);
      if (marked[v][i] != 0) from.push_back(static_cast<std::uint32_t>(i));
    }
    if (kept.empty() || taken.empty()) continue;
    scan.part = std::move(kept);
    scan.taken_out = std::move(taken);
    scan.taken_from = std::move(from);
    scan.sample.reset();
  }
  return {};
}

void restore_seen_through(std::vector<PosedScan>& scans) {
  for (PosedScan& scan : scans) {
    if (scan.taken_from.empty()) continue;
    const std::size_t points = scan.part.size() + scan.taken_from.size();
    PointCloud whole;
    for (std::size_t kept = 0, taken = 0; kept + taken < points;) {
      const bool was_taken = taken < scan.taken_from.size() && scan.taken_from[taken] == kept + taken;
      const PointCloud& from = was_taken ? scan.taken_out : scan.part;
      const std::size_t place = was_taken ? taken++ : kept++;
      whole.positions.push_back(from.positions[place]);
      whole.normals.push_back(from.normals[place]);
    }
    scan.part = std::move(whole);
    scan.taken_out = {};
    scan.taken_from.clear();
    scan.sample.reset();
  }
}

Result<std::optional<Contradiction>> contradiction_in(const RefinedComponent& component,
                                                      const std::vector<PosedScan>& scans, const Context& context) {
  const std::vector<refine::View> views = views_of(component.members, scans);
  ASBUILT_TRY(found, refine::view_against_others(views, component.links, component.refinement, context));
  if (!found) return std::optional<Contradiction>();
  Contradiction contradiction{component.members[static_cast<std::size_t>(found->view)], {}};
  if (const auto& seen_through = found->seen_through) {
    contradiction.reason = fmt::format(
        "where its pose puts it, {:.1f} % of what it shares with the scans it overlaps was seen through; "
        "among those it is {:.1f} %",
        100.0 * seen_through->share, 100.0 * seen_through->usual_share);
  } else if (const auto& differing = found->differing) {
    contradiction.reason = fmt::format(
        "under its pose it differs from the scans it overlaps by {:.3g} mm, they from one another by {:.3g} mm",
        differing->spread_mm, differing->others_spread_mm);
  }
  return std::optional<Contradiction>(std::move(contradiction));
}

}  // namespace asbuilt::pipeline
