// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "asbuilt/live/session_implementation.h"
#include "asbuilt/live/words.h"

namespace asbuilt::live {
namespace {

constexpr std::size_t kMostHoles = 12;
constexpr double kSmallestHole = 0.002;

}  // namespace

ScanState LiveSession::Implementation::scan_state(const std::string& file, const FileEntries& group,
                                                  const Entry& entry) const {
  ScanState scan;
  scan.record = entry.record;
  scan.record.candidates.resize(std::min<std::size_t>(scan.record.candidates.size(), 1));
  scan.file = file;
  scan.arrival = entry.arrival;
  scan.provisional = group.provisional;
  scan.refined = entry.refined;
  scan.seconds = group.seconds;
  scan.weak_directions = entry.weak;
  scan.new_share = entry.new_share;
  if (!entry.dropped.empty()) {
    scan.record.status = io::ScanStatus::dropped;
    scan.record.reason_code = "contradicted_by_scans";
    scan.record.reason = entry.dropped;
    scan.record.model_from_scan.reset();
    return scan;
  }
  if (!entry.in_use()) return scan;
  const pipeline::PosedScan& posed = *entry.posed;
  scan.record.model_from_scan = posed.model_from_local * Eigen::Translation3d(-entry.record.offset);
  scan.covered_share = area_share(surface, [&](std::size_t v) { return !std::isnan(entry.seen[v]); });
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& p : posed.part.positions) middle += p.cast<double>();
  middle /= static_cast<double>(std::max<std::size_t>(1, posed.part.size()));
  if (posed.viewpoint.kind == scan::Viewpoint::Kind::point) {
    scan.viewpoint_in_model = posed.model_from_local * posed.viewpoint.value;
  }
  if (posed.viewpoint.known()) {
    scan.view_direction_in_model =
        -(posed.model_from_local.linear() * posed.viewpoint.towards_sensor(middle)).normalized();
  }
  return scan;
}

void LiveSession::Implementation::describe_graph(LiveState& state, const std::map<const Entry*, int>& index) const {
  const graph::PoseGraph pose_graph = graph();
  const auto scan_of = [&](int node) { return index.at(nodes[static_cast<std::size_t>(node)]); };
  const double linked_from = options.pipeline.graph.edges.high;
  for (const graph::PairOverlap& pair : pose_graph.overlaps) {
    const bool used = std::ranges::find(pose_graph.edges, pair) != pose_graph.edges.end();
    if (!used && pair.overlap < 0.01) continue;
    LinkState link{std::min(scan_of(pair.first), scan_of(pair.second)),
                   std::max(scan_of(pair.first), scan_of(pair.second)),
                   pair.overlap,
                   used,
                   firmness(pair.overlap, linked_from),
                   {}};
    const auto rms = edge_rms.find({state.scans[static_cast<std::size_t>(link.a)].record.name,
                                    state.scans[static_cast<std::size_t>(link.b)].record.name});
    if (used && rms != edge_rms.end()) link.rms_mm = rms->second;
    state.links.push_back(link);
  }
  // Canonical, whatever the order of arrival: by overlap, then by name.
  std::ranges::sort(state.links, [](const LinkState& x, const LinkState& y) {
    return std::tuple(-x.overlap, x.a, x.b) < std::tuple(-y.overlap, y.a, y.b);
  });
  for (const std::vector<int>& component : pose_graph.components) {
    PieceState piece;
    for (const int node : component) piece.scans.push_back(scan_of(node));
    std::ranges::sort(piece.scans);
    state.pieces.push_back(std::move(piece));
  }
  std::ranges::stable_sort(state.pieces, [](const PieceState& x, const PieceState& y) {
    return std::tuple(-static_cast<std::ptrdiff_t>(x.scans.size()), x.scans.front()) <
           std::tuple(-static_cast<std::ptrdiff_t>(y.scans.size()), y.scans.front());
  });
  for (std::size_t k = 0; k < state.pieces.size(); ++k) {
    for (const int scan : state.pieces[k].scans) {
      ScanState& entry = state.scans[static_cast<std::size_t>(scan)];
      entry.piece = static_cast<int>(k);
      if (k == 0) continue;
      entry.record.status = io::ScanStatus::disconnected;
      entry.record.reason_code = "disconnected";
    }
  }
}

void LiveSession::Implementation::describe_joins(LiveState& state) const {
  const auto piece_of = [&](int scan) { return *state.scans[static_cast<std::size_t>(scan)].piece; };
  for (std::size_t k = 1; k < state.pieces.size(); ++k) {
    JoinState join;
    for (const LinkState& link : state.links) {  // by decreasing overlap
      const int a = piece_of(link.a), b = piece_of(link.b), self = static_cast<int>(k);
      if (!((a == self && b == 0) || (a == 0 && b == self))) continue;
      join.a = a == self ? link.a : link.b;
      join.b = a == self ? link.b : link.a;
      join.best_overlap = link.overlap;
      break;
    }
    for (std::size_t v = 0; v < state.views.size() && join.view < 0; ++v) {
      if (state.views[v].proposal.joins == static_cast<int>(k)) join.view = static_cast<int>(v);
    }
    const auto name = [&](int scan) { return state.scans[static_cast<std::size_t>(scan)].record.name; };
    join.text = join.a < 0 ? fmt::format("{} shares no surface with the first piece", name(state.pieces[k].scans[0]))
                           : fmt::format("{} shares only {:.0f} % with {}", name(join.a), 100.0 * join.best_overlap,
                                         name(join.b));
    join.text += "; a view that shows both joins them";
    state.pieces[k].join = std::move(join);
  }
}

SurfaceValues LiveSession::Implementation::values_of(const std::vector<const Entry*>& entries) const {
  const std::size_t count = surface.mesh.vertices.size();
  SurfaceValues values;
  values.support.assign(count, 0);
  values.newest.assign(count, 65535);
  values.deviation_mm.assign(count, std::numeric_limits<float>::quiet_NaN());
  std::vector<double> sum(count, 0.0);
  std::vector<int> newest(count, -1);
  for (const Entry* entry : entries) {
    if (!entry->in_use()) continue;
    for (std::size_t v = 0; v < count; ++v) {
      if (std::isnan(entry->seen[v])) continue;
      ++values.support[v];
      sum[v] += static_cast<double>(entry->seen[v]);
      newest[v] = std::max(newest[v], entry->arrival);
    }
  }
  for (std::size_t v = 0; v < count; ++v) {
    if (values.support[v] == 0) continue;
    values.deviation_mm[v] = static_cast<float>(sum[v] / values.support[v]);
    values.newest[v] = static_cast<std::uint16_t>(std::min(newest[v], 65534));
  }
  return values;
}

void LiveSession::Implementation::describe_surface(LiveState& state, const SurfaceValues& values,
                                                   const std::vector<const Entry*>& entries) const {
  state.covered_share = area_share(surface, [&](std::size_t v) { return values.support[v] > 0; });
  state.twice_share = area_share(surface, [&](std::size_t v) { return values.support[v] > 1; });
  std::vector<std::vector<char>> by_piece(state.pieces.size(), std::vector<char>(values.support.size(), 0));
  for (std::size_t k = 0; k < state.pieces.size(); ++k) {
    for (const int scan : state.pieces[k].scans) {
      const SeenDeviation& seen = entries[static_cast<std::size_t>(scan)]->seen;
      for (std::size_t v = 0; v < seen.size(); ++v) by_piece[k][v] = by_piece[k][v] || !std::isnan(seen[v]);
    }
    state.pieces[k].share = area_share(surface, [&](std::size_t v) { return by_piece[k][v] != 0; });
  }
  // Before a first scan the sensor is only assumed: nothing can be said about what it cannot see.
  if (planner->limits().source != "assumed") state.coverable_share = planner->coverable_share();
  state.sensor = planner->limits();
  for (const ViewProposal& proposal : planner->best_views(by_piece)) {
    state.views.push_back({proposal, proposal.gain_share * surface.total_area_mm2, view_in_words(proposal)});
  }
  for (Hole& hole : holes(surface, values.support, kSmallestHole, kMostHoles)) {
    double seen = 0.0;
    for (const std::uint32_t v : hole.vertices) seen += planner->is_coverable(v) ? surface.area_mm2[v] : 0.0;
    HoleState shown_hole;
    shown_hole.reachable = seen > 0.2 * hole.area_mm2;
    hole.vertices.clear();
    shown_hole.text = hole_in_words(hole, model.prepared.face_names);
    if (!shown_hole.reachable) shown_hole.text += ", which no position outside the part sees";
    shown_hole.hole = std::move(hole);
    state.holes.push_back(std::move(shown_hole));
  }
}

std::pair<LiveState, SurfaceValues> LiveSession::Implementation::composed() const {
  LiveState state = next;
  std::vector<const Entry*> entries;
  std::map<const Entry*, int> index;
  for (const auto& [file, group] : files) {
    for (const Entry& entry : group.entries) {
      index[&entry] = static_cast<int>(entries.size());
      if (file == latest) state.newest = std::max(state.newest, index[&entry]);
      entries.push_back(&entry);
      state.scans.push_back(scan_state(file, group, entry));
    }
  }
  for (const auto& [file, original] : duplicates) state.duplicates.emplace_back(file, original);
  for (const auto& [file, hash] : store->removed()) state.removed.push_back(file);
  describe_graph(state, index);
  SurfaceValues values = values_of(entries);
  describe_surface(state, values, entries);
  describe_joins(state);
  for (std::size_t i = 0; i < state.scans.size(); ++i) {
    state.scans[i].sentence = sentence_for(state, i);
  }
  set_now(state);
  return {std::move(state), std::move(values)};
}

void LiveSession::Implementation::publish_light(const OnChange& on_change,
                                                const std::function<void(LiveState&)>& change) {
  std::shared_ptr<const LiveState> published;
  {
    const std::lock_guard lock(mutex);
    auto state = std::make_shared<LiveState>(*shown);
    change(next);
    change(*state);
    state->now_sound.clear();
    state->revision = ++next.revision;
    shown = published = std::move(state);
  }
  if (on_change) on_change(published);
}

void LiveSession::Implementation::publish(const OnChange& on_change, const std::string& sound) {
  auto [state, values] = composed();
  std::shared_ptr<const LiveState> published;
  {
    const std::lock_guard lock(mutex);
    state.revision = ++next.revision;
    state.surface_revision = ++next.surface_revision;
    state.now_sound = sound;
    values.revision = state.surface_revision;
    shown = published = std::make_shared<const LiveState>(std::move(state));
    shown_values = std::make_shared<const SurfaceValues>(std::move(values));
  }
  if (on_change) on_change(published);
}

}  // namespace asbuilt::live
