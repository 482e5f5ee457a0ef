// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/live/surface_coverage.h"
#include "asbuilt/model/prepared_model.h"

namespace asbuilt::live {

/// What a sensor can see from where it stands: a cone and a range.
struct SensorLimits {
  double half_angle_deg = 25.0;  ///< of the cone around the direction in which it looks, (0, 180]
  double near_mm = 0.0, far_mm = 0.0;
  double distance_mm = 0.0;  ///< at which it usually stands from the middle of the part
  std::string source = "assumed";

  bool operator==(const SensorLimits&) const = default;
};

/// Before anything is known: as far from the part as it is long and a half, all of it in view.
[[nodiscard]] SensorLimits assumed_limits(double diameter_mm);

/// What one scan shows of its sensor, `points` in the scan frame, the sensor at `viewpoint`, the middle of the part
/// where it was found. The range is at least what it takes to see the whole part from that distance, whichever way it
/// is turned: nothing says that the nearest surface so far was the nearest that can be measured.
[[nodiscard]] SensorLimits limits_seen(const std::vector<Eigen::Vector3f>& points,
                                       const Eigen::Vector3d& viewpoint_in_scan,
                                       const Eigen::Vector3d& middle_of_part_in_scan, double diameter_mm);
/// Of several scans: the widest cone and range, the median distance. Precondition: at least one.
[[nodiscard]] SensorLimits learnt_limits(const std::vector<SensorLimits>& seen);

/// A place for the sensor, in the model frame.
struct SensorView {
  Eigen::Vector3d position = Eigen::Vector3d::Zero(), target = Eigen::Vector3d::Zero();

  [[nodiscard]] Eigen::Vector3d direction() const { return (target - position).normalized(); }
};

enum class Purpose { first, coverage, join };

struct ViewProposal {
  SensorView view;
  Purpose purpose = Purpose::coverage;
  double gain_share = 0.0;  ///< of the skin, not seen so far, that the view brings (as far as it is seen well enough)
  double overlap = 0.0;     ///< share of what it sees that the first component has seen
  int joins = -1;           ///< component that it joins to the first one
};

/// Looks for the next best view. What each of some hundred positions around the part sees is computed once (Embree, on
/// an even sample of the skin); a question is then a matter of counting.
///
/// Positions stand all around the part, at the usual distance and the nearest that is possible, and look at its
/// middle, or at eight places around it where the part is wider than the field. All of them are taken to be reachable.
class ViewPlanner {
 public:
  ViewPlanner(const Surface& surface, const model::PreparedModel& model, const SensorLimits& limits,
              const Context& context);

  /// The best three, best first, no two from nearly the same direction. `component[v]`: for each component the vertices
  /// that it has seen (as long as the mesh), largest component first; empty before the first scan.
  [[nodiscard]] std::vector<ViewProposal> best_views(const std::vector<std::vector<char>>& seen_by_component) const;

  /// Share of the skin that some position sees well enough, and whether a vertex's neighbourhood is among it.
  [[nodiscard]] double coverable_share() const;
  [[nodiscard]] bool is_coverable(std::uint32_t vertex) const { return coverable_[nearest_sample_[vertex]] != 0; }

  [[nodiscard]] const SensorLimits& limits() const { return limits_; }
  [[nodiscard]] const std::vector<SensorView>& candidates() const { return candidates_; }
  /// Weight in [0, 1] with which candidate c sees sample s.
  [[nodiscard]] float sees(std::size_t candidate, std::size_t sample) const {
    return static_cast<float>(sees_[candidate * samples_.size() + sample]) / 255.0F;
  }
  [[nodiscard]] const std::vector<std::uint32_t>& samples() const { return samples_; }

 private:
  SensorLimits limits_;
  std::vector<SensorView> candidates_;
  /// Of the surface that each sample stands for, the share that was seen.
  [[nodiscard]] std::vector<double> seen_shares(const std::vector<char>& seen) const;

  std::vector<std::uint32_t> samples_;         // vertices
  std::vector<double> sample_area_;            // shares of the skin that each stands for
  std::vector<std::uint32_t> nearest_sample_;  // of each vertex
  std::vector<double> vertex_area_;            // shares of the skin
  std::vector<std::uint8_t> sees_;             // candidates x samples
  std::vector<char> coverable_;                // by sample
};

/// How well a surface is seen at an angle of incidence: 1 up to 60 degrees, falling to 0 at 75.
[[nodiscard]] double seen_weight(double cos_incidence);

}  // namespace asbuilt::live
