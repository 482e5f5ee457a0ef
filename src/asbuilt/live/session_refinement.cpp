// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "asbuilt/live/session_implementation.h"
#include "asbuilt/live/words.h"

namespace asbuilt::live {

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
  own.publish_light(on_change, [](LiveState& state) {
    state.phase = "refining";
    state.refinement = "running";
  });
  const auto back_to = [&](const char* refinement) {
    own.publish_light(on_change, [&](LiveState& state) {
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
  own.publish(on_change);
  return true;
}

}  // namespace asbuilt::live
