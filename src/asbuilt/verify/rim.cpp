// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/rim.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace asbuilt::verify {
namespace {

constexpr int kDirections = 8;          // around a sample
constexpr double kAway = 0.6;           // of the way: a surface that far off does not go on there
constexpr double kLeaving = 0.25;       // likewise: one that far off bends away, and is followed a little further
constexpr int kFarthest = 3;            // reaches that the way past a rounded edge may take
constexpr double kLateral = 0.45;       // of the reach: where a measurement must lie to say that it does
constexpr float kSameDirection = 0.9F;  // cosine between the normals of one surface

// A point of the scan on the plane through `place` across `normal`, no farther along it than `lateral_mm`.
bool has_plane(const Eigen::Vector3d& place, const Eigen::Vector3d& normal, double lateral_mm, double across_mm,
               const ScanEvidence& scan) {
  const KdTree::Neighbour nearest = scan.foreground_tree.nearest(place.cast<float>(), static_cast<float>(lateral_mm));
  if (!nearest.found()) return false;
  const Eigen::Vector3d offset = scan.foreground.cloud.positions[nearest.index].cast<double>() - place;
  if (std::abs(offset.dot(normal)) > across_mm) return false;
  const float cosine = normal.cast<float>().dot(scan.foreground.cloud.normals[nearest.index]);
  return (scan.scan.normals_oriented ? cosine : std::abs(cosine)) >= kSameDirection;
}

}  // namespace

std::vector<RimProbe> rim_probes(const model::PreparedModel& model, double reach_mm, std::size_t most_samples) {
  std::vector<RimProbe> probes;
  const std::size_t count = std::min(most_samples, model.dense_samples.size());
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3f& point = model.dense_samples.positions[i];
    const Eigen::Vector3f& normal = model.dense_samples.normals[i];
    const Eigen::Vector3f u = normal.unitOrthogonal(), v = normal.cross(u);
    for (int k = 0; k < kDirections; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / kDirections;
      const Eigen::Vector3f along = static_cast<float>(std::cos(angle)) * u + static_cast<float>(std::sin(angle)) * v;
      for (int reaches = 1; reaches <= kFarthest; ++reaches) {
        const double way_mm = reaches * reach_mm;
        const Eigen::Vector3f beyond = point + static_cast<float>(way_mm) * along;
        const auto there = static_cast<double>(model.field->distance_at(beyond));
        if (there >= kAway * way_mm) {  // unknown is infinitely far
          probes.push_back({point, normal, beyond, model.is_open()});
          break;
        }
        if (!(there >= kLeaving * way_mm)) break;
      }
    }
  }
  return probes;
}

RimEvidence rim_evidence(const Pose& model_from_scan, std::span<const RimProbe> probes, double reach_mm,
                         const ScanEvidence& scan, const EvidenceOptions& options) {
  const Pose scan_from_model = model_from_scan.inverse();
  const double lateral = std::min(options.lateral_mm, kLateral * reach_mm);
  RimEvidence evidence;
  for (const RimProbe& probe : probes) {
    Eigen::Vector3d normal = scan_from_model.linear() * probe.normal.cast<double>();
    const Eigen::Vector3d on_face = scan_from_model * probe.on_face.cast<double>();
    const Eigen::Vector3d beyond = scan_from_model * probe.beyond.cast<double>();
    const scan::Viewpoint& viewpoint = scan.scan.viewpoint;
    if (viewpoint.known()) {
      const Eigen::Vector3d towards = viewpoint.towards_sensor(beyond);
      if (probe.two_sided && normal.dot(towards) < 0.0) normal = -normal;
      if (normal.dot(towards) < kGrazing) continue;
    }
    if (!has_plane(on_face, normal, lateral, options.distance_mm, scan)) continue;
    const bool goes_on = has_plane(beyond, normal, lateral, options.distance_mm, scan);
    if (!goes_on && scan.depth &&
        (scan.depth->evidence(beyond, options.distance_mm) == scan::DepthImage::Evidence::hidden ||
         scan.field->is_outside(beyond))) {
      continue;
    }
    ++evidence.asked;
    evidence.overrun += goes_on ? 1 : 0;
  }
  return evidence;
}

}  // namespace asbuilt::verify
