// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/result.h"
#include "asbuilt/inspect/feet.h"
#include "asbuilt/inspect/measurement.h"
#include "asbuilt/model/prepared_model.h"

namespace asbuilt::inspect {

/// What the deviations stand on. There is no scale in it, ever.
enum class AlignmentMethod {
  as_given,  ///< the cloud is where it belongs: as refined, or as the user gave it
  best_fit,  ///< one rigid motion, robust, onto the whole model, onto some faces, or about some places
};

struct AlignmentOptions {
  AlignmentMethod method = AlignmentMethod::as_given;
  std::vector<int> faces;               ///< best fit: onto these CAD faces only; empty: all
  std::vector<Eigen::Vector3d> places;  ///< best fit: to the surface about these points of the model only; empty: all
  double place_radius_ratio = 0.02;     ///< how far about them / diameter
};

/// What alignment did.
struct Alignment {
  AlignmentMethod method = AlignmentMethod::as_given;
  Pose model_from_given = Pose::Identity();
  std::string on = "all";                          ///< "all", "faces 3, 5", "4 places"
  std::size_t points = 0;                          ///< that could take part
  double rms_before_mm = 0.0, rms_after_mm = 0.0;  ///< of their deviations up to the 90th percentile
};

/// The rigid motion that brings a cloud onto the CAD. Directions that the chosen surface does not hold stay as they
/// are. `feet` are those of the cloud as given. Errors: invalid_argument (a face that the model has not), not_possible
/// (no point on the chosen surface), cancelled.
[[nodiscard]] Result<Alignment> aligned(const Measurement& measurement, const Feet& feet,
                                        const model::PreparedModel& model, const AlignmentOptions& options,
                                        const Context& context);

}  // namespace asbuilt::inspect
