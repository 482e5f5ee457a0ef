// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "asbuilt/core/result.h"
#include "asbuilt/detect/options.h"
#include "asbuilt/fuse/fuse.h"
#include "asbuilt/fuse/mesh.h"
#include "asbuilt/graph/pose_graph.h"
#include "asbuilt/inspect/deviation.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/io/read_options.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/io/unit.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/refine/refine.h"
#include "asbuilt/scan/scan.h"
#include "asbuilt/verify/verify.h"

namespace asbuilt::pipeline {

/// Where the whole finally stands in the model frame.
enum class Gauge { best_fit, fixed };

/// Which placements of the part in one scan are wanted. `one`: a second one makes the scan ambiguous. `all`: each is a
/// detection of its own; they are then taken to be the same casting, or as good as.
enum class Instances { one, all };

/// What deviations are measured from: the refined (or given) frame, or a best fit of the cloud to the CAD.
enum class Alignment { as_refined, best_fit };

/// Everything a user can choose; the stages' own options and what lies between them.
struct Options {
  io::Unit model_unit = io::Unit::stated, scan_unit = io::Unit::stated;
  std::vector<std::string> scan_units;   ///< SCAN:UNIT, where a scan's unit is not `scan_unit`
  double tessellation_tolerance = 1e-4;  ///< of STEP, IGES and BREP models: triangles to surface / diameter
  std::string columns;                   ///< of text scans, "x,y,z,nx,ny,nz,-,r,g,b,i"; empty: read or guessed
  std::string camera;                    ///< of depth images, "fx,fy,cx,cy" or a file; empty: a file beside them
  std::string viewpoint = "auto";        ///< auto, none, x,y,z, dir:dx,dy,dz or a CSV file with one per scan
  std::string poses;                     ///< file with starts for detection; empty: none
  std::vector<std::string> exclude;      ///< scans, by name or path
  std::vector<std::string> accept;       ///< SCAN:CANDIDATE, candidates counted from 0 as in result.json
  Instances instances = Instances::one;
  std::uint64_t seed = 0;
  double memory_gb = 0.0;   ///< what a scan may take; beyond it, it is thinned first; 0: half of the machine's
  bool paper_mode = false;  ///< exactly the published method, in every stage
  bool mesh = false;        ///< a surface mesh beside the cloud
  bool watertight = false;  ///< a mesh without holes, filled from the CAD
  Gauge gauge = Gauge::best_fit;
  std::string tolerance_file;  ///< one tolerance per CAD face or box (docs/inspect.md); empty: none
  std::string reference;       ///< file of check points; empty: none
  Alignment alignment = Alignment::as_refined;
  std::string align_on = "all";  ///< best fit: all, faces:N,N,... or a file of points on the model
  bool views = false;            ///< pictures beside the report
  bool colour_steps = false;     ///< pictures in discrete colours

  model::ModelOptions model;
  scan::ScanOptions scan;
  detect::DetectOptions detect;
  verify::VerifyOptions verify;
  graph::PoseGraphOptions graph;
  refine::RefineOptions refine;
  fuse::FuseOptions fuse;
  fuse::MeshOptions surface_mesh;
  inspect::InspectOptions inspect;

  [[nodiscard]] Result<void> validate() const;  ///< of every stage, and of what is typed as text
};

/// The half of the method that an option belongs to: `prepare` takes the first, `detect` the first two, `register` the
/// last, `reconstruct` all.
enum class Half { model, scan, joint };

/// Calls field(half, name, value, help) for the options of all stages. Names of the joint half carry their stage, since
/// several stages have the same word for their own thing.
template <class Visitor>
void for_each_stage_field(Options& options, Visitor&& field) {
  const auto of = [&field](Half half, std::string prefix) {
    return [&field, half, prefix](std::string_view name, auto& value, std::string_view help) {
      field(half, prefix + std::string(name), value, help);
    };
  };
  for_each_field(options.model, of(Half::model, ""));
  for_each_field(options.scan, of(Half::scan, ""));
  for_each_field(options.detect, of(Half::scan, ""));
  for_each_field(options.verify, of(Half::scan, ""));
  for_each_field(options.graph, of(Half::joint, "graph_"));
  for_each_field(options.refine, of(Half::joint, "refine_"));
  for_each_field(options.fuse, of(Half::joint, "fuse_"));
  for_each_field(options.surface_mesh, of(Half::joint, "mesh_"));
  for_each_field(options.inspect, of(Half::joint, "inspect_"));
}

/// How the scans of a file and models are read.
[[nodiscard]] io::ReadOptions scan_reading(const Options& options, const std::string& path, const Context& context);
[[nodiscard]] io::ModelReadOptions model_reading(const Options& options);

/// The options with paper mode handed down to every stage.
[[nodiscard]] Options with_paper_mode_applied(const Options& options);

/// The options of these halves as result.json lists them. Nothing that may differ without changing the result (threads,
/// output folder) is among them.
[[nodiscard]] io::Options recorded(const Options& options, std::initializer_list<Half> halves);

/// The same for `inspect` alone.
[[nodiscard]] io::Options recorded_inspection(const Options& options);

/// Takes over what `recorded` wrote. Errors: invalid_argument for a value of the wrong kind.
[[nodiscard]] Result<void> take_over(Options& options, const io::Options& record);

/// Values of `later` replace those of the same name; others are appended.
[[nodiscard]] io::Options merged(io::Options earlier, const io::Options& later);

/// "SCAN:CANDIDATE" of --accept.
struct Acceptance {
  std::string scan;
  int candidate = 0;
};
[[nodiscard]] Result<Acceptance> parse_acceptance(std::string_view text);

/// "SCAN:UNIT" of --scan-unit.
struct UnitOfScan {
  std::string scan;
  io::Unit unit = io::Unit::millimetre;
};
[[nodiscard]] Result<UnitOfScan> parse_unit_of_scan(std::string_view text);

}  // namespace asbuilt::pipeline
