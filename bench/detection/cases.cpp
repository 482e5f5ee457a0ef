// SPDX-License-Identifier: Apache-2.0
#include "cases.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "asbuilt/core/median.h"
#include "asbuilt/core/random.h"
#include "asbuilt/simulate/as_built.h"
#include "asbuilt/simulate/mesh_edit.h"
#include "asbuilt/simulate/resting.h"
#include "asbuilt/simulate/simulate.h"

namespace asbuilt::bench {
namespace {

constexpr std::uint64_t kPresentOf = 4, kCycle = 6;
constexpr std::array kAbsentContents{Content::clutter, Content::smaller, Content::larger, Content::mirrored,
                                     Content::family};
constexpr std::uint64_t kAttempts = 5;
constexpr double kStratumMargin = 0.02;  // asked for inside the bounds, since the simulator meets them only about
constexpr double kSmaller = 0.75, kLarger = 1.3;
constexpr double kLargestDeviation = 0.005;  // of the diameter, warp, dents and scale together

// Warp, dents and scale share what the case deviates by.
simulate::AsBuiltOptions drawn_deviation(Random& random) {
  const double total = random.uniform(0.0, kLargestDeviation), warp = random.uniform(), bump = random.uniform(),
               scale = random.uniform();
  const double unit = total / (warp + bump + scale);
  simulate::AsBuiltOptions options;
  options.warp_ratio = warp * unit;
  options.bump_height_ratio = bump * unit;
  options.bump_radius_ratio = random.uniform(0.03, 0.08);
  options.dents = 1 + static_cast<int>(random.below(3));
  options.bosses = static_cast<int>(random.below(2));
  // A corner lies half a diameter from the centre, so a size off by x moves it by x / 2 diameters.
  options.scale = 1.0 + (random.uniform() < 0.5 ? -2.0 : 2.0) * scale * unit;
  return options;
}

simulate::SimulateOptions drawn_options(std::uint64_t seed, const Stratum& stratum, double point_share) {
  Random random(seed, "case", 0);
  simulate::SimulateOptions options;
  options.scans = 1;
  const bool laser = random.uniform() < 0.35;
  options.sensor = laser ? "laser-scanner" : "structured-light";
  // A laser scanner spends most of its points on the hall.
  const double points = (laser ? 2.0 : 1.0) * random.uniform(60e3, 150e3) * point_share;
  options.points = std::max(1000, static_cast<int>(points));
  const double pose = random.uniform();
  options.pose = pose < 0.6 ? "resting" : pose < 0.8 ? "any" : "upright";
  options.noise_ratio = 0.0002 * std::pow(15.0, random.uniform());  // 0.02 to 0.3 % of the diameter
  options.clutter_objects = 2 + static_cast<int>(random.below(13));
  options.clutter_low = 0.3;
  options.clutter_high = 0.97;
  options.floor = laser || random.uniform() < 0.8;
  options.walls = random.uniform() < 0.2;
  options.hidden_low = stratum.low == 0.0 ? 0.0 : stratum.low + kStratumMargin;
  options.hidden_high = stratum.high - kStratumMargin;
  options.as_built = drawn_deviation(random);
  return options;
}

// Another part of the family, or of the list where there is none; as large as the part.
TriangleMesh relative_of(const Case& the_case, std::span<const SuitePart> parts) {
  const SuitePart& part = parts[the_case.part];
  std::vector<std::size_t> relatives, others;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (i == the_case.part) continue;
    (parts[i].family == part.family ? relatives : others).push_back(i);
  }
  const std::vector<std::size_t>& candidates = relatives.empty() ? others : relatives;
  if (candidates.empty()) return {};
  Random random(the_case.seed, "relative", 0);
  const TriangleMesh& mesh = parts[candidates[random.below(candidates.size())]].mesh;
  return simulate::scaled(mesh, Eigen::Vector3d::Constant(diameter(part.mesh) / diameter(mesh)));
}

TriangleMesh decoy_of(const Case& the_case, std::span<const SuitePart> parts) {
  const TriangleMesh& mesh = parts[the_case.part].mesh;
  switch (the_case.content) {
    case Content::smaller:
      return simulate::scaled(mesh, Eigen::Vector3d::Constant(kSmaller));
    case Content::larger:
      return simulate::scaled(mesh, Eigen::Vector3d::Constant(kLarger));
    case Content::mirrored:
      return simulate::scaled(mesh, {-1.0, 1.0, 1.0});
    case Content::family:
      return relative_of(the_case, parts);
    case Content::part:
    case Content::clutter:
      break;
  }
  return {};
}

}  // namespace

const char* name_of(Content content) {
  constexpr const char* kNames[] = {"part", "clutter", "smaller", "larger", "mirrored", "family"};
  return kNames[static_cast<std::size_t>(content)];
}

std::size_t stratum_of(double hidden) {
  if (hidden < kStrata[0].high) return 0;
  if (hidden < kStrata[1].high) return 1;
  return hidden <= kStrata[2].high ? 2 : kStrataCount;
}

Case case_of(std::uint64_t seed, std::span<const SuitePart> parts, double point_share) {
  ASBUILT_EXPECT(!parts.empty(), "at least one part");
  const std::uint64_t cycle = seed / kCycle, slot = seed % kCycle;
  const bool present = slot < kPresentOf;
  // Number of the case among those of its kind; the part goes round with it, the rest with each round of the parts.
  const std::uint64_t number = present ? cycle * kPresentOf + slot : cycle * (kCycle - kPresentOf) + slot - kPresentOf;
  const std::uint64_t part = number % parts.size(), turn = part + number / parts.size();

  Case result;
  result.seed = seed;
  result.part = static_cast<std::size_t>(part);
  result.stratum = present ? static_cast<std::size_t>(turn % kStrataCount) : 0;
  result.content = present ? Content::part : kAbsentContents[turn % kAbsentContents.size()];
  if (result.content == Content::mirrored && parts[result.part].is_own_mirror) result.content = Content::family;
  result.options = drawn_options(seed, kStrata[result.stratum], point_share);
  result.options.absent_share = present ? 0.0 : 1.0;
  return result;
}

Result<CaseScan> scan_of(const Case& the_case, std::span<const SuitePart> parts, const Context& context) {
  const TriangleMesh& mesh = parts[the_case.part].mesh;
  std::vector<TriangleMesh> decoys;
  if (TriangleMesh decoy = decoy_of(the_case, parts); !decoy.empty()) {
    // A decoy is as imperfectly made as the part would be.
    ASBUILT_TRY(built, simulate::as_built(decoy, the_case.options.as_built, the_case.seed));
    decoys.push_back(std::move(built.mesh));
  }
  simulate::SimulateOptions options = the_case.options;
  CaseScan result;
  for (std::uint64_t attempt = 0; attempt < kAttempts; ++attempt) {
    options.seed = Random(the_case.seed, "simulate", attempt).bits() >> 1;
    ASBUILT_TRY(simulation, simulate::simulate(mesh, options, context, decoys));
    simulate::SimulatedScan& scan = simulation.scans.front();
    result = {{},
              scan.model_from_scan,
              scan.hidden,
              scan.occlusion,
              scan.clutter,
              0,
              simulation.deviation_max_mm / diameter(mesh)};
    result.part_points = static_cast<std::size_t>(std::ranges::count(scan.labels, simulate::Label::kPart));
    result.points_in_scan.positions = std::move(scan.points_in_scan);
    if (the_case.content != Content::part || stratum_of(scan.hidden) == the_case.stratum) break;
  }
  return result;
}

CaseScan moved(const CaseScan& scan, std::uint64_t seed) {
  Random random(seed, "moved", 0);
  const Eigen::Matrix3d turn = simulate::random_rotation(random);
  std::vector<float> ranges;
  for (const Eigen::Vector3f& point : scan.points_in_scan.positions) ranges.push_back(point.norm());
  const double range_mm = ranges.empty() ? 0.0 : static_cast<double>(median_of(std::move(ranges)));
  Eigen::Vector3d shift_mm;
  for (double& axis : shift_mm) axis = random.uniform(-5.0, 5.0) * range_mm;
  Pose moved_from_scan = Pose::Identity();
  moved_from_scan.linear() = turn;
  moved_from_scan.translation() = shift_mm;

  CaseScan result = scan;
  for (Eigen::Vector3f& point : result.points_in_scan.positions) {
    point = (moved_from_scan * point.cast<double>()).cast<float>();
  }
  if (result.model_from_scan) result.model_from_scan = *result.model_from_scan * moved_from_scan.inverse();
  return result;
}

}  // namespace asbuilt::bench
