// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "asbuilt/core/voxel_grid.h"
#include "asbuilt/live/session_implementation.h"
#include "asbuilt/live/words.h"

namespace asbuilt::live {

void LiveSession::Implementation::thin(pipeline::PosedScan& posed) const {
  const auto chosen = even_subset(posed.part.positions, std::max(0.25 * surface.edge_mm, posed.spacing_mm), context);
  PointCloud part;
  for (const std::uint32_t i : chosen) {
    part.positions.push_back(posed.part.positions[i]);
    part.normals.push_back(posed.part.normals[i]);
  }
  posed.part = std::move(part);
}

std::optional<pipeline::PosedScan> LiveSession::Implementation::posed(const io::ScanRecord& record,
                                                                      const std::filesystem::path& segment) const {
  if (record.status != io::ScanStatus::accepted || !record.model_from_scan) return std::nullopt;
  auto loaded = pipeline::posed_scan(record, 0, segment);
  if (!loaded || loaded->part.empty()) return std::nullopt;
  loaded->model_from_local = loaded->model_from_local_start;
  thin(*loaded);
  return std::move(*loaded);
}

void LiveSession::Implementation::see(Entry& entry) const {
  entry.seen.clear();
  if (!entry.in_use()) return;
  entry.seen = seen_from(entry.posed->part, entry.posed->model_from_local, entry.posed->spacing_mm, surface,
                         model.prepared, context);
}

void LiveSession::Implementation::insert_node(Entry& entry) {
  if (!entry.in_use()) return;
  joint.reset();
  const auto node = builder->insert({entry.posed->part, entry.posed->model_from_local}, context);
  if (node) nodes.push_back(&entry);
}

void LiveSession::Implementation::rebuild_graph() {
  joint.reset();
  builder = *graph::PoseGraphBuilder::create(model.prepared, options.pipeline.graph);  // validated in open
  nodes.clear();
  for (auto& [file, group] : files) {
    for (Entry& entry : group.entries) insert_node(entry);
  }
}

graph::PoseGraph LiveSession::Implementation::graph() const {
  if (joint) return *joint;
  return nodes.empty() ? graph::PoseGraph() : builder->graph();
}

void LiveSession::Implementation::fit_to_neighbours(Entry& entry) const {
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

void LiveSession::Implementation::show(const std::string& file, FileEntries group) {
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
    entry.new_share = area_share(surface, [&](std::size_t v) { return !std::isnan(entry.seen[v]) && !seen_before[v]; });
    for (std::size_t v = 0; v < seen_before.size(); ++v) {
      if (!std::isnan(entry.seen[v])) seen_before[v] = 1;
    }
  }
  latest = file;
  due = true;
}

void LiveSession::Implementation::rebuild_graph_without(const std::string& file) {
  auto kept = files.extract(file);
  rebuild_graph();
  files.insert(std::move(kept));
}

std::vector<char> LiveSession::Implementation::seen_by_any(const std::string& but) const {
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

void LiveSession::Implementation::erase(const std::string& file) {
  files.erase(file);
  if (latest == file) latest.clear();
  edge_rms.clear();
  due = true;
  rebuild_graph();
}

}  // namespace asbuilt::live
