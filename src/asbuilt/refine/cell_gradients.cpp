// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/cell_gradients.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>
#include <utility>

#include "asbuilt/core/parallel.h"
#include "asbuilt/core/result.h"
#include "asbuilt/core/robust.h"
#include "asbuilt/refine/edge_residual.h"

namespace asbuilt::refine {
namespace {

/// Like CellGradient, with the cube's place packed into one number.
struct PlacedGradient {
  std::uint64_t cube = 0;
  Vector6d gradient = Vector6d::Zero();
};

std::uint64_t cube_of(const Eigen::Vector3d& position, double cell_mm) {
  constexpr int kBits = 21;
  constexpr double kMost = (1 << (kBits - 1)) - 1;
  std::uint64_t cube = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double place = std::clamp(std::floor(position[axis] / cell_mm), -kMost, kMost) + kMost;
    cube = cube << kBits | static_cast<std::uint64_t>(place);
  }
  return cube;
}

// Sums gradients of equal cubes.
std::vector<PlacedGradient> merged(std::vector<PlacedGradient> gradients) {
  std::ranges::stable_sort(gradients, {}, &PlacedGradient::cube);
  std::vector<PlacedGradient> sums;
  for (const PlacedGradient& gradient : gradients) {
    if (sums.empty() || sums.back().cube != gradient.cube) sums.push_back({gradient.cube, Vector6d::Zero()});
    sums.back().gradient += gradient.gradient;
  }
  return sums;
}

}  // namespace

std::vector<CellGradient> cell_gradients(std::span<const DirectedEdge> edges, std::span<const SampledView> views,
                                         std::span<const Pose> poses, const Scaling& scaling, bool symmetric,
                                         double cell_mm, const Context& context) {
  ASBUILT_EXPECT(cell_mm > 0.0, "cubes that are larger than nothing");
  std::vector<std::vector<PlacedGradient>> of_link(edges.size() / 2);
  parallel_for(context, of_link.size(), 1, [&](std::size_t l) {
    std::vector<PlacedGradient> gradients;
    for (const bool there : {true, false}) {
      const DirectedEdge& edge = edges[2 * l + (there ? 0 : 1)];
      const EdgeResidualFunction residual_of(edge, views, poses, scaling.origin, symmetric);
      const TukeyLoss loss{edge.scale_mm};
      for (std::size_t i = 0; i < edge.matches.size(); ++i) {
        residual_of.fetch_ahead(i);
        ResidualWithJacobian r = residual_of(i);
        const double weight =
            edge.weight * static_cast<double>(edge.matches[i].weight) * loss.weight(r.residual * r.residual);
        if (weight <= 0.0) continue;
        r.jacobian.head<3>() = residual_of.rotation() * r.jacobian.head<3>() / scaling.length_mm;
        r.jacobian.tail<3>() = residual_of.rotation() * r.jacobian.tail<3>();
        gradients.push_back({cube_of(residual_of.rotation() * residual_of.position(i), cell_mm),
                             (there ? weight : -weight) * r.residual * r.jacobian});
      }
    }
    of_link[l] = merged(std::move(gradients));
  });

  std::vector<std::uint64_t> cubes;
  for (const std::vector<PlacedGradient>& sums : of_link) {
    for (const PlacedGradient& sum : sums) cubes.push_back(sum.cube);
  }
  std::ranges::sort(cubes);
  cubes.erase(std::ranges::unique(cubes).begin(), cubes.end());
  std::vector<CellGradient> cells;
  for (std::size_t l = 0; l < of_link.size(); ++l) {
    for (const PlacedGradient& sum : of_link[l]) {
      const auto number = static_cast<std::uint32_t>(std::ranges::lower_bound(cubes, sum.cube) - cubes.begin());
      cells.push_back({number, static_cast<std::uint32_t>(l), sum.gradient});
    }
  }
  std::ranges::sort(cells, {}, [](const CellGradient& c) { return std::tuple(c.cell, c.link); });
  return cells;
}

}  // namespace asbuilt::refine
