// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/joint_half.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "asbuilt/fuse/mesh.h"
#include "asbuilt/pipeline/posed_scans.h"
#include "asbuilt/pipeline/recut_segments.h"
#include "asbuilt/pipeline/report.h"
#include "asbuilt/pipeline/scan_relations.h"
#include "asbuilt/report/report.h"

namespace asbuilt::pipeline {
namespace {

constexpr const char* kClosedMesh = "mesh_watertight.ply";

void drop(std::vector<PosedScan>& scans, const Contradiction& contradiction, io::RunRecord& record,
          const Context& context) {
  const auto position = scans.begin() + contradiction.member;
  io::ScanRecord& scan = record.scans[static_cast<std::size_t>(position->index)];
  scan.status = io::ScanStatus::dropped;
  scan.reason_code = "contradicted_by_scans";
  scan.reason = contradiction.reason;
  scan.model_from_scan.reset();
  context.warn(fmt::format("{}: dropped: {}", scan.path, scan.reason));
  scans.erase(position);
}

/// Lets the next refinement go on where this one ended.
void start_as_refined(Registration& registration, bool contradicted) {
  for (PosedScan& scan : registration.scans) scan.model_from_local_start = scan.model_from_local;
  for (const RefinedComponent& component : registration.components) {
    for (std::size_t i = 0; i < component.members.size(); ++i) {
      PosedScan& scan = registration.scans[static_cast<std::size_t>(component.members[i])];
      // One that has gone astray must find its way back from afar.
      const bool astray = contradicted || component.refinement.handed_on.empty();
      scan.earlier = astray ? refine::HandedOn{} : component.refinement.handed_on[i];
    }
  }
}

Result<graph::PoseGraph> linked(const std::vector<PosedScan>& scans, const LoadedModel& model, const Options& options,
                                RunFolder& folder, const Context& context) {
  const auto timed = folder.stage("graph");
  return link(scans, model, options, context);
}

/// Refines all components; names the first contradiction.
Result<std::optional<Contradiction>> refine_all(Registration& registration, const LoadedModel& model,
                                                const Options& options, RunFolder& folder, const Context& context) {
  std::vector<PosedScan>& scans = registration.scans;
  const auto timed = folder.stage("refine");
  std::optional<Contradiction> contradiction;
  registration.components.clear();
  for (const std::vector<int>& members : registration.graph.components) {
    ASBUILT_TRY(component, refine_component(members, registration.graph, scans, model, options, context));
    if (!options.paper_mode && !contradiction) {
      ASBUILT_TRY(found, contradiction_in(component, scans, context));
      contradiction = std::move(found);
    }
    registration.components.push_back(std::move(component));
  }
  return contradiction;
}

/// Links and refines; drops one contradicted scan at a time and begins again without it. Overlaps under detected poses
/// are rough, and so are segments that were cut out under them: when all agree, points that other scans looked through
/// go, the graph is made anew under the refined poses, and refinement goes on from there.
Result<void> settle(Registration& registration, const LoadedModel& model, const Options& options, RunFolder& folder,
                    io::RunRecord& record, const Context& context) {
  constexpr int kMostRounds = 3;
  std::vector<PosedScan>& scans = registration.scans;
  if (!options.paper_mode) {
    ASBUILT_CHECK(choose_turns(scans, model, options.verify.near_equal_ratio, record, context));
    ASBUILT_CHECK(start_as_detected(scans, model, context));
  }
  ASBUILT_TRY(first_graph, linked(scans, model, options, folder, context));
  registration.graph = std::move(first_graph);
  bool placements_chosen = options.paper_mode;
  const auto begin_again = [&]() -> Result<void> {
    restore_seen_through(scans);
    ASBUILT_CHECK(start_as_detected(scans, model, context));
    ASBUILT_TRY(graph, linked(scans, model, options, folder, context));
    registration.graph = std::move(graph);
    return {};
  };
  for (int round = 1;; ++round) {
    ASBUILT_TRY(contradiction, refine_all(registration, model, options, folder, context));
    if (!placements_chosen) {
      placements_chosen = true;
      const auto timed = folder.stage("compare");
      ASBUILT_TRY(changed, choose_placements(registration.components.front(), scans, model, record, context));
      if (changed) {
        ASBUILT_CHECK(begin_again());
        round = 0;
        continue;
      }
    }
    // Rough starts leave a graph with gaps, in which a scan may have gone astray that a better one brings back.
    if (contradiction && round > 1) {
      drop(scans, *contradiction, record, context);
      ASBUILT_CHECK(begin_again());
      round = 0;
      continue;
    }
    if (options.paper_mode) return {};
    if (round == 1 && !contradiction) {
      for (const RefinedComponent& component : registration.components) {
        ASBUILT_CHECK(remove_seen_through(component, scans, context));
      }
    }
    if (round < kMostRounds) {
      start_as_refined(registration, contradiction.has_value());
      ASBUILT_TRY(graph, linked(scans, model, options, folder, context));
      // Scans that were not refined together stand to one another as they were found.
      if (graph.components != registration.graph.components) {
        for (PosedScan& scan : scans) scan.earlier = {};
      }
      if (round == 1 || !graph::links_alike(graph, registration.graph)) {
        registration.graph = std::move(graph);
        continue;
      }
    }
    const auto timed = folder.stage("compare");
    ASBUILT_TRY(separated, separate_individuals(registration.components.front(), scans, model, record, context));
    if (!separated) return {};
    ASBUILT_CHECK(begin_again());
    round = 0;
  }
}

io::GraphRecord recorded_graph(const graph::PoseGraph& graph, const std::vector<PosedScan>& scans) {
  const auto index = [&](int scan) { return scans[static_cast<std::size_t>(scan)].index; };
  io::GraphRecord record;
  std::set<std::pair<int, int>> links;
  for (const graph::PairOverlap& edge : graph.edges) links.emplace(edge.first, edge.second);
  for (const graph::PairOverlap& pair : graph.overlaps) {
    const bool linked = links.contains({pair.first, pair.second});
    record.overlaps.push_back({index(pair.first), index(pair.second), pair.overlap, linked});
  }
  for (const std::vector<int>& component : graph.components) {
    record.components.emplace_back();
    for (const int scan : component) record.components.back().push_back(index(scan));
  }
  return record;
}

io::RefinementRecord recorded_refinement(const RefinedComponent& component, int number, const Options& options,
                                         const std::vector<PosedScan>& scans) {
  const auto index = [&](int view) {
    return scans[static_cast<std::size_t>(component.members[static_cast<std::size_t>(view)])].index;
  };
  const refine::Refinement& refinement = component.refinement;
  io::RefinementRecord record;
  record.component = number;
  record.fixed_scan = index(refinement.fixed_view);
  record.iterations = refinement.iterations;
  record.rms_before = refinement.rms_before_mm;
  record.rms_after = refinement.rms_after_mm;
  record.converged = refinement.converged;
  record.on_model = refinement.on_model;
  record.gauge_method = options.gauge == Gauge::best_fit ? "best_fit" : "fixed";
  record.model_from_refined = component.model_from_refined;
  for (const refine::EdgeResidual& edge : refinement.edges) {
    record.edges.push_back({index(edge.first), index(edge.second), edge.pairs, edge.rms_mm});
  }
  for (const refine::LinkHold& hold : refinement.link_holds) {
    io::LinkRecord link{index(hold.first), index(hold.second), {hold.held.begin(), hold.held.end()}, {}};
    for (const refine::Motion& motion : hold.free) {
      const refine::Motion there = moved(motion, component.model_from_refined);
      link.free_motions.push_back({there.is_turn, there.direction, there.through, 0.0, true});
    }
    record.links.push_back(std::move(link));
  }
  return record;
}

/// The weakest place of a graph in pieces, for the reason of a scan that hangs loose.
std::string missing_link(int scan, const std::vector<int>& largest, const graph::PoseGraph& graph,
                         const std::vector<PosedScan>& scans, const io::RunRecord& record) {
  for (const graph::PairOverlap& pair : graph.overlaps) {  // by decreasing overlap
    const int other = pair.first == scan ? pair.second : pair.second == scan ? pair.first : -1;
    if (other < 0 || std::ranges::find(largest, other) == largest.end()) continue;
    const auto& name = record.scans[static_cast<std::size_t>(scans[static_cast<std::size_t>(other)].index)].name;
    return fmt::format("its best overlap with the largest component, with {}, is {:.0f} %", name, 100.0 * pair.overlap);
  }
  return "it overlaps with no scan of the largest component";
}

std::string in_words(const refine::LooseMotion& loose) {
  const Eigen::Vector3d& d = loose.motion.direction;
  std::string text = loose.motion.is_turn ? "turn about" : "slide along";
  text += fmt::format(" ({:.2f}, {:.2f}, {:.2f})", d.x(), d.y(), d.z());
  return text + (loose.unheld ? std::string(" by any amount") : fmt::format(" by {:.2g} mm (1 sigma)", loose.sigma_mm));
}

/// How firmly the others hold a scan; a sentence where they do not.
void describe_hold(io::ScanRecord& scan, const refine::ViewHold& hold, const Context& context) {
  if (!hold.sigma_mm.isZero(0.0)) scan.hold_sigma.assign(hold.sigma_mm.begin(), hold.sigma_mm.end());
  std::string motions;
  for (const refine::LooseMotion& loose : hold.loose) {
    const refine::Motion& motion = loose.motion;
    scan.loose_motions.push_back({motion.is_turn, motion.direction, motion.through, loose.sigma_mm, loose.unheld});
    motions += (motions.empty() ? "" : ", ") + in_words(loose);
  }
  if (motions.empty()) return;
  context.warn(fmt::format("{}: held weakly by the scans that it overlaps: it may {}", scan.path, motions));
}

/// Of a graph in pieces, the pair between two of them that lacks least to be a link: there one more scan helps most.
void name_missing_link(const Registration& registration, const io::RunRecord& record, const Options& options,
                       const Context& context) {
  const auto scan_of = [&](int scan) -> const PosedScan& { return registration.scans[static_cast<std::size_t>(scan)]; };
  graph::PoseGraph of_one_individual;
  of_one_individual.components = registration.graph.components;
  std::ranges::copy_if(registration.graph.overlaps, std::back_inserter(of_one_individual.overlaps),
                       [&](const graph::PairOverlap& pair) {
                         return scan_of(pair.first).individual == scan_of(pair.second).individual;
                       });
  const graph::PairOverlap missing = graph::best_missing_link(of_one_individual);
  if (missing.first < 0) return;  // one piece, or pieces that share nothing: each scan says so itself
  const auto name = [&](int scan) { return record.scans[static_cast<std::size_t>(scan_of(scan).index)].name; };
  context.warn(fmt::format(
      "the graph is in pieces: the best missing link is {} to {}, which overlap by {:.1f} % (needed: {:.1f} "
      "%); a scan that shows what both show would join them",
      name(missing.first), name(missing.second), 100.0 * missing.overlap, 100.0 * options.graph.edges.low));
}

void describe_scans(io::RunRecord& record, const Registration& registration, const Context& context) {
  const std::vector<PosedScan>& scans = registration.scans;
  for (std::size_t number = 0; number < registration.components.size(); ++number) {
    for (const int member : registration.components[number].members) {
      const PosedScan& posed = scans[static_cast<std::size_t>(member)];
      io::ScanRecord& scan = record.scans[static_cast<std::size_t>(posed.index)];
      scan.model_from_scan = posed.model_from_local * Eigen::Translation3d(-scan.offset);
      scan.covariance = posed.covariance;
      scan.component = static_cast<int>(number);
      describe_hold(scan, posed.hold, context);
      if (number == 0) continue;
      scan.status = io::ScanStatus::disconnected;
      const std::vector<int>& largest = registration.graph.components.front();
      const bool is_other = posed.individual != scans[static_cast<std::size_t>(largest.front())].individual;
      scan.reason_code = is_other ? "other_individual" : "disconnected";
      scan.reason =
          "a good detection, but " +
          (is_other ? posed.individual_reason : missing_link(member, largest, registration.graph, scans, record));
      context.warn(fmt::format("{}: disconnected: {}", scan.path, scan.reason));
    }
  }
}

/// Segments cut anew, those of the largest component merged.
Result<fuse::Reconstruction> fused(Registration& registration, const io::RunRecord& record, const Options& options,
                                   RunFolder& folder, const Context& context) {
  std::vector<fuse::PosedSegment> parts;
  {
    const auto timed = folder.stage("recut");
    if (options.paper_mode) {
      ASBUILT_CHECK(restore_segments({}, record, folder));
    } else {
      ASBUILT_CHECK(restore_segments(registration.scans, record, folder));
    }
    for (std::size_t i = registration.components.size(); i-- > 0;) {  // the largest, which is the first, is kept
      ASBUILT_TRY(cut,
                  recut_segments(registration.components[i], registration.scans, record, options, folder, context));
      parts = std::move(cut);
    }
  }
  const auto timed = folder.stage("fuse");
  return fuse::fuse(parts, options.fuse, context);
}

/// The surface mesh, if it is wanted. A cloud that makes no surface is worth a warning; the rest of the result stands.
Result<std::optional<TriangleMesh>> surface_of(const fuse::Reconstruction& reconstruction, const Options& options,
                                               RunFolder& folder, const Context& context) {
  folder.remove("mesh.ply");
  if (!options.mesh) return std::nullopt;
  const auto timed = folder.stage("mesh");
  auto mesh = fuse::surface_mesh(reconstruction, options.surface_mesh, context);
  if (mesh) return std::optional(std::move(*mesh));
  if (mesh.error().code != ErrorCode::not_possible) return tl::unexpected(mesh.error());
  context.warn("no mesh.ply: " + mesh.error().message);
  return std::nullopt;
}

/// How well the places of the scans in the reconstruction are known.
std::vector<inspect::ScanPose> poses_of(const io::RunRecord& record) {
  std::vector<inspect::ScanPose> poses;
  for (std::size_t i = 0; i < record.scans.size(); ++i) {
    if (record.scans[i].covariance) poses.push_back({static_cast<int>(i), *record.scans[i].covariance});
  }
  return poses;
}

/// Deviations, everything that shows them, and their figures in the record.
Result<void> inspect_and_report(const fuse::Reconstruction& reconstruction, const std::optional<TriangleMesh>& mesh,
                                const LoadedModel& model, const Options& options, const InspectionInputs& inputs,
                                RunFolder& folder, io::RunRecord& record, const Context& context) {
  const std::vector<inspect::ScanPose> poses = poses_of(record);
  const inspect::Measurement measurement{reconstruction.cloud, reconstruction.scan, reconstruction.support,
                                         reconstruction.sigma_mm, poses};
  std::optional<inspect::DeviationReport> deviations;
  {
    const auto timed = folder.stage("inspect");
    ASBUILT_TRY(found, inspect::inspect(measurement, model.prepared, inputs.options, context));
    deviations = std::move(found);
  }
  record.deviation = recorded_deviation(*deviations);
  const auto timed = folder.stage("report");
  report::ReportInput input{folder.command(), folder.arguments, record, model.prepared, *deviations, inputs.options};
  input.points = reconstruction.cloud.size();
  input.tolerance_file = inputs.tolerance_file;
  input.reference_file = inputs.reference_file;
  input.cloud_file = "reconstruction.ply";
  if (mesh) input.mesh_file = "mesh.ply";
  input.views = options.views;
  input.steps = options.colour_steps;
  const report::ColourMap colours = report::colours_of(input);
  if (mesh) {
    const auto path = folder.file("mesh.ply");
    ASBUILT_CHECK(write_coloured_mesh(path, *mesh, model.prepared, *deviations, colours, context));
  }
  folder.remove(kClosedMesh);
  if (options.watertight) {
    const auto written = write_closed_mesh(folder.file(kClosedMesh), model.prepared, *deviations, colours, context);
    if (written) {
      input.closed_mesh_file = kClosedMesh;
    } else if (written.error().code == ErrorCode::not_possible) {
      context.warn(fmt::format("no {}: {}", kClosedMesh, written.error().message));
    } else {
      return written;
    }
  }
  const auto path = folder.file("reconstruction.ply");
  ASBUILT_CHECK(write_reconstruction(path, reconstruction, deviations->deviation_mm, colours));
  return report::write_report(folder.file(""), input, context);
}

}  // namespace

Result<Registration> register_poses(std::vector<PosedScan> scans, const LoadedModel& model, const Options& options,
                                    RunFolder& folder, io::RunRecord& record, const Context& context) {
  Registration registration;
  registration.scans = std::move(scans);
  ASBUILT_CHECK(settle(registration, model, options, folder, record, context));
  record.graph = recorded_graph(registration.graph, registration.scans);
  record.refinement.emplace();
  for (std::size_t i = 0; i < registration.components.size(); ++i) {
    record.refinement->push_back(
        recorded_refinement(registration.components[i], static_cast<int>(i), options, registration.scans));
  }
  describe_scans(record, registration, context);
  name_missing_link(registration, record, options, context);
  return registration;
}

Result<void> register_scans(const LoadedModel& model, const Options& options, const InspectionInputs& inputs,
                            RunFolder& folder, io::RunRecord& record, const Context& context) {
  ASBUILT_TRY(scans, load_posed_scans(record, folder));
  if (scans.empty()) {
    record.state = io::RunState::failed;
    for (const char* stale : {"reconstruction.ply", "mesh.ply", kClosedMesh}) folder.remove(stale);
    for (const std::string& stale : report::report_files()) folder.remove(stale);
    return {};
  }
  ASBUILT_TRY(registration, register_poses(std::move(scans), model, options, folder, record, context));

  ASBUILT_TRY(reconstruction, fused(registration, record, options, folder, context));
  ASBUILT_TRY(mesh, surface_of(reconstruction, options, folder, context));
  record.state = io::RunState::complete;
  return inspect_and_report(reconstruction, mesh, model, options, inputs, folder, record, context);
}

}  // namespace asbuilt::pipeline
