// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/cube_rows.h"
#include "asbuilt/inspect/feet.h"
#include "asbuilt/inspect/measurement.h"
#include "asbuilt/model/prepared_model.h"

namespace asbuilt::inspect {

/// What one point says of the surface.
struct Witness {
  static constexpr std::uint16_t kNoScan = 65535;
  Eigen::Vector3f foot = Eigen::Vector3f::Zero(), normal = Eigen::Vector3f::Zero();
  float deviation = 0.0F, sigma = 0.0F;
  std::uint16_t scan = kNoScan, support = 1;
};

struct Near {
  float squared_distance = 0.0F;
  std::uint32_t witness = 0;
};

constexpr float kSameSideCosine = 0.5F;  // foot and place lie on faces turned by less than 60 degrees
constexpr double kOwnRadius = 0.75;      // of the radius that is asked for: neighbouring spots just overlap

double median_of(std::vector<double>& values);

/// Two directions across a normal.
std::array<Eigen::Vector3f, 2> tangents(const Eigen::Vector3f& normal);

/// The points of a cloud that belong to the part, by where they meet the surface, and how they scatter.
struct Witnesses {
  std::vector<Witness> witnesses;  ///< in the order of `cubes`
  std::unique_ptr<CubeRows> cubes;
  double radius = 0.0, spacing = 0.0, noise = 0.0;
  double repetition =
      1.0;  ///< points that share one noise: by so much the variance of a mean exceeds that of free ones

  Witnesses(const Measurement& measurement, const Pose& model_from_cloud, const Feet& all,
            const model::PreparedModel& model, double radius_mm, double max_distance_mm, const Context& context);

  /// Those within `reach` of a place, on faces that are turned alike.
  void gather(const Eigen::Vector3f& position, const Eigen::Vector3f& normal, double reach, std::vector<Near>& near,
              float least_cosine = kSameSideCosine) const;

  /// Sum of squared deviations about the best linear function of the place.
  [[nodiscard]] double squares_about_plane(const Eigen::Vector3f& position, const Eigen::Vector3f& normal,
                                           const std::vector<Near>& near) const;

 private:
  [[nodiscard]] double median_distance(double diameter) const;
  [[nodiscard]] double overall_noise() const;
  [[nodiscard]] double noise_repetition() const;
  [[nodiscard]] Eigen::Vector3d row_of(const Eigen::Vector3f& position, const std::array<Eigen::Vector3f, 2>& across,
                                       const Witness& w) const;
  [[nodiscard]] Eigen::Vector3d plane_through(const Eigen::Vector3f& position, const Eigen::Vector3f& normal,
                                              const std::vector<Near>& near) const;
};

}  // namespace asbuilt::inspect
