// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "asbuilt/graph/pose_graph.h"
#include "asbuilt/live/scan_store.h"
#include "asbuilt/live/session.h"
#include "asbuilt/pipeline/joint_half.h"
#include "asbuilt/pipeline/run_folder.h"
#include "asbuilt/pipeline/scan_half.h"

/// The rooms of a LiveSession, for its own sources only:
///   session.cpp            opening, going on after an interruption, files that go
///   session_scan.cpp       a file that comes: judged alone, stored, its sensor learnt
///   session_graph.cpp      the scan among the others: seen surface, links, a quick fit
///   session_refinement.cpp all scans jointly, when idle
///   session_state.cpp      what is shown and advised
///   session_result.cpp     what is finally written
/// What lies on disk is scan_store's, proposals are next_view's, sentences are words'.
namespace asbuilt::live {

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

/// The scans of a file.
struct FileEntries {
  std::vector<Entry> entries;
  std::optional<SensorLimits> limits;
  bool provisional = false;
  double seconds = 0.0;
};

using OnChange = std::function<void(const std::shared_ptr<const LiveState>&)>;

struct LiveSession::Implementation {
  Implementation(LiveOptions chosen, std::filesystem::path where, const Context& with)
      : options(std::move(chosen)), folder(std::move(where)), context(with) {}

  LiveOptions options;
  std::filesystem::path folder;
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

  // session_scan.cpp

  /// What is shown of a scan that has been found and is still being cut out of all its points.
  [[nodiscard]] std::vector<Entry> early_entries(const pipeline::InputFile& input, const io::ScanFile& scan,
                                                 std::span<const pipeline::JudgedScan> judged) const;
  /// A file is gone or has another content: what was a copy of it counts now.
  [[nodiscard]] Result<void> add_former_copy_of(const std::string& file, LiveSession& session);
  /// New proposals, if the scans tell another sensor than the one reckoned with.
  void learn_sensor();

  // session_graph.cpp

  /// Pictures need fewer points than results.
  void thin(pipeline::PosedScan& posed) const;
  [[nodiscard]] std::optional<pipeline::PosedScan> posed(const io::ScanRecord& record,
                                                         const std::filesystem::path& segment) const;
  /// Takes the scans of a file in, in place of those it had.
  void show(const std::string& file, FileEntries group);
  /// Forgets a file and its scans.
  void erase(const std::string& file);
  /// What the scan sees of the surface, from where it stands now.
  void see(Entry& entry) const;
  void rebuild_graph();
  [[nodiscard]] graph::PoseGraph graph() const;

  // session_state.cpp

  /// Publishes everything anew.
  void publish(const OnChange& on_change, const std::string& sound = {});
  /// Publishes a state that says the same of the scans, after a change of phase, note or the like.
  void publish_light(const OnChange& on_change, const std::function<void(LiveState&)>& change);

 private:
  void insert_node(Entry& entry);
  /// Fits a scan that has just come to those it is linked to, which stay where they are.
  void fit_to_neighbours(Entry& entry) const;
  void rebuild_graph_without(const std::string& file);
  [[nodiscard]] std::vector<char> seen_by_any(const std::string& but) const;
  [[nodiscard]] ScanState scan_state(const std::string& file, const FileEntries& group, const Entry& entry) const;
  void describe_graph(LiveState& state, const std::map<const Entry*, int>& index) const;
  void describe_joins(LiveState& state) const;
  [[nodiscard]] SurfaceValues values_of(const std::vector<const Entry*>& entries) const;
  void describe_surface(LiveState& state, const SurfaceValues& values, const std::vector<const Entry*>& entries) const;
  /// Everything that is shown, from the scans as they are.
  [[nodiscard]] std::pair<LiveState, SurfaceValues> composed() const;
};

}  // namespace asbuilt::live
