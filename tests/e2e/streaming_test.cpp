// SPDX-License-Identifier: Apache-2.0
// A scan that does not fit into the memory it may take gives what it gives when it does.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "asbuilt/io/file.h"
#include "asbuilt/pipeline.h"
#include "asbuilt/simulate/simulate.h"
#include "support/parts.h"

namespace asbuilt {
namespace {

namespace fs = std::filesystem;

/// How far apart two poses put the part: RMS over its vertices, as for the relative pose error of architecture.md.
double rms_shift_mm(const Pose& a, const Pose& b, const TriangleMesh& part) {
  double sum = 0.0;
  for (const Eigen::Vector3d& v : part.vertices) sum += (a * b.inverse() * v - v).squaredNorm();
  return std::sqrt(sum / static_cast<double>(part.vertices.size()));
}

// Three scans of a casing, one of them without it, written into a folder of their own.
Result<simulate::Simulation> simulated_into(const fs::path& base, int points) {
  fs::remove_all(base);
  ASBUILT_TRY(
      simulation,
      simulate::simulate(test::casing(),
                         {.scans = 3, .points = points, .seed = 21, .absent_share = 0.34, .as_built = {}}, Context(2)));
  ASBUILT_CHECK(simulate::write_simulation(base, simulation));
  return std::move(simulation);
}

std::vector<std::string> scans_of(const simulate::Simulation& simulation, const fs::path& base) {
  std::vector<std::string> scans;
  for (const auto& scan : simulation.scans) scans.push_back((base / (scan.name + ".ply")).string());
  return scans;
}

TEST(Streaming, AScanForcedThroughTheSieveGivesTheSameVerdictAndNearlyTheSamePose) {
  const fs::path base = fs::path(testing::TempDir()) / "asbuilt_streaming";
  const auto simulation = simulated_into(base, 120000);
  ASSERT_TRUE(simulation) << simulation.error().message;
  const std::vector<std::string> scans = scans_of(*simulation, base);

  const auto detected = [&](double memory_gb, const std::string& output, Context context) {
    pipeline::Options options;
    options.memory_gb = memory_gb;
    return pipeline::detect((base / "model.ply").string(), scans, options, {base / output, false, {}}, context);
  };
  const auto whole = detected(8.0, "whole", Context(2));
  ASSERT_TRUE(whole) << whole.error().message;
  std::vector<std::string> warnings;
  Context context(2);
  context.warning = [&](std::string_view text) { warnings.emplace_back(text); };
  // Room for 80 000 points: too little for a scan, enough for what lies around the part.
  const auto streamed = detected(0.2176, "streamed", context);
  ASSERT_TRUE(streamed) << streamed.error().message;
  EXPECT_THAT(warnings, testing::Contains(testing::HasSubstr("points would need about 0.2 GB of memory")));

  std::size_t compared = 0;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const io::ScanRecord &a = whole->scans[i], &b = streamed->scans[i];
    EXPECT_EQ(a.status, b.status) << a.name << ": " << a.reason << " / " << b.reason;
    EXPECT_EQ(a.points, b.points);
    EXPECT_THAT(b.warnings, testing::Contains(testing::HasSubstr("Too large to be kept whole")));
    if (!a.model_from_scan || !b.model_from_scan) continue;
    ++compared;
    EXPECT_LT(rms_shift_mm(*a.model_from_scan, *b.model_from_scan, simulation->model), 0.5 * simulation->noise_sigma_mm)
        << a.name;
    // The segment is cut out of all points, not of the thinned ones.
    EXPECT_NEAR(static_cast<double>(b.segment_points) / static_cast<double>(a.segment_points), 1.0, 0.02) << a.name;
  }
  EXPECT_GE(compared, 1u) << "nothing was compared";
  fs::remove_all(base);
}

TEST(Streaming, ADenseScanIsSearchedInFewerPointsAndThePartCutOutOfAll) {
  const fs::path base = fs::path(testing::TempDir()) / "asbuilt_dense";
  const auto simulation = simulated_into(base, 150000);
  ASSERT_TRUE(simulation) << simulation.error().message;
  const std::vector<std::string> scans = scans_of(*simulation, base);

  int closer_looks = 0;
  const auto detected = [&](double search_spacing_ratio, const std::string& output, int threads) {
    pipeline::Options options;
    options.detect.search_spacing_ratio = search_spacing_ratio;
    pipeline::Output to{base / output, false, [&](std::string_view stage, std::string_view) {
                          closer_looks += stage == "look_closer" ? 1 : 0;
                        }};
    return pipeline::detect((base / "model.ply").string(), scans, options, to, Context(threads));
  };
  const auto whole = detected(0.0, "whole", 2);
  ASSERT_TRUE(whole) << whole.error().message;
  EXPECT_EQ(closer_looks, 0);
  const auto thinned = detected(0.2, "thinned", 2);
  ASSERT_TRUE(thinned) << thinned.error().message;
  EXPECT_GE(closer_looks, 1) << "nothing was thinned";

  for (std::size_t i = 0; i < scans.size(); ++i) {
    const io::ScanRecord &a = whole->scans[i], &b = thinned->scans[i];
    EXPECT_EQ(a.status, b.status) << a.name << ": " << a.reason << " / " << b.reason;
    EXPECT_EQ(a.points, b.points);
    EXPECT_NEAR(b.spacing / a.spacing, 1.0, 0.1) << a.name;
    EXPECT_TRUE(b.warnings.empty()) << b.warnings.front();
    if (!a.model_from_scan || !b.model_from_scan) continue;
    const auto& truth = simulation->scans[i].model_from_scan;
    ASSERT_TRUE(truth.has_value());
    // The part as built is not the CAD, so that no registration to the CAD comes nearer than this; see `evaluate`.
    EXPECT_LT(rms_shift_mm(*a.model_from_scan, *b.model_from_scan, simulation->model), 0.5 * simulation->noise_sigma_mm)
        << a.name;
    EXPECT_NEAR(static_cast<double>(b.segment_points) / static_cast<double>(a.segment_points), 1.0, 0.02) << a.name;
  }
  // The same bytes whatever the threads.
  ASSERT_TRUE(detected(0.2, "by_one", 1));
  for (const auto& entry : fs::recursive_directory_iterator(base / "thinned")) {
    if (!entry.is_regular_file() || entry.path().filename() == "timing.json") continue;
    const fs::path other = base / "by_one" / fs::relative(entry.path(), base / "thinned");
    EXPECT_EQ(io::read_file(entry.path()).value(), io::read_file(other).value()) << other;
  }
  fs::remove_all(base);
}

}  // namespace
}  // namespace asbuilt
