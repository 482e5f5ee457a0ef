// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/inspect/witnesses.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "asbuilt/core/matrix_factors.h"
#include "asbuilt/core/parallel.h"

namespace asbuilt::inspect {
namespace {

constexpr std::size_t kGrain = 1 << 14;

/// The indices below `count` that a test holds for, ascending.
template <class Test>
std::vector<std::uint32_t> chosen_of(std::size_t count, const Context& context, const Test& test) {
  std::vector<std::size_t> starts((count + kGrain - 1) / kGrain + 1, 0);
  parallel_for_blocks(context, count, kGrain, [&](std::size_t begin, std::size_t end) {
    std::size_t here = 0;
    for (std::size_t i = begin; i < end; ++i) here += test(i) ? 1 : 0;
    starts[begin / kGrain + 1] = here;
  });
  for (std::size_t block = 1; block < starts.size(); ++block) starts[block] += starts[block - 1];
  std::vector<std::uint32_t> chosen(starts.back());
  parallel_for_blocks(context, count, kGrain, [&](std::size_t begin, std::size_t end) {
    std::size_t place = starts[begin / kGrain];
    for (std::size_t i = begin; i < end; ++i) {
      if (test(i)) chosen[place++] = static_cast<std::uint32_t>(i);
    }
  });
  return chosen;
}

}  // namespace

double median_of(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

std::array<Eigen::Vector3f, 2> tangents(const Eigen::Vector3f& normal) {
  const Eigen::Vector3f first = normal.unitOrthogonal();
  return {first, normal.cross(first)};
}

Witnesses::Witnesses(const Measurement& m, const Pose& model_from_cloud, const Feet& all,
                     const model::PreparedModel& model, double radius_mm, double max_distance_mm,
                     const Context& context)
    : radius(radius_mm) {
  const Eigen::Matrix3f rotation = model_from_cloud.linear().cast<float>();
  const std::vector<std::uint32_t> chosen = chosen_of(m.cloud.size(), context, [&](std::size_t i) {
    if (!(std::abs(all.deviation_mm[i]) <= max_distance_mm)) return false;
    // The other wall of a thin sheet can be nearer; a point's own normal tells which wall it was measured on.
    return !m.cloud.has_normals() || (rotation * m.cloud.normals[i]).dot(model.face_normals[all.triangles[i]]) >= 0.0F;
  });
  std::vector<Eigen::Vector3f> feet(chosen.size());
  parallel_for(context, feet.size(), kGrain, [&](std::size_t k) { feet[k] = all.points[chosen[k]]; });
  cubes = std::make_unique<CubeRows>(feet, std::max(0.5 * radius, 1e-6 * model.diameter));
  const auto order = cubes->order();
  witnesses.resize(order.size());
  parallel_for(context, order.size(), kGrain, [&](std::size_t place) {
    const std::uint32_t i = chosen[order[place]];
    Witness& w = witnesses[place];
    w.foot = feet[order[place]];
    w.normal = model.face_normals[all.triangles[i]];
    w.deviation = all.deviation_mm[i];
    if (!m.sigma_mm.empty()) w.sigma = m.sigma_mm[i];
    if (!m.scan.empty()) w.scan = m.scan[i];
    if (!m.support.empty()) w.support = m.support[i];
  });
  spacing = median_distance(model.diameter);
  noise = overall_noise();
  repetition = noise_repetition();
}

void Witnesses::gather(const Eigen::Vector3f& position, const Eigen::Vector3f& normal, double reach,
                       std::vector<Near>& near, float least_cosine) const {
  near.clear();
  const auto radius_f = static_cast<float>(reach);
  cubes->around(position, radius_f, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Witness& w = witnesses[i];
      const float squared = (w.foot - position).squaredNorm();
      if (squared <= radius_f * radius_f && w.normal.dot(normal) > least_cosine) {
        near.push_back({squared, static_cast<std::uint32_t>(i)});
      }
    }
  });
}

/// Median distance of a point to its nearest neighbour at another place (merged files hold points twice), without a tree
/// over all of them; 0 if there is but one place.
double Witnesses::median_distance(double diameter) const {
  constexpr std::size_t kProbes = 1000;
  std::vector<double> distances;
  const std::size_t probes = std::min(kProbes, witnesses.size());
  for (std::size_t probe = 0; probe < probes; ++probe) {
    const std::size_t place = probe * witnesses.size() / probes;
    float squared = std::numeric_limits<float>::infinity();
    for (double reach = 0.25 * radius; reach < diameter; reach *= 4.0) {
      cubes->around(witnesses[place].foot, static_cast<float>(reach), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          const float here = (witnesses[i].foot - witnesses[place].foot).squaredNorm();
          if (here > 0.0F) squared = std::min(squared, here);
        }
      });
      if (static_cast<double>(squared) <= reach * reach) break;  // what lies beyond is further
    }
    if (std::isfinite(squared)) distances.push_back(std::sqrt(static_cast<double>(squared)));
  }
  return distances.empty() ? 0.0 : median_of(distances);
}

/// The scatter of points about a plane through their neighbours, over evenly chosen probes.
double Witnesses::overall_noise() const {
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

/// Points of a merged cloud are means over their neighbourhoods, which overlap: they scatter little, and their mean
/// is worse known than from as many free points. How much worse is seen from the means of the four quadrants about
/// evenly chosen probes, taken with alternating signs, in which a plane and a dome cancel.
double Witnesses::noise_repetition() const {
  constexpr std::size_t kProbes = 800, kFewest = 3, kLeastProbes = 50;
  constexpr double kMedianOfSquare = 0.4549;  // of a normal variable of variance one
  std::vector<double> ratios;
  std::vector<Near> near;
  const std::size_t probes = std::min(kProbes, witnesses.size());
  for (std::size_t probe = 0; probe < probes; ++probe) {
    const Witness& at = witnesses[probe * witnesses.size() / probes];
    gather(at.foot, at.normal, kOwnRadius * radius, near);
    const auto across = tangents(at.normal);
    std::array<double, 4> sums{};
    std::array<std::size_t, 4> counts{};
    const Eigen::Vector3d plane = plane_through(at.foot, at.normal, near);
    double squares = 0.0;
    for (const Near& n : near) {
      const Witness& w = witnesses[n.witness];
      const Eigen::Vector3d row = row_of(at.foot, across, w);
      const double residual = static_cast<double>(w.deviation) - plane.dot(row);
      const std::size_t quadrant = row.y() < 0.0 ? (row.z() < 0.0 ? 2 : 1) : (row.z() < 0.0 ? 3 : 0);
      sums[quadrant] += residual;
      ++counts[quadrant];
      squares += residual * residual;
    }
    if (*std::ranges::min_element(counts) < kFewest || !(squares > 0.0)) continue;
    double contrast = 0.0, share = 0.0;
    for (std::size_t quadrant = 0; quadrant < 4; ++quadrant) {
      const auto count = static_cast<double>(counts[quadrant]);
      contrast += (quadrant % 2 == 0 ? 1.0 : -1.0) * sums[quadrant] / count;
      share += 1.0 / count;
    }
    ratios.push_back(contrast * contrast * static_cast<double>(near.size() - 3) / (squares * share));
  }
  return ratios.size() < kLeastProbes ? 1.0 : std::max(1.0, median_of(ratios) / kMedianOfSquare);
}

/// One, and the place in units of the radius along two directions.
Eigen::Vector3d Witnesses::row_of(const Eigen::Vector3f& position, const std::array<Eigen::Vector3f, 2>& across,
                                  const Witness& w) const {
  const Eigen::Vector3f offset = (w.foot - position) / static_cast<float>(radius);
  return {1.0, static_cast<double>(offset.dot(across[0])), static_cast<double>(offset.dot(across[1]))};
}

/// The linear function of the place that fits the deviations best.
Eigen::Vector3d Witnesses::plane_through(const Eigen::Vector3f& position, const Eigen::Vector3f& normal,
                                         const std::vector<Near>& near) const {
  const auto across = tangents(normal);
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (const Near& n : near) {
    const Eigen::Vector3d row = row_of(position, across, witnesses[n.witness]);
    information += row * row.transpose();
    moment += static_cast<double>(witnesses[n.witness].deviation) * row;
  }
  return solve_symmetric(information, moment);
}

/// Sum of squared deviations about the best linear function of the place.
double Witnesses::squares_about_plane(const Eigen::Vector3f& position, const Eigen::Vector3f& normal,
                                      const std::vector<Near>& near) const {
  const auto across = tangents(normal);
  const Eigen::Vector3d plane = plane_through(position, normal, near);
  double squares = 0.0;
  for (const Near& n : near) {
    const Witness& w = witnesses[n.witness];
    const double residual = static_cast<double>(w.deviation) - plane.dot(row_of(position, across, w));
    squares += residual * residual;
  }
  return squares;
}

}  // namespace asbuilt::inspect
