// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "asbuilt/core/pose.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/live/next_view.h"
#include "asbuilt/live/surface_coverage.h"

/// What a session knows at one moment: the content of GET /state (docs/live-protocol.md, which explains every field).
/// Lengths in mm, model frame, shares in [0, 1].
namespace asbuilt::live {

struct WeakDirection {
  bool is_rotation = false;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  double sigma_mm = 0.0;
  bool unheld = false;
  std::string text;
};

struct ScanState {
  io::ScanRecord record;  ///< poses as they stand now; candidates left out
  std::string file;       ///< name within the watched folder
  int arrival = 0;
  bool provisional = false, refined = false;
  double new_share = 0.0, covered_share = 0.0;
  std::optional<int> piece;
  std::optional<Eigen::Vector3d> viewpoint_in_model, view_direction_in_model;
  std::vector<WeakDirection> weak_directions;
  std::string sentence;
  double seconds = 0.0;

  [[nodiscard]] bool in_use() const { return piece.has_value(); }
};

struct LinkState {
  int a = 0, b = 0;  ///< indices into LiveState::scans
  double overlap = 0.0;
  bool used = false;
  std::string firmness;
  std::optional<double> rms_mm;
};

struct JoinState {
  std::string text;
  double best_overlap = 0.0;
  int a = -1, b = -1, view = -1;
};

struct PieceState {
  std::vector<int> scans;
  double share = 0.0;
  std::optional<JoinState> join;
};

struct HoleState {
  Hole hole;  ///< without its vertices
  bool reachable = true;
  std::string text;
};

struct ViewState {
  ViewProposal proposal;
  double gain_area_mm2 = 0.0;
  std::string text;
};

struct Note {
  std::uint64_t revision = 0;
  std::string level, file, text;
};

/// Something that keeps the session from its work until it is over.
struct Trouble {
  std::string headline;  ///< what it is, in a few words
  std::string detail;    ///< why, and what will happen
};

struct LiveState {
  std::uint64_t revision = 0, surface_revision = 0;
  std::string phase = "preparing";
  std::string busy_with;  ///< empty: nothing
  std::string now_level = "act", now_headline, now_text, now_sound;
  io::ModelRecord model;
  Eigen::AlignedBox3d box;
  int faces = 0;
  std::string watch, output;
  double covered_share = 0.0, twice_share = 0.0, total_area_mm2 = 0.0;
  std::optional<double> coverable_share;
  std::vector<ScanState> scans;
  int newest = -1;  ///< the scan that came last, unless it is gone
  std::vector<LinkState> links;
  std::vector<PieceState> pieces;
  std::vector<HoleState> holes;
  std::vector<ViewState> views;
  SensorLimits sensor;
  std::string refinement = "none";
  int refined_scans = 0, dropped_scans = 0;
  std::optional<double> refinement_rms_mm;
  std::map<std::string, Trouble> troubles;  ///< by what is in trouble
  std::vector<Note> notes;
  std::vector<std::string> removed;
  std::vector<std::pair<std::string, std::string>> duplicates;  ///< file, of which
  std::string result = "none", result_folder, result_text;
};

/// Per-vertex values of the surface (GET /surface/values).
struct SurfaceValues {
  std::uint64_t revision = 0;
  std::vector<std::uint16_t> support, newest;
  std::vector<float> deviation_mm;
};

/// The JSON of the protocol, one line without a break. Numbers that are not finite become null.
[[nodiscard]] std::string to_json(const LiveState& state);
[[nodiscard]] std::string to_json(const Surface& surface);
[[nodiscard]] std::string to_json(const SurfaceValues& values);

}  // namespace asbuilt::live
