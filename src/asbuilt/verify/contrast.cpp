// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/contrast.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "asbuilt/verify/sensor_in_model.h"

namespace asbuilt::verify {
namespace {

constexpr double kClearlyNearer = 0.5;  // of the distance that counts as on the model

class Contrast {
 public:
  Contrast(const model::PreparedModel& model, const ScanEvidence& scan, double spacing_mm,
           const EvidenceOptions& options)
      : model_(model), scan_(scan), options_(options) {
    // Of samples much denser than the measurements a part is as telling as all of them: they are in an order in which
    // any first few are spread out.
    constexpr double kSamplesPerMeasurement = 3.0;
    constexpr std::size_t kFewest = 5000;
    const std::size_t all = model.dense_samples.size();
    weight_ = measurements_per_sample(model, spacing_mm);
    asked_ = std::clamp(static_cast<std::size_t>(kSamplesPerMeasurement * weight_ * static_cast<double>(all)),
                        std::min(kFewest, all), all);
    asked_ = std::min(asked_, options.most_samples);
    weight_ = std::min(1.0, weight_ * static_cast<double>(all) / static_cast<double>(asked_));
  }

  // Asks the scan about the samples that `own` puts where `other` has nothing.
  void add(const SizedPose& own, const SizedPose& other, double& for_own, double& for_other) const {
    const Eigen::Affine3d scan_from_own = own.scan_from_model();
    const Pose directions = own.model_from_scan.inverse();
    const Eigen::Affine3f other_from_own = (other.scan_from_model().inverse() * scan_from_own).cast<float>();
    const PointCloud& samples = model_.dense_samples;
    scan::Viewpoint viewpoint = scan_.scan.viewpoint;
    if (viewpoint.kind == scan::Viewpoint::Kind::point) viewpoint.value = directions * own.in_model(viewpoint.value);
    const SensorInModel sensor(viewpoint, own.model_from_scan);
    for (std::size_t i = 0; i < asked_; ++i) {
      if (is_ruled_out(sensor, samples.positions[i], samples.normals[i])) continue;
      const double apart = other.size * distance_at(other_from_own * samples.positions[i]);
      if (apart <= kClearlyNearer * options_.distance_mm) continue;  // both predict it
      const Eigen::Vector3d point = scan_from_own * samples.positions[i].cast<double>();
      const auto cosine = cosine_to_sensor(directions, point, samples.positions[i], samples.normals[i]);
      if (!cosine) continue;
      const double verdict = verdict_on(point, *cosine, own, other);
      (verdict > 0.0 ? for_own : for_other) += std::abs(verdict) * weight_;
    }
  }

 private:
  // Most of what cosine_if_seen() would rule out, before the distance field is asked.
  [[nodiscard]] bool is_ruled_out(const SensorInModel& sensor, const Eigen::Vector3f& point,
                                  const Eigen::Vector3f& normal) const {
    constexpr auto kLeast = 0.99F * static_cast<float>(kGrazing);  // less, for rounding
    if (!sensor.known() || sensor.is_turned(point, normal, kLeast)) return false;
    return !(model_.is_open() && sensor.is_turned(point, -normal, kLeast));
  }

  [[nodiscard]] double distance_at(const Eigen::Vector3f& point_in_model) const {
    return std::abs(static_cast<double>(model_.field->distance_at(point_in_model)));
  }
  [[nodiscard]] double distance_at(const SizedPose& placement, const Eigen::Vector3f& point_in_scan) const {
    return placement.size * distance_at(placement.in_model(point_in_scan.cast<double>()).cast<float>().eval());
  }

  // Without a viewpoint every sample may be visible.
  [[nodiscard]] std::optional<double> cosine_to_sensor(const Pose& scan_from_model,
                                                       const Eigen::Vector3d& point_in_scan,
                                                       const Eigen::Vector3f& point,
                                                       const Eigen::Vector3f& normal) const {
    const scan::Viewpoint& viewpoint = scan_.scan.viewpoint;
    if (!viewpoint.known()) return 1.0;
    return cosine_if_seen(scan_from_model, point, normal, viewpoint.towards_sensor(point_in_scan), model_);
  }

  // 1 for the pose that puts a sample here, -1 for the other, 0 if the scan does not tell.
  [[nodiscard]] double verdict_on(const Eigen::Vector3d& point_in_scan, double cosine, const SizedPose& own_place,
                                  const SizedPose& other_place) const {
    const double reach = std::hypot(options_.distance_mm, lateral_at(options_, cosine));
    const KdTree::Neighbour nearest =
        scan_.foreground_tree.nearest(point_in_scan.cast<float>(), static_cast<float>(reach));
    if (nearest.found()) {
      const Eigen::Vector3f& measured = scan_.foreground.cloud.positions[nearest.index];
      const double own = distance_at(own_place, measured), other = distance_at(other_place, measured);
      if (std::min(own, other) > options_.distance_mm) return 0.0;  // something else, or a deviation
      const double lead = other - own;
      return std::abs(lead) < kClearlyNearer * options_.distance_mm ? 0.0 : std::copysign(1.0, lead);
    }
    if (!scan_.depth) return 0.0;
    using Evidence = scan::DepthImage::Evidence;
    const double tolerance = (options_.distance_mm + options_.lateral_mm) / cosine;
    const Evidence seen = scan_.depth->evidence(point_in_scan, tolerance);
    return seen == Evidence::free || seen == Evidence::near ? -1.0 : 0.0;
  }

  const model::PreparedModel& model_;
  const ScanEvidence& scan_;
  const EvidenceOptions& options_;
  double weight_ = 1.0;  // of a sample, in measurements
  std::size_t asked_ = 0;
};

}  // namespace

double measurements_per_sample(const model::PreparedModel& model, double spacing_mm) {
  const double square_mm2 = spacing_mm * spacing_mm;
  return square_mm2 > 0.0 ? std::min(1.0, model.dense_sample_area_mm2 / square_mm2) : 1.0;
}

PoseContrast contrast(const SizedPose& first, const SizedPose& second, const model::PreparedModel& model,
                      const ScanEvidence& scan, const EvidenceOptions& options) {
  const double spacing_mm = 0.5 * (spacing_at(first.model_from_scan, model, scan.scan) +
                                   spacing_at(second.model_from_scan, model, scan.scan));
  const Contrast asked(model, scan, spacing_mm, options);
  PoseContrast result;
  asked.add(first, second, result.for_first, result.for_second);
  asked.add(second, first, result.for_second, result.for_first);
  return result;
}

}  // namespace asbuilt::verify
