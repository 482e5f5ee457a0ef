// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/live/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <new>
#include <set>

#include "asbuilt/core/parallel.h"
#include "asbuilt/core/voxel_grid.h"
#include "asbuilt/io/file.h"
#include "asbuilt/live/scan_store.h"
#include "asbuilt/live/words.h"
#include "asbuilt/pipeline/collect_runs.h"
#include "asbuilt/pipeline/inspection_inputs.h"
#include "asbuilt/pipeline/joint_half.h"
#include "asbuilt/pipeline/run_folder.h"
#include "asbuilt/pipeline/scan_half.h"

namespace asbuilt::live {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostNotes = 50, kMostHoles = 12;
constexpr double kSmallestHole = 0.002;

/// A scan of the session with what is needed to show it.
struct Entry {
  io::ScanRecord record;                     ///< as detected
  std::optional<pipeline::PosedScan> posed;  ///< of an accepted scan, its part thinned
  SeenDeviation seen;
  bool refined = false;
  std::string dropped;  ///< why the others contradict it; empty if they do not
  double new_share = 0.0;
  std::vector<WeakDirection> weak;
  int arrival = 0;

  [[nodiscard]] bool in_use() const { return posed.has_value() && dropped.empty(); }
};

struct FileEntries {
  std::vector<Entry> entries;
  std::optional<SensorLimits> limits;
  bool provisional = false;
  double seconds = 0.0;
};

/// Points that a file may lose without changing what is seen at a first look: no colours, no grid, every n-th point.
io::ScanFile thinned(const io::ScanFile& file, std::size_t wanted) {
  io::ScanFile thin = file;
  thin.colours.clear();
  thin.intensities.clear();
  thin.grid.reset();
  thin.cloud = {};
  const std::size_t stride = std::max<std::size_t>(1, file.cloud.size() / wanted);
  for (std::size_t i = 0; i < file.cloud.size(); i += stride) {
    thin.cloud.positions.push_back(file.cloud.positions[i]);
    if (file.cloud.has_normals()) thin.cloud.normals.push_back(file.cloud.normals[i]);
  }
  return thin;
}

std::optional<Eigen::Vector3d> local_viewpoint(const io::ScanRecord& scan) {
  if (!scan.viewpoint || scan.viewpoint_kind != "point") return std::nullopt;
  return Eigen::Vector3d(*scan.viewpoint - scan.offset);
}

std::optional<SensorLimits> limits_of(const std::vector<io::ScanFile>& files, const std::vector<Entry>& entries) {
  std::vector<SensorLimits> seen;
  for (const Entry& entry : entries) {
    const auto viewpoint = local_viewpoint(entry.record);
    const auto index = static_cast<std::size_t>(entry.record.index_in_file);
    if (!entry.posed || !viewpoint || index >= files.size() || files[index].cloud.empty()) continue;
    seen.push_back(limits_seen(files[index].cloud.positions, entry.posed->part, *viewpoint));
  }
  return seen.empty() ? std::nullopt : std::optional(learnt_limits(seen));
}

bool differ_much(const SensorLimits& a, const SensorLimits& b) {
  const auto apart = [](double x, double y) { return std::abs(x - y) > 0.15 * std::max(x, y); };
  return a.source != b.source || apart(a.half_angle_deg, b.half_angle_deg) || apart(a.distance_mm, b.distance_mm) ||
         apart(a.far_mm, b.far_mm) || apart(a.near_mm, b.near_mm);
}

}  // namespace

struct LiveSession::Implementation {
  Implementation(LiveOptions chosen, fs::path where, const Context& with)
      : options(std::move(chosen)), folder(std::move(where)), context(with) {}

  LiveOptions options;
  fs::path folder;
  Context context;
  std::optional<pipeline::RunFolder> run;
  std::optional<ScanStore> store;
  pipeline::LoadedModel model;
  pipeline::SharedByScans shared;
  Surface surface;
  std::unique_ptr<ViewPlanner> planner;
  std::optional<graph::PoseGraphBuilder> builder;
  std::map<std::string, FileEntries> files;  // canonical order
  std::vector<Entry*> nodes;                 // of the graph
  std::optional<graph::PoseGraph> joint;     // what the joint refinement decided, until scans come or go
  std::map<std::pair<std::string, std::string>, double> edge_rms;
  std::map<std::string, std::string> duplicates;  // file, of which
  std::map<std::string, std::string> duplicate_paths;
  std::string latest;  // name of the file that came last
  int next_arrival = 0;
  bool due = false;
  LiveState next;  // what is shown next, as far as it does not follow from the scans

  mutable std::mutex mutex;
  std::shared_ptr<const LiveState> shown;
  std::shared_ptr<const SurfaceValues> shown_values;

  // Pictures need fewer points than results.
  void thin(pipeline::PosedScan& posed) const {
    const auto chosen = even_subset(posed.part.positions, std::max(0.25 * surface.edge_mm, posed.spacing_mm), context);
    PointCloud part;
    for (const std::uint32_t i : chosen) {
      part.positions.push_back(posed.part.positions[i]);
      part.normals.push_back(posed.part.normals[i]);
    }
    posed.part = std::move(part);
  }

  [[nodiscard]] std::optional<pipeline::PosedScan> posed(const io::ScanRecord& record, const fs::path& segment) const {
    if (record.status != io::ScanStatus::accepted || !record.model_from_scan) return std::nullopt;
    auto loaded = pipeline::posed_scan(record, 0, segment);
    if (!loaded || loaded->part.empty()) return std::nullopt;
    loaded->model_from_local = loaded->model_from_local_start;
    thin(*loaded);
    return std::move(*loaded);
  }

  void see(Entry& entry) const {
    entry.seen.clear();
    if (!entry.in_use()) return;
    entry.seen = seen_from(entry.posed->part, entry.posed->model_from_local, entry.posed->spacing_mm, surface,
                           model.prepared, context);
  }

  void insert_node(Entry& entry) {
    if (!entry.in_use()) return;
    joint.reset();
    const auto node = builder->insert({entry.posed->part, entry.posed->model_from_local}, context);
    if (node) nodes.push_back(&entry);
  }

  void rebuild_graph() {
    joint.reset();
    builder = *graph::PoseGraphBuilder::create(model.prepared, options.pipeline.graph);  // validated in open
    nodes.clear();
    for (auto& [file, group] : files) {
      for (Entry& entry : group.entries) insert_node(entry);
    }
  }

  [[nodiscard]] graph::PoseGraph graph() const {
    if (joint) return *joint;
    return nodes.empty() ? graph::PoseGraph() : builder->graph();
  }

  /// Fits a scan that has just come to those it is linked to, which stay where they are.
  void fit_to_neighbours(Entry& entry) const {
    const auto self = static_cast<int>(nodes.size()) - 1;
    refine::View rest;
    for (const graph::PairOverlap& edge : graph().edges) {
      if (edge.first != self && edge.second != self) continue;
      const Entry& other = *nodes[static_cast<std::size_t>(edge.first == self ? edge.second : edge.first)];
      const Pose& pose = other.posed->model_from_local;
      for (std::size_t i = 0; i < other.posed->part.size(); ++i) {
        rest.segment_in_scan.positions.push_back((pose * other.posed->part.positions[i].cast<double>()).cast<float>());
        rest.segment_in_scan.normals.push_back(
            (pose.linear() * other.posed->part.normals[i].cast<double>()).cast<float>());
      }
      rest.noise_sigma_mm = std::max(rest.noise_sigma_mm, other.posed->noise_sigma_mm);
    }
    if (rest.segment_in_scan.empty()) return;
    pipeline::PosedScan& own = *entry.posed;
    const std::vector<refine::View> views{rest, {own.part, own.model_from_local, own.noise_sigma_mm, own.viewpoint}};
    const std::vector<refine::Link> links{{0, 1}};
    refine::RefineOptions quick = options.pipeline.refine;
    quick.points_per_scan = std::min(quick.points_per_scan, 8000);
    const auto fit = refine::refine(views, links, quick, context);
    if (!fit) return;  // it stays as detected; the joint refinement will tell
    own.model_from_local = orthonormalised(fit->model_from_scan[0].inverse() * fit->model_from_scan[1]);
    entry.weak = weak_directions(fit->covariance[fit->fixed_view == 0 ? 1 : 0], model.prepared.box.center(),
                                 model.prepared.diameter, own.noise_sigma_mm);
  }

  /// Takes the scans of a file in, in place of those it had.
  void show(const std::string& file, FileEntries group) {
    const bool known = files.contains(file);
    std::vector<int> arrivals;
    if (known) {
      for (const Entry& entry : files[file].entries) arrivals.push_back(entry.arrival);
    }
    files[file] = std::move(group);
    if (known) {
      rebuild_graph_without(file);
    }
    std::vector<char> seen_before = seen_by_any(file);
    auto& entries = files[file].entries;
    for (std::size_t i = 0; i < entries.size(); ++i) {
      Entry& entry = entries[i];
      entry.arrival = i < arrivals.size() ? arrivals[i] : next_arrival++;
      if (!entry.in_use()) continue;
      insert_node(entry);
      if (!nodes.empty() && nodes.back() == &entry) fit_to_neighbours(entry);
      see(entry);
      entry.new_share =
          area_share(surface, [&](std::size_t v) { return !std::isnan(entry.seen[v]) && !seen_before[v]; });
      for (std::size_t v = 0; v < seen_before.size(); ++v) {
        if (!std::isnan(entry.seen[v])) seen_before[v] = 1;
      }
    }
    latest = file;
    due = true;
  }

  void rebuild_graph_without(const std::string& file) {
    auto kept = files.extract(file);
    rebuild_graph();
    files.insert(std::move(kept));
  }

  [[nodiscard]] std::vector<char> seen_by_any(const std::string& but) const {
    std::vector<char> any(surface.mesh.vertices.size(), 0);
    for (const auto& [file, group] : files) {
      if (file == but) continue;
      for (const Entry& entry : group.entries) {
        for (std::size_t v = 0; v < entry.seen.size(); ++v) {
          if (!std::isnan(entry.seen[v])) any[v] = 1;
        }
      }
    }
    return any;
  }

  void erase(const std::string& file) {
    files.erase(file);
    if (latest == file) latest.clear();
    edge_rms.clear();
    due = true;
    rebuild_graph();
  }

  // ---- The state ----

  [[nodiscard]] ScanState scan_state(const std::string& file, const FileEntries& group, const Entry& entry) const {
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

  void describe_graph(LiveState& state, const std::map<const Entry*, int>& index) const {
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

  void describe_joins(LiveState& state) const {
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

  [[nodiscard]] SurfaceValues values_of(const std::vector<const Entry*>& entries) const {
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

  void describe_surface(LiveState& state, const SurfaceValues& values, const std::vector<const Entry*>& entries) const {
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
      shown_hole.text = hole_in_words(hole);
      if (!shown_hole.reachable) shown_hole.text += ", which no position outside the part sees";
      shown_hole.hole = std::move(hole);
      state.holes.push_back(std::move(shown_hole));
    }
  }

  /// Everything that is shown, from the scans as they are.
  [[nodiscard]] std::pair<LiveState, SurfaceValues> composed() const {
    LiveState state = next;
    std::vector<const Entry*> entries;
    std::map<const Entry*, int> index;
    int newest = -1;
    for (const auto& [file, group] : files) {
      for (const Entry& entry : group.entries) {
        index[&entry] = static_cast<int>(entries.size());
        if (file == latest) newest = std::max(newest, index[&entry]);
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
    set_now(state, newest);
    return {std::move(state), std::move(values)};
  }
};

LiveSession::LiveSession(std::unique_ptr<Implementation> implementation) : implementation_(std::move(implementation)) {}
LiveSession::~LiveSession() = default;

namespace {

/// Publishes a state that says the same of the scans, after a change of phase, note or the like.
void publish_light(auto& session, auto& on_change, const std::function<void(LiveState&)>& change) {
  std::shared_ptr<const LiveState> published;
  {
    const std::lock_guard lock(session.mutex);
    auto state = std::make_shared<LiveState>(*session.shown);
    change(session.next);
    change(*state);
    state->now_sound.clear();
    state->revision = ++session.next.revision;
    session.shown = published = std::move(state);
  }
  if (on_change) on_change(published);
}

/// Publishes everything anew.
void publish(auto& session, auto& on_change, const std::string& sound = {}) {
  auto [state, values] = session.composed();
  std::shared_ptr<const LiveState> published;
  {
    const std::lock_guard lock(session.mutex);
    state.revision = ++session.next.revision;
    state.surface_revision = ++session.next.surface_revision;
    state.now_sound = sound;
    values.revision = state.surface_revision;
    session.shown = published = std::make_shared<const LiveState>(std::move(state));
    session.shown_values = std::make_shared<const SurfaceValues>(std::move(values));
  }
  if (on_change) on_change(published);
}

Result<void> check_same_session(const ScanStore& store, const io::RunRecord& expected, const fs::path& folder) {
  for (const auto& [file, stored] : store.files()) {
    const bool same_model = stored.record.model.sha256 == expected.model.sha256;
    const bool same_options = stored.record.options == expected.options && stored.record.version == expected.version;
    if (same_model && same_options) continue;
    return fail(ErrorCode::unwritable_output,
                fmt::format("{}: holds a session with {}; choose another --output, or give --force to start anew",
                            folder.string(), same_model ? "other options or of another version" : "another model"));
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<LiveSession>> LiveSession::open(const std::string& model_path, const LiveOptions& options,
                                                       const fs::path& folder, bool force, const Context& context) {
  ASBUILT_CHECK(options.pipeline.validate());
  auto own = std::make_unique<Implementation>(options, folder, context);
  own->options.pipeline = pipeline::with_paper_mode_applied(options.pipeline);
  ASBUILT_TRY(run, pipeline::RunFolder::open(folder, "live", force, context.arena().threads()));
  ASBUILT_TRY(model, pipeline::load_model(model_path, own->options.pipeline, context));
  own->model = std::move(model);
  ASBUILT_TRY(shared, pipeline::shared_by_scans(own->model, own->options.pipeline, run, context));
  own->shared = std::move(shared);
  ASBUILT_CHECK(run.finish());
  own->run.emplace(std::move(run));
  if (force) {
    std::error_code ignored;
    fs::remove_all(folder / "scans", ignored);
    fs::remove(folder / "live.json", ignored);
  }
  std::vector<std::string> lost;
  ASBUILT_TRY(store, ScanStore::open(folder, lost));
  ASBUILT_CHECK(check_same_session(store, own->shared.empty_record, folder));
  own->store.emplace(std::move(store));
  own->surface = surface_of(own->model.prepared);
  own->planner =
      std::make_unique<ViewPlanner>(own->surface, own->model.prepared,
                                    options.sensor.value_or(assumed_limits(own->model.prepared.diameter)), context);
  LiveState& next = own->next;
  next.model = own->model.record;
  next.box = own->model.prepared.box;
  next.output = folder.string();
  next.total_area_mm2 = own->surface.total_area_mm2;
  next.faces = own->surface.face.empty() ? 0 : 1 + static_cast<int>(std::ranges::max(own->surface.face));
  next.phase = "waiting";
  ASBUILT_TRY(first_builder, graph::PoseGraphBuilder::create(own->model.prepared, own->options.pipeline.graph));
  own->builder = std::move(first_builder);

  // What an earlier session left, in the order in which it came.
  std::vector<const StoredFile*> stored;
  for (const auto& [file, one] : own->store->files()) stored.push_back(&one);
  std::ranges::sort(stored, {}, &StoredFile::order);
  for (const StoredFile* one : stored) {
    FileEntries group;
    group.limits = one->limits;
    for (std::size_t i = 0; i < one->record.scans.size(); ++i) {
      Entry entry;
      entry.record = one->record.scans[i];
      entry.posed = own->posed(entry.record, one->folder / io::segment_file(i, entry.record.name));
      group.entries.push_back(std::move(entry));
    }
    own->show(one->file, std::move(group));
  }
  own->latest.clear();
  for (const std::string& text : lost) next.notes.push_back({0, "warn", "", text + "; its scans are judged again"});
  std::unique_ptr<LiveSession> session(new LiveSession(std::move(own)));
  session->implementation_->shown = std::make_shared<LiveState>();
  publish(*session->implementation_, session->on_change);
  return session;
}

namespace {

void learn_sensor(auto& own) {
  if (own.options.sensor) return;
  std::vector<SensorLimits> seen;
  for (const auto& [file, group] : own.files) {
    if (group.limits) seen.push_back(*group.limits);
  }
  if (seen.empty()) return;
  const SensorLimits learnt = learnt_limits(seen);
  if (!differ_much(learnt, own.planner->limits())) return;
  own.planner = std::make_unique<ViewPlanner>(own.surface, own.model.prepared, learnt, own.context);
}

std::string sound_of(const FileEntries& group) {
  const bool used = std::ranges::any_of(group.entries, &Entry::in_use);
  return used ? "accepted" : "rejected";
}

/// A first look at a large file, on a thinned copy of each scan. Nothing if it fails: the whole will tell.
std::optional<FileEntries> first_look(auto& own, const pipeline::InputFile& input, const pipeline::ScanHalf& half) {
  FileEntries group;
  group.provisional = true;
  for (const io::ScanFile& file : *input.scans) {
    Context quiet = own.context;
    quiet.warning = nullptr;
    auto judged = pipeline::judge_scan(thinned(file, own.options.first_look_points), half, *own.run, quiet);
    if (!judged) return std::nullopt;
    for (pipeline::JudgedScan& scan : *judged) {
      Entry entry;
      entry.record = std::move(scan.record);
      entry.record.path = input.path;
      entry.record.name = pipeline::entry_name(file.name, entry.record.instance);
      entry.record.sha256 = input.sha256;
      entry.record.index_in_file = file.index_in_file;
      if (scan.segment && entry.record.status == io::ScanStatus::accepted) {
        pipeline::PosedScan posed;
        for (std::size_t i = 0; i < scan.segment->cloud.size(); ++i) {
          if (!scan.segment->is_part[i]) continue;
          posed.part.positions.push_back(scan.segment->cloud.positions[i]);
          posed.part.normals.push_back(scan.segment->cloud.normals[i]);
        }
        posed.model_from_local_detected = *entry.record.model_from_scan * Eigen::Translation3d(entry.record.offset);
        posed.model_from_local_start = posed.model_from_local = posed.model_from_local_detected;
        posed.noise_sigma_mm = entry.record.noise_sigma;
        posed.spacing_mm = entry.record.spacing;
        if (const auto viewpoint = local_viewpoint(entry.record)) {
          posed.viewpoint = {scan::Viewpoint::Kind::point, *viewpoint};
        }
        own.thin(posed);
        if (!posed.part.empty()) entry.posed = std::move(posed);
      }
      group.entries.push_back(std::move(entry));
    }
  }
  return group;
}

}  // namespace

Result<void> LiveSession::add(const std::string& path) {
  Implementation& own = *implementation_;
  const auto begin = Clock::now();
  const std::string file = fs::path(path).filename().string();
  const auto since = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
  pipeline::InputFile input = pipeline::read_input(path, own.options.pipeline, own.context);
  if (!input.scans && input.scans.error().code == ErrorCode::cancelled) return tl::unexpected(input.scans.error());

  const auto out = own.store->removed().find(file);
  if (out != own.store->removed().end()) {
    if (out->second == input.sha256) return {};
    ASBUILT_CHECK(own.store->set_removed(file, std::nullopt));  // another content: another scan
  }
  const auto stored = own.store->files().find(file);
  if (stored != own.store->files().end() && !input.sha256.empty()) {
    const auto& scans = stored->second.record.scans;
    const bool same = std::ranges::all_of(
        scans, [&](const io::ScanRecord& scan) { return scan.sha256 == input.sha256 && scan.path == path; });
    if (same && !scans.empty()) return {};
  }
  own.duplicates.erase(file);
  std::string outdone;
  for (const auto& [other, known] : own.store->files()) {
    if (other == file || input.sha256.empty() || known.record.scans.empty()) continue;
    if (known.record.scans.front().sha256 != input.sha256) continue;
    if (other < file) {
      if (stored != own.store->files().end()) {
        ASBUILT_CHECK(own.store->erase(file));
        own.erase(file);
      }
      own.duplicates[file] = other;
      own.duplicate_paths[file] = path;
      publish(own, on_change);
      note("info", file, fmt::format("{} is the same file as {} and counts once", file, other));
      return {};
    }
    outdone = other;
  }

  set_phase("judging", file);
  const pipeline::ScanHalf half = own.shared.half(own.model, own.options.pipeline);
  ASBUILT_TRY(folder, own.store->begin(file));
  const bool large = input.scans && std::ranges::any_of(*input.scans, [&](const io::ScanFile& scan) {
                       return scan.cloud.size() > own.options.first_look_above;
                     });
  bool told = false;
  if (large) {
    try {
      if (auto looked = first_look(own, input, half)) {
        looked->seconds = since();
        const std::string sound = sound_of(*looked);
        own.show(file, std::move(*looked));
        publish(own, on_change, sound);
        told = true;
      }
    } catch (const std::bad_alloc&) {  // the whole will tell
    }
  }

  // Sensor limits want the cloud, which the scan half lets go.
  std::vector<io::ScanFile> outlines;
  if (input.scans) {
    for (const io::ScanFile& scan : *input.scans) outlines.push_back(thinned(scan, 4000));
  }
  std::optional<io::RunRecord> made;
  const auto detect_alone = [&]() -> Result<void> {
    ASBUILT_TRY(detect_run, pipeline::RunFolder::open(folder, "detect", false, own.context.arena().threads()));
    io::RunRecord record = own.shared.empty_record;
    ASBUILT_CHECK(pipeline::take_scans(input, half, detect_run, record, own.context));
    const bool any = std::ranges::any_of(
        record.scans, [](const io::ScanRecord& scan) { return scan.status != io::ScanStatus::failed; });
    record.state = any ? io::RunState::complete : io::RunState::failed;
    ASBUILT_CHECK(detect_run.finish(record));
    made = std::move(record);
    return {};
  };
  FileEntries group;
  const auto take_in = [&]() -> Result<void> {
    ASBUILT_CHECK(detect_alone());
    for (std::size_t i = 0; i < made->scans.size(); ++i) {
      Entry entry;
      entry.record = made->scans[i];
      entry.posed = own.posed(entry.record, folder / io::segment_file(i, entry.record.name));
      group.entries.push_back(std::move(entry));
    }
    group.limits = limits_of(outlines, group.entries);
    return own.store->commit(file, *made, group.limits);
  };
  if (auto taken = take_in(); !taken) {
    if (told && own.files.contains(file)) own.erase(file);
    own.next.phase = "waiting";
    own.next.busy_with.clear();
    publish(own, on_change);
    return taken;
  }
  group.seconds = since();
  const std::string sound = sound_of(group);
  own.show(file, std::move(group));
  if (!outdone.empty()) {
    ASBUILT_CHECK(own.store->erase(outdone));
    own.erase(outdone);
    own.duplicates[outdone] = file;
    own.duplicate_paths[outdone] = (fs::path(path).parent_path() / outdone).string();
    own.latest = file;
  }
  own.next.phase = "waiting";
  own.next.busy_with.clear();
  own.next.refinement = "due";
  publish(own, on_change, told ? std::string() : sound);
  const SensorLimits before = own.planner->limits();
  learn_sensor(own);
  if (!(own.planner->limits() == before)) publish(own, on_change);
  return {};
}

Result<void> LiveSession::remove(const std::string& file) {
  Implementation& own = *implementation_;
  own.duplicates.erase(file);
  if (own.store->removed().contains(file)) ASBUILT_CHECK(own.store->set_removed(file, std::nullopt));
  if (own.store->files().contains(file)) {
    ASBUILT_CHECK(own.store->erase(file));
    own.erase(file);
    own.next.refinement = "due";
  }
  publish(own, on_change);
  for (const auto& [duplicate, original] : std::map(own.duplicates)) {
    if (original == file) return add(own.duplicate_paths[duplicate]);  // it takes the others along
  }
  return {};
}

Result<bool> LiveSession::take_out(const std::string& file) {
  Implementation& own = *implementation_;
  const auto stored = own.store->files().find(file);
  if (stored == own.store->files().end()) return false;
  const std::string sha256 = stored->second.record.scans.empty() ? "" : stored->second.record.scans.front().sha256;
  ASBUILT_CHECK(own.store->set_removed(file, sha256));  // first: killed here, it is taken out at the next start
  ASBUILT_CHECK(own.store->erase(file));
  own.erase(file);
  own.next.refinement = "due";
  publish(own, on_change);
  return true;
}

Result<bool> LiveSession::restore(const std::string& file) {
  Implementation& own = *implementation_;
  if (!own.store->removed().contains(file)) return false;
  ASBUILT_CHECK(own.store->set_removed(file, std::nullopt));
  publish(own, on_change);
  return true;
}

Result<void> LiveSession::keep_only(const std::vector<std::string>& present) {
  Implementation& own = *implementation_;
  const std::set<std::string> there(present.begin(), present.end());
  std::vector<std::string> gone;
  for (const auto& [file, stored] : own.store->files()) {
    // Taken out, but killed before its scans went.
    if (!there.contains(file) || own.store->removed().contains(file)) gone.push_back(file);
  }
  for (const std::string& file : gone) {
    ASBUILT_CHECK(own.store->erase(file));
    own.erase(file);
  }
  std::vector<std::string> forgotten;
  for (const auto& [file, sha256] : own.store->removed()) {
    if (!there.contains(file)) forgotten.push_back(file);
  }
  for (const std::string& file : forgotten) ASBUILT_CHECK(own.store->set_removed(file, std::nullopt));
  learn_sensor(own);
  publish(own, on_change);
  return {};
}

bool LiveSession::refinement_is_due() const { return implementation_->due; }

Result<bool> LiveSession::refine_jointly(std::stop_token stop) {
  Implementation& own = *implementation_;
  if (!own.due) return false;
  io::RunRecord record = own.shared.empty_record;
  std::vector<Entry*> entries;
  std::vector<pipeline::PosedScan> scans;
  Context quiet = own.context;
  quiet.warning = nullptr;
  quiet.progress = nullptr;
  quiet.stop = stop;
  for (auto& [file, group] : own.files) {
    const StoredFile& stored = own.store->files().at(file);
    for (std::size_t i = 0; i < group.entries.size(); ++i) {
      Entry& entry = group.entries[i];
      if (entry.posed) {
        if (quiet.cancelled()) return false;
        // At full density, as the result will take it.
        ASBUILT_TRY(posed, pipeline::posed_scan(entry.record, static_cast<int>(entries.size()),
                                                stored.folder / io::segment_file(i, entry.record.name)));
        scans.push_back(std::move(posed));
      }
      record.scans.push_back(entry.record);
      entries.push_back(&entry);
    }
  }
  if (scans.empty()) {
    own.due = false;
    return false;
  }
  publish_light(own, on_change, [](LiveState& state) {
    state.phase = "refining";
    state.refinement = "running";
  });
  const auto back_to = [&](const char* refinement) {
    publish_light(own, on_change, [&](LiveState& state) {
      state.phase = "waiting";
      state.refinement = refinement;
    });
  };
  auto registration =
      pipeline::register_poses(std::move(scans), own.model, own.options.pipeline, *own.run, record, quiet);
  if (!registration) {
    back_to("due");
    if (registration.error().code == ErrorCode::cancelled || quiet.cancelled()) return false;
    own.due = false;
    return tl::unexpected(registration.error());
  }
  if (quiet.cancelled()) {
    back_to("due");
    return false;
  }
  int dropped = 0;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const bool is_dropped = record.scans[i].status == io::ScanStatus::dropped;
    entries[i]->dropped = is_dropped ? record.scans[i].reason : std::string();
    entries[i]->refined = false;
    dropped += is_dropped ? 1 : 0;
  }
  for (const pipeline::PosedScan& scan : registration->scans) {
    Entry& entry = *entries[static_cast<std::size_t>(scan.index)];
    entry.posed->model_from_local = scan.model_from_local;
    entry.posed->covariance = scan.covariance;
    entry.refined = true;
    entry.weak = weak_directions(scan.covariance, own.model.prepared.box.center(), own.model.prepared.diameter,
                                 scan.noise_sigma_mm);
  }
  own.edge_rms.clear();
  double rms = 0.0;
  for (const io::RefinementRecord& component : *record.refinement) {
    if (component.component == 0) rms = component.rms_after;
    for (const io::EdgeRecord& edge : component.edges) {
      const std::size_t a = static_cast<std::size_t>(std::min(edge.from, edge.to));
      const std::size_t b = static_cast<std::size_t>(std::max(edge.from, edge.to));
      double& worst = own.edge_rms[{record.scans[a].name, record.scans[b].name}];
      worst = std::max(worst, edge.rms);
    }
  }
  for (Entry* entry : entries) own.see(*entry);
  own.rebuild_graph();
  // Both number the scans in canonical order; the joint graph saw all points, the other one a picture's worth.
  if (own.nodes.size() == registration->scans.size()) own.joint = registration->graph;
  own.due = false;
  own.next.phase = "waiting";
  own.next.refinement = "done";
  own.next.refined_scans = static_cast<int>(registration->scans.size());
  own.next.dropped_scans = dropped;
  own.next.refinement_rms_mm = rms;
  publish(own, on_change);
  return true;
}

Result<io::RunRecord> LiveSession::write_result(std::stop_token stop) {
  Implementation& own = *implementation_;
  const fs::path place = own.folder / "result";
  Context stoppable = own.context;
  stoppable.stop = stop;
  const auto write = [&]() -> Result<io::RunRecord> {
    std::vector<std::string> runs;
    for (const auto& [file, stored] : own.store->files()) runs.push_back(stored.folder.string());
    if (runs.empty()) return fail(ErrorCode::not_possible, "there is no scan yet, so there is no result to write");
    ASBUILT_TRY(folder, pipeline::RunFolder::open(place, "register", false, own.context.arena().threads()));
    pipeline::Options nobody_named = own.options.pipeline;  // --exclude and --accept were carried out scan by scan
    nobody_named.exclude.clear();
    nobody_named.accept.clear();
    ASBUILT_TRY(record, pipeline::collect_runs(runs, nobody_named, folder));
    const pipeline::ScanHalf half = own.shared.half(own.model, own.options.pipeline);
    pipeline::look_for_mistaken_unit(record, half, folder, stoppable);
    record.options =
        pipeline::merged(std::move(record.options), pipeline::recorded(own.options.pipeline, {pipeline::Half::joint}));
    ASBUILT_TRY(inspection, pipeline::inspection_inputs(own.options.pipeline));
    ASBUILT_CHECK(pipeline::register_scans(own.model, own.options.pipeline, inspection, folder, record, stoppable));
    ASBUILT_CHECK(folder.finish(record));
    return std::move(record);
  };
  publish_light(own, on_change, [](LiveState& state) {
    state.phase = "writing";
    state.result = "running";
    state.result_text.clear();
  });
  auto record = write();
  publish_light(own, on_change, [&](LiveState& state) {
    state.phase = "waiting";
    state.result = record ? "done" : "failed";
    state.result_folder = record ? place.string() : std::string();
    state.result_text = record ? std::string() : record.error().message;
  });
  return record;
}

std::shared_ptr<const LiveState> LiveSession::state() const {
  const std::lock_guard lock(implementation_->mutex);
  return implementation_->shown;
}

std::shared_ptr<const SurfaceValues> LiveSession::values() const {
  const std::lock_guard lock(implementation_->mutex);
  return implementation_->shown_values;
}

const Surface& LiveSession::surface() const { return implementation_->surface; }

void LiveSession::note(const std::string& level, const std::string& file, const std::string& text) {
  publish_light(*implementation_, on_change, [&](LiveState& state) {
    state.notes.push_back({state.revision + 1, level, file, text});
    if (state.notes.size() > kMostNotes) state.notes.erase(state.notes.begin());
  });
}

void LiveSession::set_phase(const std::string& phase, const std::string& busy_with) {
  publish_light(*implementation_, on_change, [&](LiveState& state) {
    state.phase = phase;
    state.busy_with = busy_with;
  });
}

void LiveSession::set_watch(const std::string& folder) {
  publish_light(*implementation_, on_change, [&](LiveState& state) { state.watch = folder; });
}

}  // namespace asbuilt::live
