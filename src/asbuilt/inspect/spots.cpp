// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/inspect/spots.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "asbuilt/core/cube_rows.h"
#include "asbuilt/core/parallel.h"

namespace asbuilt::inspect {
namespace {

constexpr float kSameSideCosine = 0.5F;  // foot and place lie on faces turned by less than 60 degrees
constexpr std::size_t kAround = 6;       // points that tell the spacing about a place
constexpr double kOwnReach = 0.6;    // in spacings: discs about the points of a rim then reach half of one beyond it
constexpr double kInnerReach = 1.1;  // in spacings, among points on all sides: no hole of a scattered cloud is wider
constexpr double kHalfDisc = 0.75;   // half a disc, and what the square of the spacing misses of it at a rim
constexpr double kMeanReach = 1.5;   // in spacings: the mean takes in the next neighbours at least
constexpr double kOwnRadius = 0.75;  // of the radius that is asked for: neighbouring spots just overlap
constexpr double kDetailSpacings = 5.0;  // radius of some 80 points
constexpr double kPriorWeight = 8.0;     // points' worth of belief in the cloud's overall noise
constexpr double kOutlier = 3.5;         // in noise sigmas, from the median

/// What one point says, in the order of the grid.
struct Witness {
  Eigen::Vector3f foot, normal;
  float deviation = 0.0F, sigma = 0.0F;
  std::uint16_t scan = Spot::kNoScan, support = 1;
};

struct Near {
  float squared_distance = 0.0F;
  std::uint32_t witness = 0;
};

double median_of(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

/// Two directions across a normal.
std::array<Eigen::Vector3f, 2> tangents(const Eigen::Vector3f& normal) {
  const Eigen::Vector3f first = normal.unitOrthogonal();
  return {first, normal.cross(first)};
}

/// Scratch memory of one block of places.
struct Scratch {
  std::vector<Near> near;
  std::vector<double> values, angles;
  std::vector<std::pair<std::uint16_t, std::uint32_t>> scans;  // scan and number of its points
};

}  // namespace

struct SpotFinder::Implementation {
  std::vector<Witness> witnesses;
  std::vector<Eigen::Vector3f> feet;  // of the witnesses, for the grid; dropped after building
  std::unique_ptr<CubeRows> cubes;
  std::vector<ScanPose> poses;
  double radius = 0.0, spacing = 0.0, noise = 0.0;

  Implementation(const Measurement& m, const Pose& model_from_cloud, const Feet& all, const model::PreparedModel& model,
                 double radius_mm, double max_distance_mm)
      : poses(m.poses.begin(), m.poses.end()), radius(radius_mm) {
    std::vector<std::uint32_t> chosen;
    const Eigen::Matrix3f rotation = model_from_cloud.linear().cast<float>();
    for (std::uint32_t i = 0; i < m.cloud.size(); ++i) {
      if (!(std::abs(all.deviation_mm[i]) <= max_distance_mm)) continue;
      // The other wall of a thin sheet can be nearer; a point's own normal tells which wall it was measured on.
      const Eigen::Vector3f& face = model.face_normals[all.triangles[i]];
      if (m.cloud.has_normals() && (rotation * m.cloud.normals[i]).dot(face) < 0.0F) continue;
      chosen.push_back(i);
      feet.push_back(all.points[i]);
    }
    cubes = std::make_unique<CubeRows>(feet, std::max(0.5 * radius, 1e-6 * model.diameter));
    witnesses.reserve(chosen.size());
    for (const std::uint32_t place : cubes->order()) {
      const std::uint32_t i = chosen[place];
      Witness w{all.points[i], model.face_normals[all.triangles[i]], all.deviation_mm[i]};
      if (!m.sigma_mm.empty()) w.sigma = m.sigma_mm[i];
      if (!m.scan.empty()) w.scan = m.scan[i];
      if (!m.support.empty()) w.support = m.support[i];
      witnesses.push_back(w);
    }
    feet = {};
    spacing = median_distance(model.diameter);
    noise = overall_noise();
  }

  void gather(const Eigen::Vector3f& position, const Eigen::Vector3f& normal, double reach,
              std::vector<Near>& near) const {
    near.clear();
    const auto radius_f = static_cast<float>(reach);
    cubes->around(position, radius_f, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Witness& w = witnesses[i];
        const float squared = (w.foot - position).squaredNorm();
        if (squared <= radius_f * radius_f && w.normal.dot(normal) > kSameSideCosine) {
          near.push_back({squared, static_cast<std::uint32_t>(i)});
        }
      }
    });
  }

  /// Median distance of a point to its nearest neighbour, without a tree over all of them.
  [[nodiscard]] double median_distance(double diameter) const {
    constexpr std::size_t kProbes = 1000;
    std::vector<double> distances;
    const std::size_t probes = std::min(kProbes, witnesses.size());
    for (std::size_t probe = 0; probe < probes; ++probe) {
      const std::size_t place = probe * witnesses.size() / probes;
      float squared = std::numeric_limits<float>::infinity();
      for (double reach = 0.25 * radius; reach < diameter; reach *= 4.0) {
        cubes->around(witnesses[place].foot, static_cast<float>(reach), [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) {
            if (i != place) squared = std::min(squared, (witnesses[i].foot - witnesses[place].foot).squaredNorm());
          }
        });
        if (static_cast<double>(squared) <= reach * reach) break;  // what lies beyond is further
      }
      if (std::isfinite(squared)) distances.push_back(std::sqrt(static_cast<double>(squared)));
    }
    return distances.empty() ? 0.0 : median_of(distances);
  }

  /// The scatter of points about a plane through their neighbours, over evenly chosen probes.
  [[nodiscard]] double overall_noise() const {
    constexpr std::size_t kProbes = 800;
    std::vector<double> spreads;
    std::vector<Near> near;
    const std::size_t probes = std::min(kProbes, witnesses.size());
    for (std::size_t probe = 0; probe < probes; ++probe) {
      const Witness& at = witnesses[probe * witnesses.size() / probes];
      gather(at.foot, at.normal, std::min(radius, std::max(3.0 * spacing, 0.25 * radius)), near);
      if (near.size() < 8) continue;
      const double squares = squares_about_plane(at.foot, at.normal, near);
      spreads.push_back(std::sqrt(squares / static_cast<double>(near.size() - 3)));
    }
    return spreads.empty() ? 0.0 : median_of(spreads);
  }

  /// Sum of squared deviations about the best linear function of the place.
  [[nodiscard]] double squares_about_plane(const Eigen::Vector3f& position, const Eigen::Vector3f& normal,
                                           const std::vector<Near>& near) const {
    const auto across = tangents(normal);
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    double squares = 0.0;
    for (const Near& n : near) {
      const Witness& w = witnesses[n.witness];
      const Eigen::Vector3f offset = (w.foot - position) / static_cast<float>(radius);
      const Eigen::Vector3d row(1.0, offset.dot(across[0]), offset.dot(across[1]));
      information += row * row.transpose();
      moment += static_cast<double>(w.deviation) * row;
      squares += static_cast<double>(w.deviation) * static_cast<double>(w.deviation);
    }
    const Eigen::Vector3d fit = information.ldlt().solve(moment);
    return std::max(0.0, squares - fit.dot(moment));
  }

  /// Whether the points lie on all sides of a place: no gap of half a turn between their directions.
  [[nodiscard]] bool is_surrounded(const Eigen::Vector3f& position, const Eigen::Vector3f& normal, Scratch& scratch,
                                   float squared_reach) const {
    const auto across = tangents(normal);
    scratch.angles.clear();
    for (const Near& n : scratch.near) {
      if (n.squared_distance > squared_reach) continue;
      const Eigen::Vector3f offset = witnesses[n.witness].foot - position;
      scratch.angles.push_back(std::atan2(offset.dot(across[1]), offset.dot(across[0])));
    }
    if (scratch.angles.size() < 3) return false;
    std::ranges::sort(scratch.angles);
    double widest = scratch.angles.front() + 2.0 * std::numbers::pi - scratch.angles.back();
    for (std::size_t i = 1; i < scratch.angles.size(); ++i) {
      widest = std::max(widest, scratch.angles[i] - scratch.angles[i - 1]);
    }
    return widest < std::numbers::pi;
  }

  /// `own_radius`: points so near belong to the place whatever their spacing.
  [[nodiscard]] Spot at(const Eigen::Vector3f& position, const Eigen::Vector3f& normal, double own_radius,
                        Scratch& scratch) const {
    std::vector<Near>& near = scratch.near;
    double reach = std::max(own_radius, 1.5 * spacing);
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
    const bool surrounded = is_surrounded(position, normal, scratch, 4.0F * squared_around);
    // The area that the nearest points share; somewhat more than half of it when they lie to one side, as the disc then
    // reaches past them.
    const double area = (surrounded ? 1.0 : kHalfDisc) * std::numbers::pi * static_cast<double>(squared_around);
    const double local = std::min(std::sqrt(area / static_cast<double>(last + 1)), 4.0 * std::max(spacing, 1e-12));
    if (static_cast<double>(nearest) > (surrounded ? kInnerReach : kOwnReach) * local) return {};
    const auto mean_reach = static_cast<float>(std::max(own_radius, kMeanReach * local));
    std::erase_if(near, [&](const Near& n) { return n.squared_distance > mean_reach * mean_reach; });
    return near.empty() ? Spot{} : averaged(position, normal, scratch);
  }

  [[nodiscard]] std::vector<Spot> all_at(const PointCloud& places, double own_radius, const Context& context) const;

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
      spot.standard_error_mm = static_cast<float>(std::sqrt(variance / count + of_poses));
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
                       const model::PreparedModel& model, double radius_mm, double max_distance_mm)
    : implementation_(std::make_unique<const Implementation>(measurement, model_from_cloud, feet, model, radius_mm,
                                                             max_distance_mm)) {}
SpotFinder::~SpotFinder() = default;
SpotFinder::SpotFinder(SpotFinder&&) noexcept = default;
SpotFinder& SpotFinder::operator=(SpotFinder&&) noexcept = default;

double SpotFinder::noise_sigma_mm() const { return implementation_->noise; }

double SpotFinder::spacing_mm() const { return implementation_->spacing; }

std::vector<Spot> SpotFinder::at(const PointCloud& places, const Context& context) const {
  return implementation_->all_at(places, kOwnRadius * implementation_->radius, context);
}

std::vector<Spot> SpotFinder::detailed_at(const PointCloud& places, const Context& context) const {
  const double radius = std::min(kOwnRadius * implementation_->radius, kDetailSpacings * implementation_->spacing);
  return implementation_->all_at(places, radius, context);
}

std::vector<Spot> SpotFinder::Implementation::all_at(const PointCloud& places, double own_radius,
                                                     const Context& context) const {
  std::vector<Spot> spots(places.size());
  parallel_for_blocks(context, places.size(), 256, [&](std::size_t begin, std::size_t end) {
    if (context.cancelled()) return;
    Scratch scratch;
    for (std::size_t i = begin; i < end; ++i) {
      spots[i] = at(places.positions[i], places.normals[i], own_radius, scratch);
    }
  });
  return spots;
}

Peak SpotFinder::peak_near(const Eigen::Vector3f& position, const Eigen::Vector3f& normal, double sign, double reach_mm,
                           const Spot& spot) const {
  Peak peak{position.cast<double>(), static_cast<double>(spot.deviation_mm),
            static_cast<double>(spot.standard_error_mm)};
  std::vector<Near> near;
  implementation_->gather(position, normal, reach_mm, near);
  constexpr std::size_t kLeast = 20;
  if (near.size() < kLeast) return peak;

  using Vector = Eigen::Matrix<double, 6, 1>;
  using Matrix = Eigen::Matrix<double, 6, 6>;
  const auto across = tangents(normal);
  const auto row_of = [&](const Eigen::Vector2d& p) {
    return Vector(1.0, p.x(), p.y(), p.x() * p.x(), p.x() * p.y(), p.y() * p.y());
  };
  const auto place_of = [&](const Witness& w) {
    const Eigen::Vector3f offset = (w.foot - position) / static_cast<float>(reach_mm);
    return Eigen::Vector2d(offset.dot(across[0]), offset.dot(across[1]));
  };
  Vector fit = Vector::Zero();
  Matrix covariance = Matrix::Zero();
  double scale = std::numeric_limits<double>::infinity();
  for (int pass = 0; pass < 3; ++pass) {  // the later ones without what stands out
    Matrix information = Matrix::Zero();
    Vector moment = Vector::Zero();
    std::vector<double> residuals;
    std::vector<Vector> rows;
    for (const Near& n : near) {
      const Witness& w = implementation_->witnesses[n.witness];
      const Vector row = row_of(place_of(w));
      const double residual = static_cast<double>(w.deviation) - (pass == 0 ? 0.0 : row.dot(fit));
      if (pass > 0 && std::abs(residual) > kOutlier * scale) continue;
      information += row * row.transpose();
      moment += static_cast<double>(w.deviation) * row;
    }
    const auto solver = information.ldlt();
    if (solver.info() != Eigen::Success || !(solver.rcond() > 1e-9)) return peak;
    fit = solver.solve(moment);
    for (const Near& n : near) {
      const Witness& w = implementation_->witnesses[n.witness];
      residuals.push_back(std::abs(static_cast<double>(w.deviation) - row_of(place_of(w)).dot(fit)));
    }
    scale = std::max(1.4826 * median_of(residuals), 1e-9);
    covariance = solver.solve(Matrix::Identity()) * scale * scale;
  }
  // Where the paraboloid is highest, if it is a cap with its top nearby; else at the place itself.
  Eigen::Vector2d top = Eigen::Vector2d::Zero();
  Eigen::Matrix2d bend;
  bend << 2.0 * fit[3], fit[4], fit[4], 2.0 * fit[5];
  const bool is_cap = -sign * bend(0, 0) > 0.0 && bend.determinant() > 1e-12 * bend.squaredNorm();
  if (is_cap) {
    top = -bend.inverse() * fit.segment<2>(1);
    if (top.norm() > 0.5) top = Eigen::Vector2d::Zero();
  }
  const Vector row = row_of(top);
  peak.deviation_mm = row.dot(fit);
  const double own = std::sqrt(std::max(0.0, row.dot(covariance * row)));
  peak.standard_error_mm = std::isfinite(peak.standard_error_mm) ? std::max(own, 0.5 * peak.standard_error_mm) : own;
  const Eigen::Vector3f moved = static_cast<float>(reach_mm) *
                                (static_cast<float>(top.x()) * across[0] + static_cast<float>(top.y()) * across[1]);
  peak.point += moved.cast<double>();
  return peak;
}

}  // namespace asbuilt::inspect
