// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/result.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/refine/refine.h"
#include "asbuilt/simulate/options.h"

namespace asbuilt::bench {

/// Scans of one part whose true poses are known, cut out by their true labels. Lengths in mm.
struct RefinementScene {
  std::string name;
  double noise_sigma_mm = 0.0;
  TriangleMesh model, as_built;
  model::PreparedModel prepared;
  std::vector<refine::View> views;  ///< true segments at their true poses
  std::vector<Pose> truth;          ///< model_from_scan, one a view
  std::vector<std::string> names;   ///< of the scans

  [[nodiscard]] double diameter_mm() const { return prepared.diameter; }
  [[nodiscard]] std::size_t points() const;
};

/// What is read from a folder with truth.json; scans without the part are left out.
[[nodiscard]] Result<RefinementScene> scene_of_folder(const std::filesystem::path& folder, const Context& context);

/// A scene of our own simulator.
[[nodiscard]] Result<RefinementScene> simulated_scene(const std::string& name, const TriangleMesh& cad,
                                                      const simulate::SimulateOptions& options, const Context& context);

/// The views, each moved off its true pose by a turn of exactly `angle_deg` about the middle of the part and a shift of
/// exactly `shift_ratio` diameters, in directions drawn for (seed, view).
[[nodiscard]] std::vector<refine::View> perturbed(const RefinementScene& scene, double angle_deg, double shift_ratio,
                                                  std::uint64_t seed);

/// The edges of the product's pose graph for these views.
[[nodiscard]] Result<std::vector<refine::Link>> product_links(const RefinementScene& scene,
                                                              std::span<const refine::View> views,
                                                              const Context& context);

}  // namespace asbuilt::bench
