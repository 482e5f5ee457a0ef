// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/fuse/recut.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/voxel_grid.h"
#include "asbuilt/fuse/point_grid.h"

namespace asbuilt::fuse {
namespace {

constexpr std::size_t kGrain = 1024;
constexpr double kAroundInSpacings = 2.0;
constexpr int kConfirming = 2, kJoining = 3;      // one alone may fly, too; the scan itself took margin for margin
constexpr double kAgreeInSigmas = 1.5;            // of the difference of two samples
constexpr double kAgreeTilt = 0.03;               // radians by which normals may err
constexpr float kFacingAlike = 0.7F;              // cosine, 45 degrees
constexpr std::size_t kRays = 3;                  // next to the line of sight
constexpr double kNextRay = 1.5, kLastRay = 3.0;  // how near, in spacings: a hole in the scan is no view through
constexpr double kThroughInSigmas = 2.5;
constexpr double kThroughTilt = 0.05;
constexpr double kGrazing = 0.1;  // cosine: a surface seen edge-on says nothing
constexpr double kUnknownNoiseInSpacings = 0.1;

struct Scale {
  double sigma = 0.0, spacing = 0.0;
};

// All rays of a sensor: near in `key` is near across the line of sight.
class Eye {
 public:
  Eye(const SeenSegment& segment, const Scale& scale) : segment_(segment), scale_(scale) {
    if (!segment.viewpoint.known() || segment.cloud_in_scan.size() < kRays) return;
    std::vector<Eigen::Vector3f> keys;
    for (const Eigen::Vector3f& point : segment.cloud_in_scan.positions) keys.push_back(key(point.cast<double>()));
    rays_.emplace(keys);
    spacing_ = median_spacing(keys, *rays_);
  }

  // Whether the sensor measured something behind `point`, in its frame, along the lines of sight next to it.
  [[nodiscard]] bool saw_through(const Eigen::Vector3d& point, double sigma,
                                 std::vector<KdTree::Neighbour>& neighbours) const {
    if (!rays_) return false;
    const double depth = depth_of(point);
    if (is_point() && !(depth > 0.0)) return false;
    rays_->nearest(key(point), kRays, neighbours);
    const auto key_distance = [&](std::size_t i) {
      return std::sqrt(static_cast<double>(neighbours[i].squared_distance));
    };
    if (key_distance(0) > kNextRay * spacing_ || key_distance(kRays - 1) > kLastRay * spacing_) return false;
    const double tolerance = kThroughInSigmas * std::hypot(sigma, scale_.sigma);
    for (std::size_t i = 0; i < kRays; ++i) {
      const std::uint32_t index = neighbours[i].index;
      const Eigen::Vector3d measured = segment_.cloud_in_scan.positions[index].cast<double>();
      const Eigen::Vector3d normal = segment_.cloud_in_scan.normals[index].cast<double>();
      const double across = key_distance(i) * (is_point() ? depth : 1.0);
      const bool behind = depth_of(measured) > depth &&
                          normal.dot(segment_.viewpoint.towards_sensor(measured)) > kGrazing &&
                          normal.dot(point - measured) > tolerance + kThroughTilt * across;
      if (!behind) return false;
    }
    return true;
  }

 private:
  [[nodiscard]] bool is_point() const { return segment_.viewpoint.kind == scan::Viewpoint::Kind::point; }

  [[nodiscard]] double depth_of(const Eigen::Vector3d& point) const {
    const Eigen::Vector3d& viewpoint = segment_.viewpoint.value;
    return is_point() ? (point - viewpoint).norm() : point.dot(viewpoint);
  }

  [[nodiscard]] Eigen::Vector3f key(const Eigen::Vector3d& point) const {
    const Eigen::Vector3d& viewpoint = segment_.viewpoint.value;
    if (is_point()) return (point - viewpoint).normalized().cast<float>();
    return (point - point.dot(viewpoint) * viewpoint).cast<float>();
  }

  const SeenSegment& segment_;
  Scale scale_;
  std::optional<KdTree> rays_;
  double spacing_ = 0.0;  // of the rays: unit vectors of rays from a point, else mm
};

// The part points of all scans, in the model frame.
struct Parts {
  PointCloud cloud;
  std::vector<std::uint32_t> segment_of;
};

Result<void> check(const SeenSegment& segment, std::size_t place) {
  const std::size_t points = segment.cloud_in_scan.size();
  if (segment.is_part.size() == points && segment.cloud_in_scan.normals.size() == points) return {};
  return fail(ErrorCode::invalid_argument,
              fmt::format("segment {} has {} points, {} normals and {} flags", place, points,
                          segment.cloud_in_scan.normals.size(), segment.is_part.size()));
}

Scale scale_of(const SeenSegment& segment) {
  PointCloud part;
  for (std::size_t i = 0; i < segment.is_part.size(); ++i) {
    if (segment.is_part[i] != 0) part.positions.push_back(segment.cloud_in_scan.positions[i]);
  }
  Scale scale{segment.noise_sigma_mm, median_spacing(part.positions)};
  if (!(scale.sigma > 0.0)) scale.sigma = kUnknownNoiseInSpacings * scale.spacing;
  return scale;
}

Parts parts_of(std::span<const SeenSegment> segments) {
  Parts parts;
  for (std::size_t s = 0; s < segments.size(); ++s) {
    const SeenSegment& segment = segments[s];
    const Pose& pose = segment.model_from_scan;
    for (std::size_t i = 0; i < segment.is_part.size(); ++i) {
      if (segment.is_part[i] == 0) continue;
      const PointCloud& cloud = segment.cloud_in_scan;
      parts.cloud.positions.emplace_back((pose * cloud.positions[i].cast<double>()).cast<float>());
      parts.cloud.normals.emplace_back((pose.linear() * cloud.normals[i].cast<double>()).cast<float>());
      parts.segment_of.push_back(static_cast<std::uint32_t>(s));
    }
  }
  return parts;
}

class Recut {
 public:
  Recut(std::span<const SeenSegment> segments, const Context& context)
      : segments_(segments), parts_(parts_of(segments)) {
    std::vector<double> spacings;
    for (const SeenSegment& segment : segments) {
      scales_.push_back(scale_of(segment));
      spacings.push_back(scales_.back().spacing);
    }
    std::ranges::sort(spacings);
    radius_ = spacings.empty() ? 0.0 : kAroundInSpacings * spacings[spacings.size() / 2];
    if (!(radius_ > 0.0) || parts_.cloud.empty()) return;
    grid_.emplace(parts_.cloud.positions, radius_, context);
    eyes_.resize(segments.size());
    parallel_for(context, segments.size(), 1, [&](std::size_t s) { eyes_[s].emplace(segments[s], scales_[s]); });
  }

  [[nodiscard]] std::vector<std::uint8_t> flags(std::size_t segment, const Context& context) const {
    std::vector<std::uint8_t> is_part = segments_[segment].is_part;
    if (!grid_) return is_part;
    parallel_for_blocks(context, is_part.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      if (context.cancelled()) return;
      std::vector<KdTree::Neighbour> neighbours;
      for (std::size_t i = begin; i < end; ++i) {
        const bool was_part = is_part[i] != 0;
        // In doubt are part that nobody confirms and margin that others take for part.
        if (others_agree(segment, i, !was_part) == was_part) continue;
        is_part[i] = seen_through(segment, i, neighbours) ? 0 : 1;
      }
    });
    return is_part;
  }

 private:
  [[nodiscard]] bool others_agree(std::size_t segment, std::size_t point, bool facing_alike) const {
    const SeenSegment& own = segments_[segment];
    const Eigen::Vector3f position =
        (own.model_from_scan * own.cloud_in_scan.positions[point].cast<double>()).cast<float>();
    const Eigen::Vector3f normal =
        (own.model_from_scan.linear() * own.cloud_in_scan.normals[point].cast<double>()).cast<float>();
    const int wanted = facing_alike ? kJoining : kConfirming;
    int agreeing = 0;
    grid_->around_until(position, [&](std::uint32_t j) {
      const std::size_t other = parts_.segment_of[j];
      if (other == segment) return false;
      const Eigen::Vector3f offset = position - parts_.cloud.positions[j];
      const double apart = static_cast<double>(offset.norm());
      if (apart > radius_ || (facing_alike && normal.dot(parts_.cloud.normals[j]) < kFacingAlike)) return false;
      const double tolerance =
          kAgreeInSigmas * std::hypot(scales_[segment].sigma, scales_[other].sigma) + kAgreeTilt * apart;
      agreeing += std::abs(static_cast<double>(parts_.cloud.normals[j].dot(offset))) <= tolerance ? 1 : 0;
      return agreeing == wanted;
    });
    return agreeing == wanted;
  }

  [[nodiscard]] bool seen_through(std::size_t segment, std::size_t point,
                                  std::vector<KdTree::Neighbour>& neighbours) const {
    const SeenSegment& own = segments_[segment];
    const Eigen::Vector3d in_model = own.model_from_scan * own.cloud_in_scan.positions[point].cast<double>();
    for (std::size_t other = 0; other < segments_.size(); ++other) {
      if (other == segment) continue;
      const Eigen::Vector3d in_other = segments_[other].model_from_scan.inverse(Eigen::Isometry) * in_model;
      if (eyes_[other]->saw_through(in_other, scales_[segment].sigma, neighbours)) return true;
    }
    return false;
  }

  std::span<const SeenSegment> segments_;
  Parts parts_;
  std::vector<Scale> scales_;
  std::vector<std::optional<Eye>> eyes_;
  std::optional<PointGrid> grid_;
  double radius_ = 0.0;
};

}  // namespace

Result<std::vector<std::vector<std::uint8_t>>> recut(std::span<const SeenSegment> segments, const Context& context) {
  for (std::size_t s = 0; s < segments.size(); ++s) ASBUILT_CHECK(check(segments[s], s));
  const Recut work(segments, context);
  std::vector<std::vector<std::uint8_t>> flags;
  for (std::size_t s = 0; s < segments.size(); ++s) {
    if (context.cancelled()) break;
    flags.push_back(work.flags(s, context));
  }
  if (context.cancelled()) return fail(ErrorCode::cancelled, "cancelled while the segments were cut anew");
  return flags;
}

}  // namespace asbuilt::fuse
