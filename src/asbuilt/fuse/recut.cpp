// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/fuse/recut.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/median.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/voxel_grid.h"
#include "asbuilt/fuse/point_grid.h"
#include "asbuilt/fuse/surface_normals.h"
#include "asbuilt/scan/face_support.h"

namespace asbuilt::fuse {
namespace {

constexpr std::size_t kGrain = 1024;
constexpr double kAroundInSpacings = 2.0;
constexpr double kContradicted = 1.0 / 3.0;       // less of the points of others that have a say agree
constexpr double kDoubtful = 0.5;                 // no more than that agree
constexpr int kJoining = 3;                       // one alone may fly, too; the scan itself took margin for margin
constexpr double kAgreeInSigmas = 1.5;            // of the difference of two samples
constexpr double kAgreeTilt = 0.03;               // radians by which normals may err
constexpr float kFacingAlike = 0.7F;              // cosine, 45 degrees
constexpr std::size_t kRays = 3;                  // next to the line of sight
constexpr double kCovering = 1.5;                 // spacings: what flies hangs up to one off the surface
constexpr double kNextRay = 1.5, kLastRay = 3.0;  // how near, in spacings: a hole in the scan is no view through
constexpr double kThroughInSigmas = 2.5;
constexpr double kThroughTilt = 0.05;
constexpr double kGrazing = 0.1;  // cosine: a surface seen edge-on says nothing
constexpr double kUnknownNoiseInSpacings = 0.1;
constexpr std::size_t kFewestDifferences = 50;  // between samples of two scans, to tell the noise by

struct Scale {
  double sigma = 0.0, spacing = 0.0;
};

// Whether a height over the plane of a point that far away is explained by the noise of both.
bool in_plane(double height, double apart, double noise) {
  return std::abs(height) <= kAgreeInSigmas * noise + kAgreeTilt * apart;
}

// What a sensor measured next to the line of sight to a point.
struct Sight {
  bool through = false;  // all rays next to it passed the point and met something behind it
  bool passed = false;   // the nearest one did
  bool met = false;      // the nearest one met the part there
};

// All rays of a sensor: near in `key` is near across the line of sight. `faces`: the normal of the face of each point.
class Eye {
 public:
  Eye(const SeenSegment& segment, std::span<const Eigen::Vector3f> faces, const Scale& scale)
      : segment_(segment), faces_(faces), scale_(scale) {
    if (!segment.viewpoint.known() || segment.cloud_in_scan.size() < kRays) return;
    std::vector<Eigen::Vector3f> keys;
    for (const Eigen::Vector3f& point : segment.cloud_in_scan.positions) keys.push_back(key(point.cast<double>()));
    rays_.emplace(keys);
    spacing_ = median_spacing(keys, *rays_);
  }

  // At `point`, in its frame; a ray that meets the part within `near_mm` of it has met the part there.
  [[nodiscard]] Sight sight_of(const Eigen::Vector3d& point, double sigma, double near_mm,
                               std::vector<KdTree::Neighbour>& neighbours) const {
    Sight sight;
    if (!rays_) return sight;
    const double depth = depth_of(point);
    if (is_point() && !(depth > 0.0)) return sight;
    rays_->nearest(key(point), kRays, neighbours);
    const auto key_distance = [&](std::size_t i) {
      return std::sqrt(static_cast<double>(neighbours[i].squared_distance));
    };
    if (key_distance(0) > kNextRay * spacing_) return sight;
    const double noise = std::hypot(sigma, scale_.sigma);
    sight.through = key_distance(kRays - 1) <= kLastRay * spacing_;
    for (std::size_t i = 0; i < kRays && (i == 0 || sight.through); ++i) {
      const std::uint32_t index = neighbours[i].index;
      const Eigen::Vector3d measured = segment_.cloud_in_scan.positions[index].cast<double>();
      const Eigen::Vector3d normal = faces_[index].cast<double>();
      const double across = key_distance(i) * (is_point() ? depth : 1.0);
      const double height = normal.dot(point - measured);
      const bool behind = depth_of(measured) > depth &&
                          normal.dot(segment_.viewpoint.towards_sensor(measured)) > kGrazing &&
                          height > kThroughInSigmas * noise + kThroughTilt * across;
      sight.through = sight.through && behind;
      if (i > 0) continue;
      const double apart = (point - measured).norm();
      sight.passed = behind;
      sight.met = segment_.is_part[index] != 0 && apart <= near_mm && in_plane(height, apart, noise);
    }
    return sight;
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
  std::span<const Eigen::Vector3f> faces_;
  Scale scale_;
  std::optional<KdTree> rays_;
  double spacing_ = 0.0;  // of the rays: unit vectors of rays from a point, else mm
};

// The part points of all scans, in the model frame.
struct Parts {
  PointCloud cloud;
  std::vector<std::uint32_t> segment_of, point_of;
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

using Normals = std::vector<Eigen::Vector3f>;

Parts parts_of(std::span<const SeenSegment> segments, std::span<const Normals> faces) {
  Parts parts;
  for (std::size_t s = 0; s < segments.size(); ++s) {
    const SeenSegment& segment = segments[s];
    const Pose& pose = segment.model_from_scan;
    for (std::size_t i = 0; i < segment.is_part.size(); ++i) {
      if (segment.is_part[i] == 0) continue;
      const PointCloud& cloud = segment.cloud_in_scan;
      parts.cloud.positions.emplace_back((pose * cloud.positions[i].cast<double>()).cast<float>());
      parts.cloud.normals.emplace_back((pose.linear() * faces[s][i].cast<double>()).cast<float>());
      parts.segment_of.push_back(static_cast<std::uint32_t>(s));
      parts.point_of.push_back(static_cast<std::uint32_t>(i));
    }
  }
  return parts;
}

// Of the part points marked in `asked`, those that float: they lie in the face of at most half of the part's points
// next to them, as mixed measurements of two surfaces do.
std::vector<std::uint32_t> floating(std::span<const std::uint8_t> asked, const SeenSegment& segment,
                                    const Normals& faces, const Scale& scale, const Context& context) {
  PointCloud part;
  std::vector<std::uint32_t> place, at;  // of part points in the segment, of those asked about among the part
  for (std::uint32_t i = 0; i < segment.is_part.size(); ++i) {
    if (segment.is_part[i] == 0) continue;
    if (asked[i] != 0) at.push_back(static_cast<std::uint32_t>(place.size()));
    place.push_back(i);
    part.positions.push_back(segment.cloud_in_scan.positions[i]);
    part.normals.push_back(faces[i]);
  }
  std::vector<std::uint32_t> result;
  if (at.empty() || part.size() <= scan::kFaceNeighbours) return result;
  const KdTree tree(part.positions);
  const std::vector<std::uint8_t> support =
      scan::face_support(at, part, part.normals, tree, {.noise_sigma_mm = scale.sigma, .tilt = kThroughTilt}, context);
  for (std::size_t k = 0; k < at.size(); ++k) {
    if (2U * support[k] <= scan::kFaceNeighbours) result.push_back(place[at[k]]);
  }
  return result;
}

class Recut {
 public:
  Recut(std::span<const SeenSegment> segments, const Context& context) : segments_(segments) {
    std::vector<double> spacings;
    for (const SeenSegment& segment : segments) {
      scales_.push_back(scale_of(segment));
      spacings.push_back(scales_.back().spacing);
      faces_.push_back(segment.cloud_in_scan.normals);
    }
    parts_ = parts_of(segments, faces_);
    std::ranges::sort(spacings);
    spacing_ = spacings.empty() ? 0.0 : spacings[spacings.size() / 2];
    radius_ = kAroundInSpacings * spacing_;
    if (!(radius_ > 0.0) || parts_.cloud.empty()) return;
    grid_.emplace(parts_.cloud.positions, radius_, context);
    measure_noise(context);
    for (std::size_t s = 0; s < segments.size(); ++s) {
      faces_[s] = surface_normals(segments[s].cloud_in_scan, scales_[s].sigma, scales_[s].spacing, context);
    }
    parts_ = parts_of(segments, faces_);
    eyes_.resize(segments.size());
    parallel_for(context, segments.size(), 1,
                 [&](std::size_t s) { eyes_[s].emplace(segments[s], faces_[s], scales_[s]); });
  }

  [[nodiscard]] std::vector<RecutSegment> cut(const Context& context) const {
    std::vector<RecutSegment> result;
    std::vector<Doubts> doubts;
    for (std::size_t s = 0; s < segments_.size(); ++s) {
      result.push_back({segments_[s].is_part, std::vector<std::uint8_t>(segments_[s].is_part.size(), 0)});
      doubts.emplace_back(segments_[s].is_part.size(), Doubt::none);
      if (grid_ && !context.cancelled()) judge(s, result[s].is_part, doubts[s], context);
    }
    if (!grid_) return result;
    for (std::size_t s = 0; s < segments_.size(); ++s) {
      if (!context.cancelled()) result[s].in_doubt = in_doubt(s, result[s].is_part, doubts, context);
    }
    return result;
  }

 private:
  // Part points of others that have a say about a point: it lies in their planes, or over them. (What lies behind a
  // plane may be the part's other face, or the far side of an edge.) And those of the former that face as it does.
  struct Opinions {
    int around = 0, agreeing = 0, facing_alike = 0;
  };

  // What speaks against a sample of the part.
  enum class Doubt : std::uint8_t { none, some, much };
  using Doubts = std::vector<Doubt>;

  void judge(std::size_t segment, std::vector<std::uint8_t>& is_part, Doubts& doubts, const Context& context) const {
    parallel_for_blocks(context, is_part.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      std::vector<KdTree::Neighbour> neighbours;
      for (std::size_t i = begin; i < end && !context.cancelled(); ++i) {
        const Opinions others = opinions(segment, i);
        const bool most_agree = others.agreeing > kDoubtful * others.around;
        if (is_part[i] == 0) {
          if (others.facing_alike < kJoining || sights(segment, i, neighbours).through) continue;
          is_part[i] = 1;
          doubts[i] = most_agree ? Doubt::none : Doubt::some;  // its own scan took it for margin
          continue;
        }
        if (most_agree) continue;
        const Sights seen = sights(segment, i, neighbours);
        const bool is_contradicted = others.agreeing == 0 || others.agreeing < kContradicted * others.around;
        if (seen.through && is_contradicted) {
          is_part[i] = 0;
          doubts[i] = Doubt::much;
        } else if (seen.passed > seen.met) {
          doubts[i] = seen.passed > seen.met + 1 ? Doubt::much : Doubt::some;  // one ray says little, so near an edge
        }
      }
    });
  }

  // Where there is some doubt, a sample is left to itself if it floats, or if one of which there is no doubt covers its
  // place: then it adds nothing.
  [[nodiscard]] std::vector<std::uint8_t> in_doubt(std::size_t segment, std::span<const std::uint8_t> is_part,
                                                   const std::vector<Doubts>& doubts, const Context& context) const {
    const Doubts& own = doubts[segment];
    std::vector<std::uint8_t> result(own.size(), 0), asked(own.size(), 0);
    parallel_for(context, own.size(), kGrain, [&](std::size_t i) {
      if (own[i] == Doubt::none || is_part[i] == 0) return;
      bool is_covered = false;
      for_others_around(segment, in_model(segment, i), [&](std::uint32_t j, double apart, double) {
        const bool is_sure = doubts[parts_.segment_of[j]][parts_.point_of[j]] == Doubt::none;
        is_covered = is_covered || (is_sure && apart < kCovering * spacing_);
      });
      (own[i] == Doubt::much || is_covered ? result : asked)[i] = 1;
    });
    for (const std::uint32_t i : floating(asked, segments_[segment], faces_[segment], scales_[segment], context)) {
      result[i] = 1;
    }
    return result;
  }

  [[nodiscard]] Eigen::Vector3f in_model(std::size_t segment, std::size_t point) const {
    const SeenSegment& own = segments_[segment];
    return (own.model_from_scan * own.cloud_in_scan.positions[point].cast<double>()).cast<float>();
  }
  [[nodiscard]] Eigen::Vector3f normal_in_model(std::size_t segment, std::size_t point) const {
    return (segments_[segment].model_from_scan.linear() * faces_[segment][point].cast<double>()).cast<float>();
  }

  // Calls visit(j, distance to j, height over its plane) for the part points j of others around a point.
  template <class Visit>
  void for_others_around(std::size_t segment, const Eigen::Vector3f& position, const Visit& visit) const {
    grid_->around_until(position, [&](std::uint32_t j) {
      if (parts_.segment_of[j] == segment) return false;
      const Eigen::Vector3f offset = position - parts_.cloud.positions[j];
      const double apart = static_cast<double>(offset.norm());
      if (apart <= radius_) visit(j, apart, static_cast<double>(parts_.cloud.normals[j].dot(offset)));
      return false;
    });
  }

  // A plane that happens to pass by confirms nothing: near an edge, where flying points are, there are many. So it is
  // their share that counts.
  [[nodiscard]] Opinions opinions(std::size_t segment, std::size_t point) const {
    const Eigen::Vector3f normal = normal_in_model(segment, point);
    Opinions others;
    for_others_around(segment, in_model(segment, point), [&](std::uint32_t j, double apart, double height) {
      const double noise = std::hypot(scales_[segment].sigma, scales_[parts_.segment_of[j]].sigma);
      const bool agrees = in_plane(height, apart, noise);
      if (!agrees && height < 0.0) return;
      ++others.around;
      others.agreeing += agrees ? 1 : 0;
      others.facing_alike += agrees && normal.dot(parts_.cloud.normals[j]) >= kFacingAlike ? 1 : 0;
    });
    return others;
  }

  // What all other scans saw at a point: whether one saw through it, and of how many the nearest ray passed it or met
  // the part there.
  struct Sights {
    bool through = false;
    int passed = 0, met = 0;
  };

  [[nodiscard]] Sights sights(std::size_t segment, std::size_t point,
                              std::vector<KdTree::Neighbour>& neighbours) const {
    const SeenSegment& own = segments_[segment];
    const Eigen::Vector3d position = own.model_from_scan * own.cloud_in_scan.positions[point].cast<double>();
    Sights all;
    for (std::size_t other = 0; other < segments_.size(); ++other) {
      if (other == segment) continue;
      const Eigen::Vector3d in_other = segments_[other].model_from_scan.inverse(Eigen::Isometry) * position;
      const Sight sight = eyes_[other]->sight_of(in_other, scales_[segment].sigma, spacing_, neighbours);
      all.through = all.through || sight.through;
      all.passed += sight.passed ? 1 : 0;
      all.met += sight.met ? 1 : 0;
    }
    return all;
  }

  // The noise of a scan is estimated over all of it: in a hall that is the noise of walls further off than the part. By
  // how much samples of one surface differ, the part itself shows, and what the poses leave is in it.
  void measure_noise(const Context& context) {
    std::vector<double> measured(segments_.size(), 0.0);
    parallel_for(context, segments_.size(), 1, [&](std::size_t s) {
      std::vector<double> heights;
      for (std::size_t i = 0; i < segments_[s].is_part.size(); ++i) {
        if (segments_[s].is_part[i] == 0) continue;
        if (const auto height = height_over_next(s, i)) heights.push_back(std::abs(*height));
      }
      if (heights.size() < kFewestDifferences) return;
      measured[s] = 1.4826 * median_of(std::move(heights)) / std::numbers::sqrt2;
    });
    for (std::size_t s = 0; s < segments_.size(); ++s) {
      if (measured[s] > 0.0) scales_[s].sigma = std::min(scales_[s].sigma, measured[s]);
    }
  }

  // Height of a point over the plane of that one of others that lies next to it along the surface, within one spacing,
  // and faces alike. The nearest in space would be one that happens to differ little.
  [[nodiscard]] std::optional<double> height_over_next(std::size_t segment, std::size_t point) const {
    const Eigen::Vector3f normal = normal_in_model(segment, point);
    double nearest = spacing_ * spacing_;
    std::optional<double> result;
    for_others_around(segment, in_model(segment, point), [&](std::uint32_t j, double apart, double height) {
      const double aside = apart * apart - height * height;
      if (aside > nearest || normal.dot(parts_.cloud.normals[j]) < kFacingAlike) return;
      nearest = aside;
      result = height;
    });
    return result;
  }

  std::span<const SeenSegment> segments_;
  std::vector<Scale> scales_;
  std::vector<Normals> faces_;  // of all points, in the scans' frames
  Parts parts_;
  std::vector<std::optional<Eye>> eyes_;
  std::optional<PointGrid> grid_;
  double spacing_ = 0.0, radius_ = 0.0;
};

}  // namespace

Result<std::vector<RecutSegment>> recut(std::span<const SeenSegment> segments, const Context& context) {
  for (std::size_t s = 0; s < segments.size(); ++s) ASBUILT_CHECK(check(segments[s], s));
  std::vector<RecutSegment> cut = Recut(segments, context).cut(context);
  if (context.cancelled()) return fail(ErrorCode::cancelled, "cancelled while the segments were cut anew");
  return cut;
}

}  // namespace asbuilt::fuse
