// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/inspect/spots.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "asbuilt/core/parallel.h"
#include "asbuilt/inspect/extremum.h"
#include "asbuilt/inspect/witnesses.h"

namespace asbuilt::inspect {
namespace {

constexpr float kRoundTheEdgeCosine = -0.5F;  // on faces that meet in an edge; turned further it may be the other wall
constexpr std::size_t kAround = 6;   // points that tell the spacing about a place
constexpr double kOwnReach = 0.6;    // in spacings: discs about the points of a rim then reach half of one beyond it
constexpr double kEdgeReach = 0.85;  // in spacings, at an edge that the points go round: rows end anywhere before it
constexpr double kInnerReach = 1.1;  // in spacings, among points on all sides: no hole of a scattered cloud is wider
constexpr double kHalfDisc = 0.75;   // half a disc, and what the square of the spacing misses of it at a rim
constexpr double kMeanReach = 1.5;   // in spacings: the mean takes in the next neighbours at least
constexpr double kDetailSpacings = 5.0;  // radius of some 80 points
constexpr double kPriorWeight = 8.0;     // points' worth of belief in the cloud's overall noise
constexpr double kOutlier = 3.5;         // in noise sigmas, from the median
constexpr double kCentred = 0.25;        // of the reach: a top so near to the middle has surroundings on all sides

std::size_t nearest_to(const Eigen::Vector2d& place, const std::vector<Eigen::Vector3d>& heights) {
  const auto nearest = std::ranges::min_element(
      heights, {}, [&](const Eigen::Vector3d& p) { return (p.head<2>() - place).squaredNorm(); });
  return static_cast<std::size_t>(nearest - heights.begin());
}

/// How far the points may be that speak for a place.
struct Reaches {
  double own_mm = 0.0;    ///< points so near belong to the place whatever their spacing
  double at_edges = 0.0;  ///< in spacings, at an edge that the points go round
};

/// Scratch memory of one block of places.
struct Scratch {
  std::vector<Near> near, round_edge;
  std::vector<double> values, angles;
  std::vector<std::pair<std::uint16_t, std::uint32_t>> scans;  // scan and number of its points
};

}  // namespace

struct SpotFinder::Implementation : Witnesses {
  std::vector<ScanPose> poses;

  Implementation(const Measurement& measurement, const Pose& model_from_cloud, const Feet& feet,
                 const model::PreparedModel& model, double radius_mm, double max_distance_mm, const Context& context)
      : Witnesses(measurement, model_from_cloud, feet, model, radius_mm, max_distance_mm, context),
        poses(measurement.poses.begin(), measurement.poses.end()) {}

  /// Whether the points lie on all sides of a place: no gap of half a turn between their directions.
  [[nodiscard]] bool is_surrounded(const Eigen::Vector3f& position, const Eigen::Vector3f& normal,
                                   const std::vector<Near>& near, float squared_reach,
                                   std::vector<double>& angles) const {
    const auto across = tangents(normal);
    angles.clear();
    for (const Near& n : near) {
      if (n.squared_distance > squared_reach) continue;
      const Eigen::Vector3f offset = unfolded(position, normal, witnesses[n.witness]);
      angles.push_back(std::atan2(offset.dot(across[1]), offset.dot(across[0])));
    }
    if (angles.size() < 3) return false;
    std::ranges::sort(angles);
    double widest = angles.front() + 2.0 * std::numbers::pi - angles.back();
    for (std::size_t i = 1; i < angles.size(); ++i) widest = std::max(widest, angles[i] - angles[i - 1]);
    return widest < std::numbers::pi;
  }

  /// The way from a place to where a point meets the surface; beyond an edge as if the other face were laid flat.
  [[nodiscard]] static Eigen::Vector3f unfolded(const Eigen::Vector3f& position, const Eigen::Vector3f& normal,
                                                const Witness& w) {
    const Eigen::Vector3f offset = w.foot - position;
    const float cosine = w.normal.dot(normal);
    if (cosine > kSameSideCosine) return offset;
    // Behind the place's plane beyond a convex edge, before it in a corner: both ways off the face.
    return offset - offset.dot(normal) * (w.normal - cosine * normal).normalized();
  }

  [[nodiscard]] Spot at(const Eigen::Vector3f& position, const Eigen::Vector3f& normal, const Reaches& reaches,
                        Scratch& scratch) const {
    std::vector<Near>& near = scratch.near;
    if (!(spacing > 0.0)) return {};  // no two places were measured
    double reach = std::max(reaches.own_mm, 1.5 * spacing);
    gather(position, normal, reach, near);
    while (near.size() < kAround && 2.0 * reach < 8.0 * radius) {
      reach *= 2.0;
      gather(position, normal, reach, near);
    }
    if (near.size() < 3) return {};
    const std::size_t last = std::min(kAround, near.size()) - 1;
    const auto by_distance = [](const Near& a, const Near& b) {
      return std::pair(a.squared_distance, a.witness) < std::pair(b.squared_distance, b.witness);
    };
    std::nth_element(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(last), near.end(), by_distance);
    const float squared_around = near[last].squared_distance;
    const float nearest =
        std::sqrt(std::min_element(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(last) + 1, by_distance)
                      ->squared_distance);
    const float squared_view = 4.0F * squared_around;
    const bool surrounded = is_surrounded(position, normal, near, squared_view, scratch.angles);
    // The area that the nearest points share; somewhat more than half of it when they lie to one side, as the disc then
    // reaches past them.
    const double area = (surrounded ? 1.0 : kHalfDisc) * std::numbers::pi * static_cast<double>(squared_around);
    const double local = std::min(std::sqrt(area / static_cast<double>(last + 1)), 4.0 * std::max(spacing, 1e-12));
    if (static_cast<double>(nearest) > (surrounded ? kInnerReach : reaches.at_edges) * local) return {};
    if (!surrounded && static_cast<double>(nearest) > kOwnReach * local) {
      // No rim if the scan goes on round an edge.
      gather(position, normal, std::sqrt(static_cast<double>(squared_view)), scratch.round_edge, kRoundTheEdgeCosine);
      if (!is_surrounded(position, normal, scratch.round_edge, squared_view, scratch.angles)) return {};
    }
    const auto mean_reach = static_cast<float>(std::max(reaches.own_mm, kMeanReach * local));
    std::erase_if(near, [&](const Near& n) { return n.squared_distance > mean_reach * mean_reach; });
    return near.empty() ? Spot{} : averaged(position, normal, scratch);
  }

  [[nodiscard]] std::vector<Spot> all_at(const PointCloud& places, const Reaches& reaches,
                                         const Context& context) const;

  [[nodiscard]] Spot averaged(const Eigen::Vector3f& position, const Eigen::Vector3f& normal, Scratch& scratch) const {
    scratch.values.clear();
    for (const Near& n : scratch.near) scratch.values.push_back(static_cast<double>(witnesses[n.witness].deviation));
    const double middle = median_of(scratch.values);
    for (double& value : scratch.values) value = std::abs(value - middle);
    const double spread = std::max(1.4826 * median_of(scratch.values), noise);
    std::erase_if(scratch.near, [&](const Near& n) {
      return std::abs(static_cast<double>(witnesses[n.witness].deviation) - middle) > kOutlier * spread + 1e-9;
    });

    const auto count = static_cast<double>(scratch.near.size());
    double sum = 0.0, stated = 0.0;
    std::uint16_t support = 0;
    scratch.scans.clear();
    for (const Near& n : scratch.near) {
      const Witness& w = witnesses[n.witness];
      sum += static_cast<double>(w.deviation);
      stated += static_cast<double>(w.sigma) * static_cast<double>(w.sigma);
      support = std::max(support, w.support);
      count_scan(scratch.scans, w.scan);
    }
    Spot spot;
    spot.points = static_cast<std::uint32_t>(scratch.near.size());
    spot.deviation_mm = static_cast<float>(sum / count);
    const auto most = std::ranges::max_element(scratch.scans, {}, &std::pair<std::uint16_t, std::uint32_t>::second);
    spot.scan = most->first;
    spot.scans = std::max(support, static_cast<std::uint16_t>(scratch.scans.size()));

    double variance = noise * noise;
    if (scratch.near.size() > 3) {
      const double squares = squares_about_plane(position, normal, scratch.near);
      variance = (kPriorWeight * variance + squares) / (kPriorWeight + count - 3.0);
    }
    // Scatter that is smaller than what the sensor is said to do is luck, or points that were averaged with one
    // another.
    variance = std::max(variance, stated / count);
    const double of_poses = pose_variance(position, normal, scratch.scans, count);
    if (variance > 0.0 || of_poses > 0.0) {
      spot.standard_error_mm = static_cast<float>(std::sqrt(variance * std::min(1.0, repetition / count) + of_poses));
    }
    return spot;
  }

  static void count_scan(std::vector<std::pair<std::uint16_t, std::uint32_t>>& scans, std::uint16_t scan) {
    const auto place = std::ranges::lower_bound(scans, scan, {}, &std::pair<std::uint16_t, std::uint32_t>::first);
    if (place != scans.end() && place->first == scan) {
      ++place->second;
    } else {
      scans.insert(place, {scan, 1});
    }
  }

  /// Of the mean along the normal, when each scan moves by its own error.
  [[nodiscard]] double pose_variance(const Eigen::Vector3f& position, const Eigen::Vector3f& normal,
                                     const std::vector<std::pair<std::uint16_t, std::uint32_t>>& scans,
                                     double count) const {
    Vector6d motion;
    motion << position.cast<double>().cross(normal.cast<double>()), normal.cast<double>();
    double variance = 0.0;
    for (const auto& [scan, points] : scans) {
      const auto pose = std::ranges::find(poses, static_cast<int>(scan), &ScanPose::scan);
      if (pose == poses.end()) continue;
      const double share = static_cast<double>(points) / count;
      variance += share * share * std::max(0.0, motion.dot(pose->covariance * motion));
    }
    return variance;
  }
};

SpotFinder::SpotFinder(const Measurement& measurement, const Pose& model_from_cloud, const Feet& feet,
                       const model::PreparedModel& model, double radius_mm, double max_distance_mm,
                       const Context& context)
    : implementation_(std::make_unique<const Implementation>(measurement, model_from_cloud, feet, model, radius_mm,
                                                             max_distance_mm, context)) {}
SpotFinder::~SpotFinder() = default;
SpotFinder::SpotFinder(SpotFinder&&) noexcept = default;
SpotFinder& SpotFinder::operator=(SpotFinder&&) noexcept = default;

double SpotFinder::noise_sigma_mm() const { return implementation_->noise; }

double SpotFinder::spacing_mm() const { return implementation_->spacing; }

std::vector<Spot> SpotFinder::at(const PointCloud& places, const Context& context) const {
  return implementation_->all_at(places, {kOwnRadius * implementation_->radius, kEdgeReach}, context);
}

std::vector<Spot> SpotFinder::detailed_at(const PointCloud& places, const Context& context) const {
  const double radius = std::min(kOwnRadius * implementation_->radius, kDetailSpacings * implementation_->spacing);
  // Vertices lie on the edges themselves, further from the last row than the surface beside them.
  return implementation_->all_at(places, {radius, kInnerReach}, context);
}

std::vector<Spot> SpotFinder::Implementation::all_at(const PointCloud& places, const Reaches& reaches,
                                                     const Context& context) const {
  std::vector<Spot> spots(places.size());
  parallel_for_blocks(context, places.size(), 256, [&](std::size_t begin, std::size_t end) {
    if (context.cancelled()) return;
    Scratch scratch;
    for (std::size_t i = begin; i < end; ++i) {
      spots[i] = at(places.positions[i], places.normals[i], reaches, scratch);
    }
  });
  return spots;
}

Peak SpotFinder::peak_near(const Eigen::Vector3f& position, const Eigen::Vector3f& normal, double sign, double reach_mm,
                           const Spot& spot) const {
  Peak peak{position.cast<double>(), static_cast<double>(spot.deviation_mm),
            static_cast<double>(spot.standard_error_mm)};
  const auto across = tangents(normal);
  Eigen::Vector3f middle = position;
  std::vector<Near> near;
  std::vector<Eigen::Vector3d> heights;
  for (int pass = 0; pass < 3; ++pass) {  // about the top that was found, so that its surroundings tell of it
    implementation_->gather(middle, normal, reach_mm, near);
    heights.clear();
    std::vector<std::pair<std::uint16_t, std::uint32_t>> scans;
    for (const Near& n : near) {
      const Witness& w = implementation_->witnesses[n.witness];
      const Eigen::Vector3f offset = w.foot - middle;
      heights.emplace_back(offset.dot(across[0]), offset.dot(across[1]), w.deviation);
      Implementation::count_scan(scans, w.scan);
    }
    const auto extremum = extremum_of(heights, sign, reach_mm);
    if (!extremum) return peak;
    const std::size_t nearest = nearest_to(extremum->place, heights);
    middle = implementation_->witnesses[near[nearest].witness].foot;
    peak.point = middle.cast<double>();
    peak.deviation_mm = extremum->height;
    const double of_poses = implementation_->pose_variance(middle, normal, scans, static_cast<double>(near.size()));
    peak.standard_error_mm = std::sqrt(extremum->variance + of_poses);
    if (extremum->place.norm() < kCentred * reach_mm) break;
  }
  return peak;
}

}  // namespace asbuilt::inspect
