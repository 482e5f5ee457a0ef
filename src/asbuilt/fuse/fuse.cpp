// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/fuse/fuse.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <tuple>

#include "asbuilt/core/parallel.h"
#include "asbuilt/fuse/point_grid.h"
#include "asbuilt/fuse/surface_normals.h"

namespace asbuilt::fuse {
namespace {

constexpr double kAbsorbInSpacings = 0.75;  // any point of a square lattice of samples is within 0.71 of one
constexpr double kMergeInSpacings = 1.0;
constexpr double kLayerInSigmas = 4.0;     // along the normal: two samples of one surface differ by no more
constexpr double kLayerInSpacings = 0.25;  // ... plus what surface shape does within the merge distance
constexpr double kMeanInSigmas = 3.0;      // of the difference of two samples: a mean is of one quantity
constexpr double kMeanTilt = 0.05;         // radians by which normals may err
constexpr double kIsolationInSpacings = 5.0;
constexpr int kIsolatedGroup = 2;           // a point with at most one other near is isolated
constexpr float kNormalMeanCosine = 0.94F;  // 20 degrees: normals that are averaged

struct Scan {
  double sigma = 0.0, spacing = 0.0;
  int index = 0;
};

// All points of all scans in the model frame, finest scan first.
struct Union {
  PointCloud cloud;
  std::vector<std::uint16_t> scan_of;  // position in `scans`
  std::vector<Scan> scans;
  std::vector<std::size_t> starts;  // first point of each scan, one more at the end
  std::vector<const PosedSegment*> segments;

  // What the sensor saw at a point beside its place; null where its scan has none.
  [[nodiscard]] const Colour* colour(std::size_t point) const {
    const std::size_t scan = scan_of[point];
    return segments[scan]->colours.empty() ? nullptr : &segments[scan]->colours[point - starts[scan]];
  }
  [[nodiscard]] const float* intensity(std::size_t point) const {
    const std::size_t scan = scan_of[point];
    return segments[scan]->intensities.empty() ? nullptr : &segments[scan]->intensities[point - starts[scan]];
  }
};

Result<void> check(const PosedSegment& segment, std::size_t place) {
  const PointCloud& cloud = segment.segment_in_scan;
  const auto bad = [&](const std::string& what) {
    return fail(ErrorCode::invalid_argument, fmt::format("segment {} {}", place, what));
  };
  if (cloud.normals.size() != cloud.size()) {
    return bad(fmt::format("has {} normals for {} points", cloud.normals.size(), cloud.size()));
  }
  for (const auto& [what, count] :
       {std::pair("colours", segment.colours.size()), std::pair("intensities", segment.intensities.size())}) {
    if (count != 0 && count != cloud.size())
      return bad(fmt::format("has {} {} for {} points", count, what, cloud.size()));
  }
  if (!is_rigid(segment.model_from_scan.matrix())) return bad("has a pose that is not a rigid motion");
  if (!(segment.noise_sigma_mm >= 0.0) || !std::isfinite(segment.noise_sigma_mm)) {
    return bad(fmt::format("has a noise of {} mm", segment.noise_sigma_mm));
  }
  if (!(segment.spacing_mm >= 0.0) || !std::isfinite(segment.spacing_mm)) {
    return bad(fmt::format("has a spacing of {} mm", segment.spacing_mm));
  }
  if (segment.scan_index < 0 || segment.scan_index > std::numeric_limits<std::uint16_t>::max()) {
    return bad(fmt::format("has scan index {}, it must be in [0, 65535]", segment.scan_index));
  }
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!cloud.positions[i].allFinite() || !cloud.normals[i].allFinite()) {
      return bad(fmt::format("has a point that is not finite, number {}", i));
    }
  }
  return {};
}

Union union_of(std::span<const PosedSegment> segments, bool fit_faces, const Context& context) {
  std::vector<Scan> scans(segments.size());
  for (std::size_t s = 0; s < segments.size(); ++s) {
    const double measured =
        segments[s].spacing_mm > 0.0 ? segments[s].spacing_mm : median_spacing(segments[s].segment_in_scan.positions);
    scans[s] = {segments[s].noise_sigma_mm, measured, segments[s].scan_index};
  }
  std::vector<std::size_t> order(segments.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {},
                           [&](std::size_t s) { return std::tuple(scans[s].spacing, scans[s].sigma, scans[s].index); });

  Union all;
  for (const std::size_t s : order) {
    const PointCloud& from = segments[s].segment_in_scan;
    const std::vector<Eigen::Vector3f> normals =
        fit_faces ? surface_normals(from, scans[s].sigma, scans[s].spacing, context) : from.normals;
    const Pose& pose = segments[s].model_from_scan;
    const std::size_t start = all.cloud.size();
    all.starts.push_back(start);
    all.cloud.positions.resize(start + from.size());
    all.cloud.normals.resize(start + from.size());
    all.scan_of.resize(start + from.size(), static_cast<std::uint16_t>(all.scans.size()));
    parallel_for(context, from.size(), 1 << 14, [&](std::size_t i) {
      all.cloud.positions[start + i] = (pose * from.positions[i].cast<double>()).cast<float>();
      all.cloud.normals[start + i] = (pose.linear() * normals[i].cast<double>()).cast<float>();
    });
    all.scans.push_back(scans[s]);
    all.segments.push_back(&segments[s]);
  }
  all.starts.push_back(all.cloud.size());
  return all;
}

double typical_spacing(const Union& all) {
  std::vector<double> spacings;
  for (const Scan& scan : all.scans) {
    if (scan.spacing > 0.0) spacings.push_back(scan.spacing);
  }
  return spacings.empty() ? 0.0 : spacings[spacings.size() / 2];  // sorted already
}

double largest_sigma(const Union& all) {
  double largest = 0.0;
  for (const Scan& scan : all.scans) largest = std::max(largest, scan.sigma);
  return largest;
}

// Two samples are of one piece of surface if they face alike, lie side by side within the merge distance, and no
// further apart across the surface than noise and shape explain.
struct SameSurface {
  double radius, layer;
  float min_cosine;

  // Height of b over a's surface, from both normals: on a circle it is zero for any two points, so that a curved
  // surface is not pulled to its inside as it would be by a's normal alone.
  [[nodiscard]] static double height(const PointCloud& cloud, std::size_t a, std::size_t b) {
    const Eigen::Vector3f offset = cloud.positions[b] - cloud.positions[a];
    return static_cast<double>(0.5F * (cloud.normals[a] + cloud.normals[b]).dot(offset));
  }

  // Of points that PointGrid::along has found beside a: whether they also face alike and lie on one layer.
  [[nodiscard]] bool holds(const PointCloud& cloud, std::size_t a, std::size_t b) const {
    return cloud.normals[a].dot(cloud.normals[b]) >= min_cosine && std::abs(height(cloud, a, b)) <= layer;
  }
};

// Scan by scan, finest first: a sample stays unless one that stayed before, of another scan, covers its place. Samples
// of one scan never compete, so that each scan is one parallel loop whatever its order.
std::vector<char> kept_samples(const Union& all, const PointGrid& grid, const SameSurface& same,
                               const std::vector<char>& isolated, bool radius_is_stated, const Context& context) {
  std::vector<char> kept(all.cloud.size(), 0);
  for (std::size_t s = 0; s < all.scans.size(); ++s) {
    const double own = kAbsorbInSpacings * all.scans[s].spacing;
    const double within = radius_is_stated ? same.radius : std::min(same.radius, own);
    const std::size_t start = all.starts[s];
    parallel_for(context, all.starts[s + 1] - start, 2048, [&](std::size_t offset) {
      const std::size_t i = start + offset;
      if (isolated[i]) return;
      bool covered = false;
      if (s > 0 && within > 0.0) {
        grid.along(all.cloud.positions[i], all.cloud.normals[i], static_cast<float>(within), [&](std::uint32_t j) {
          covered = j < start && kept[j] && same.holds(all.cloud, i, j);
          return covered;
        });
      }
      kept[i] = covered ? 0 : 1;
    });
  }
  return kept;
}

// Samples that differ by no more than their noise explains. Others of the same surface count as having seen it, but
// would pull the mean off it: the far side of a profile that is no wider than the samples are apart, an edge's other
// face.
struct Averaging {
  bool noise_is_known = false;

  [[nodiscard]] bool holds(const Union& all, std::size_t a, std::size_t b) const {
    if (!noise_is_known) return true;
    const double noise = std::hypot(all.scans[all.scan_of[a]].sigma, all.scans[all.scan_of[b]].sigma);
    const double apart = static_cast<double>((all.cloud.positions[b] - all.cloud.positions[a]).norm());
    return std::abs(SameSurface::height(all.cloud, a, b)) <= kMeanInSigmas * noise + kMeanTilt * apart;
  }
};

struct Fused {
  Eigen::Vector3f position, normal;
  std::uint16_t scan = 0, support = 0;
  float sigma = 0.0F;
  Colour colour{};
  float intensity = std::numeric_limits<float>::quiet_NaN();
};

// Means of what the sensors saw, over the samples that have it.
class Shade {
 public:
  void add(const Union& all, std::size_t point, double weight) {
    if (const Colour* seen = all.colour(point)) {
      for (std::size_t c = 0; c < 3; ++c) colour_[c] += weight * (*seen)[c];
      coloured_ += weight;
    }
    const float* seen = all.intensity(point);
    if (seen != nullptr && std::isfinite(*seen)) {
      intensity_ += weight * static_cast<double>(*seen);
      with_intensity_ += weight;
    }
  }
  void give_to(Fused& fused) const {
    for (std::size_t c = 0; c < 3 && coloured_ > 0.0; ++c) {
      fused.colour[c] = static_cast<std::uint8_t>(std::lround(colour_[c] / coloured_));
    }
    if (with_intensity_ > 0.0) fused.intensity = static_cast<float>(intensity_ / with_intensity_);
  }

 private:
  std::array<double, 3> colour_{};
  double coloured_ = 0.0, intensity_ = 0.0, with_intensity_ = 0.0;
};

struct Weights {
  std::vector<double> of_scan;  // 1 / sigma^2; all alike where any is unknown
  bool known = true;
};

Weights weights_of(const Union& all) {
  Weights weights;
  weights.known = std::ranges::all_of(all.scans, [](const Scan& scan) { return scan.sigma > 0.0; });
  for (const Scan& scan : all.scans) weights.of_scan.push_back(weights.known ? 1.0 / (scan.sigma * scan.sigma) : 1.0);
  return weights;
}

// Scans around one sample: few, so a sorted little list beats a table of all scans.
struct ScanShares {
  std::vector<std::pair<std::uint16_t, double>> shares;

  void add(std::uint16_t scan, double weight) {
    const auto at = std::ranges::lower_bound(shares, scan, {}, &std::pair<std::uint16_t, double>::first);
    if (at != shares.end() && at->first == scan) {
      at->second += weight;
    } else {
      shares.insert(at, {scan, weight});
    }
  }
  [[nodiscard]] std::uint16_t dominant() const {
    return std::ranges::max_element(shares, {}, &std::pair<std::uint16_t, double>::second)->first;
  }
};

Fused fused_sample(std::size_t i, const Union& all, const PointGrid& grid, const SameSurface& same,
                   const Weights& weights, bool move, ScanShares& scans) {
  scans.shares.clear();
  double total = 0.0, height = 0.0;
  Shade shade;
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  const auto radius = static_cast<float>(same.radius);
  const Averaging averaging{weights.known};
  grid.along(all.cloud.positions[i], all.cloud.normals[i], radius, [&](std::uint32_t j) {
    if (!same.holds(all.cloud, i, j)) return false;
    const double weight = weights.of_scan[all.scan_of[j]];
    scans.add(all.scan_of[j], weight);
    if (!averaging.holds(all, i, j)) return false;
    shade.add(all, j, weight);
    total += weight;
    height += weight * SameSurface::height(all.cloud, i, j);
    if (all.cloud.normals[i].dot(all.cloud.normals[j]) > kNormalMeanCosine) {
      normal += static_cast<float>(weight) * all.cloud.normals[j];
    }
    return false;
  });
  Fused fused{.position = all.cloud.positions[i],
              .normal = all.cloud.normals[i],
              .support = static_cast<std::uint16_t>(scans.shares.size())};
  if (!move) {
    const Scan& own = all.scans[all.scan_of[i]];
    fused.scan = static_cast<std::uint16_t>(own.index);
    fused.sigma = static_cast<float>(own.sigma);
    Shade own_shade;
    own_shade.add(all, i, 1.0);
    own_shade.give_to(fused);
    return fused;
  }
  fused.position += static_cast<float>(height / total) * all.cloud.normals[i];
  if (normal.squaredNorm() > 0.0F) fused.normal = normal.normalized();
  fused.scan = static_cast<std::uint16_t>(all.scans[scans.dominant()].index);
  fused.sigma = weights.known ? static_cast<float>(1.0 / std::sqrt(total)) : 0.0F;
  shade.give_to(fused);
  return fused;
}

// Measured by the coarsest scan, so that no scan is dropped for being sparse.
std::vector<char> isolated_points(const Union& all, const Context& context) {
  std::vector<char> isolated(all.cloud.size(), 0);
  const double cell = kIsolationInSpacings * all.scans.back().spacing;
  if (!(cell > 0.0) || all.cloud.size() < 100) return isolated;
  const PointGrid grid(all.cloud.positions, cell, context);
  parallel_for(context, all.cloud.size(), 2048, [&](std::size_t i) {
    int near = 0;  // itself included
    grid.around_until(all.cloud.positions[i], [&](std::uint32_t) { return ++near > kIsolatedGroup; });
    isolated[i] = near <= kIsolatedGroup ? 1 : 0;
  });
  return isolated;
}

Reconstruction collected(std::span<const Fused> fused, const Union& all) {
  Reconstruction result;
  const bool coloured =
      std::ranges::any_of(all.segments, [](const auto* segment) { return !segment->colours.empty(); });
  const bool with_intensity =
      std::ranges::any_of(all.segments, [](const auto* segment) { return !segment->intensities.empty(); });
  for (const Fused& sample : fused) {
    if (coloured) result.colours.push_back(sample.colour);
    if (with_intensity) result.intensities.push_back(sample.intensity);
    result.cloud.positions.push_back(sample.position);
    result.cloud.normals.push_back(sample.normal);
    result.scan.push_back(sample.scan);
    result.support.push_back(sample.support);
    result.sigma_mm.push_back(sample.sigma);
  }
  return result;
}

}  // namespace

Result<void> FuseOptions::validate() const {
  if (!(merge_distance_mm >= 0.0 && std::isfinite(merge_distance_mm))) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("merge_distance = {} mm must not be negative", merge_distance_mm));
  }
  if (!(max_normal_angle_deg > 0.0 && max_normal_angle_deg < 90.0)) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("max_normal_angle_deg = {} must be in (0, 90)", max_normal_angle_deg));
  }
  return {};
}

Result<Reconstruction> fuse(std::span<const PosedSegment> segments, const FuseOptions& options,
                            const Context& context) {
  ASBUILT_CHECK(options.validate());
  for (std::size_t i = 0; i < segments.size(); ++i) ASBUILT_CHECK(check(segments[i], i));
  const Union all = union_of(segments, !options.paper_mode, context);
  if (all.cloud.empty()) return fail(ErrorCode::not_possible, "there are no points to fuse");

  const double spacing = typical_spacing(all);
  SameSurface same{};
  same.radius = options.merge_distance_mm > 0.0 ? options.merge_distance_mm
                                                : std::max(kMergeInSpacings * spacing, 2.0 * largest_sigma(all));
  same.layer = std::numbers::sqrt2 * kLayerInSigmas * largest_sigma(all) + kLayerInSpacings * same.radius;
  same.min_cosine = static_cast<float>(std::cos(options.max_normal_angle_deg * std::numbers::pi / 180.0));
  if (!(same.radius > 0.0)) same.radius = 1e-6;  // one point, or all in one place: nothing to merge

  std::vector<char> isolated(all.cloud.size(), 0);
  if (options.drop_isolated && !options.paper_mode) isolated = isolated_points(all, context);
  const PointGrid grid(all.cloud.positions, std::hypot(same.radius, same.layer), context);
  std::vector<char> kept(all.cloud.size(), 1);
  if (!options.paper_mode) kept = kept_samples(all, grid, same, isolated, options.merge_distance_mm > 0.0, context);
  if (context.cancelled()) return fail(ErrorCode::cancelled, "cancelled while fusing the scans");

  std::vector<std::uint32_t> chosen;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (kept[i]) chosen.push_back(static_cast<std::uint32_t>(i));
  }
  const Weights weights = weights_of(all);
  std::vector<Fused> fused(chosen.size());
  parallel_for_blocks(context, chosen.size(), 2048, [&](std::size_t begin, std::size_t end) {
    if (context.cancelled()) return;
    ScanShares scans;
    for (std::size_t i = begin; i < end; ++i) {
      fused[i] = fused_sample(chosen[i], all, grid, same, weights, !options.paper_mode, scans);
    }
  });
  if (context.cancelled()) return fail(ErrorCode::cancelled, "cancelled while fusing the scans");
  context.report_progress(1.0);

  Reconstruction result = collected(fused, all);
  result.merge_distance_mm = options.paper_mode ? 0.0 : same.radius;
  result.isolated_dropped = static_cast<std::size_t>(std::ranges::count(isolated, 1));
  return result;
}

}  // namespace asbuilt::fuse
