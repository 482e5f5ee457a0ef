// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/viewpoint_search.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "asbuilt/core/median.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/random.h"
#include "asbuilt/scan/shadow_image.h"

namespace asbuilt::scan {
namespace {

using Position = Eigen::Vector3d;

struct Sharpened {
  Position from;
  Shadows shadows, shadows_of_rival;
};

// Moves the viewpoint along the line of sight and across it, in ever smaller steps, while the shadows fit better.
Sharpened sharpened(std::span<const Eigen::Vector3f> points, const PointDensity::Fit& fit, double noise_sigma_mm,
                    const std::optional<Position>& rival, const Context& context) {
  constexpr double kCellInSteps = 1.5;  // of the sensor's angle: on a continuous surface hardly a cell is empty
  constexpr double kJumpInSteps = 6.0, kJumpInSigmas = 6.0;
  constexpr double kFirstStep = 0.03, kLastStep = 0.001, kFarthest = 0.25;  // of the range
  Position middle = Position::Zero();
  std::vector<double> ranges;
  for (const Eigen::Vector3f& point : points) {
    middle += point.cast<double>() / static_cast<double>(points.size());
    ranges.push_back((point.cast<double>() - fit.position_in_scan).norm());
  }
  const double range = median_of(std::move(ranges));
  const double angle = std::exp(-0.5 * fit.log_rate), cell = kCellInSteps * angle;
  const DepthJump jump{static_cast<float>(kJumpInSteps * angle), static_cast<float>(kJumpInSigmas * noise_sigma_mm)};
  Eigen::Matrix3d axes;
  axes.col(0) = (middle - fit.position_in_scan).normalized();
  if (axes.col(0).isZero(0.5)) axes.col(0) = Eigen::Vector3d::UnitX();
  axes.col(1) = axes.col(0).unitOrthogonal();
  axes.col(2) = axes.col(0).cross(axes.col(1));

  std::vector<ShadowImage> images(6, ShadowImage(points));
  Sharpened best{fit.position_in_scan, images[0].seen_from(fit.position_in_scan, cell, jump), {}};
  std::array<Sharpened, 6> tried;
  constexpr int kMostMoves = 100;
  double step = kFirstStep * range;
  for (int move = 0; move < kMostMoves && step > kLastStep * range && !context.cancelled(); ++move) {
    parallel_for(context, tried.size(), 1, [&](std::size_t t) {
      const auto axis = static_cast<Eigen::Index>(t / 2);
      tried[t].from = best.from + (t % 2 == 0 ? step : -step) * axes.col(axis);
      tried[t].shadows = images[t].seen_from(tried[t].from, cell, jump);
    });
    const Sharpened& next = *std::ranges::min_element(tried, {}, [](const Sharpened& s) { return s.shadows.misfit(); });
    if (next.shadows.misfit() < best.shadows.misfit() &&
        (next.from - fit.position_in_scan).norm() < kFarthest * range) {
      best = next;
    } else {
      step *= 0.5;
    }
  }
  if (rival) best.shadows_of_rival = images[0].seen_from(*rival, cell, jump);
  return best;
}

std::vector<Eigen::Vector3f> drawn(std::span<const Eigen::Vector3f> points, std::size_t most) {
  if (points.size() <= most) return {points.begin(), points.end()};
  Random random(0, "viewpoint search", points.size());
  std::vector<Eigen::Vector3f> chosen;
  const double share = static_cast<double>(most) / static_cast<double>(points.size());
  for (const Eigen::Vector3f& point : points) {
    if (random.uniform() < share) chosen.push_back(point);
  }
  return chosen;
}

}  // namespace

std::optional<FoundViewpoint> find_viewpoint(std::span<const Eigen::Vector3f> points, const PointDensity& density,
                                             double noise_sigma_mm, const std::optional<Position>& rival_in_scan,
                                             const Context& context) {
  constexpr std::size_t kMostImagePoints = 400000;
  // Of scans with a known viewpoint, and of merged and thinned clouds; docs/scan.md, section 4.
  constexpr double kMostMisfit = 0.2, kMostMisfitToEven = 0.6, kMostHidden = 0.05;
  if (!density.known()) return std::nullopt;
  const double most_misfit = std::min(kMostMisfit, kMostMisfitToEven * density.misfit_of_even());
  const std::vector<Eigen::Vector3f> seen = drawn(points, kMostImagePoints);
  const double log_thinning = std::log(static_cast<double>(points.size()) / static_cast<double>(seen.size()));
  std::optional<FoundViewpoint> best;
  for (PointDensity::Fit fit : density.fits(context)) {
    if (fit.misfit > most_misfit) continue;
    fit.log_rate -= log_thinning;
    const Sharpened sharp = sharpened(seen, fit, noise_sigma_mm, rival_in_scan, context);
    if (best && sharp.shadows.misfit() >= best->shadows.misfit()) continue;
    best = {sharp.from, fit.misfit, sharp.shadows, sharp.shadows_of_rival};
  }
  if (context.cancelled() || (best && best->shadows.hidden > kMostHidden)) return std::nullopt;
  return best;
}

}  // namespace asbuilt::scan
