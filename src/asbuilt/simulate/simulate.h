// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/result.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/simulate/options.h"

namespace asbuilt::simulate {

/// What the label of a point says. Values between kFirstThing and kLastThing number the other things of the scan,
/// first of all further placements of the part.
struct Label {
  static constexpr std::uint8_t kSurroundings = 0, kPart = 1, kFirstThing = 2, kLastThing = 254, kFlying = 255;
};

/// A further placement of the part in a scan; the same body as the first.
struct OtherPlacement {
  Pose model_from_scan = Pose::Identity();
  std::uint8_t label = Label::kFirstThing;  ///< of its points
  double occlusion = 1.0, hidden = 1.0;     ///< as those of the first
};

/// One scan and the truth about it.
struct SimulatedScan {
  std::string name;                             ///< "scan_00" ...
  std::vector<Eigen::Vector3f> points_in_scan;  ///< the sensor is the origin
  std::vector<std::uint8_t> labels;             ///< one a point
  std::optional<Pose> model_from_scan;          ///< takes points of the part onto the as-built mesh; empty: no part
  std::vector<OtherPlacement> other_placements;
  double occlusion = 1.0;  ///< 1 - visible area of the part / area of the part
  double hidden = 1.0;     ///< share of what an unobstructed view shows that is covered
  double clutter = 1.0;    ///< 1 - visible area of the part / area of the scene
};

struct Simulation {
  TriangleMesh model;     ///< the CAD as given
  TriangleMesh as_built;  ///< the true part, in the model frame
  double noise_sigma_mm = 0.0;
  double deviation_rms_mm = 0.0, deviation_max_mm = 0.0;  ///< as-built against CAD
  std::vector<SimulatedScan> scans;
};

/// The noise model that the options mean for a part of this diameter.
[[nodiscard]] NoiseModel noise_model(const SimulateOptions& options, double diameter_mm);

/// Simulates scans of a part in scenes that are new for each scan. The same for a seed, whatever the thread count.
/// `companions` are meshes that stand in every scan in addition to the random things, as far as there is room (a part
/// of the same family, say); in a scan without the part, the first of them takes its place. Source: Sec. 4 (data),
/// occlusion and clutter as defined there. Cost: about a second for a scan of 100 000 points. Errors: invalid_argument
/// from validate(); not_possible for a model without area; cancelled.
[[nodiscard]] Result<Simulation> simulate(const TriangleMesh& cad, const SimulateOptions& options,
                                          const Context& context, std::span<const TriangleMesh> companions = {});

/// Writes scan_NN.ply and scan_NN.labels, model.ply, as_built.ply and at last truth.json into a folder, which is made
/// if need be; each file whole or not at all. Errors: unwritable_output.
[[nodiscard]] Result<void> write_simulation(const std::filesystem::path& folder, const Simulation& simulation);

/// A scan as write_simulation() writes it: a binary PLY of x, y and z, mm in the scan frame. Errors: unwritable_output.
[[nodiscard]] Result<void> write_points(const std::filesystem::path& path, const std::vector<Eigen::Vector3f>& points);

}  // namespace asbuilt::simulate
