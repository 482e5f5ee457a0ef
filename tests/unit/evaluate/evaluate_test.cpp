// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/evaluate/evaluate.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "asbuilt/io/file.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/io/ply_writer.h"
#include "scenario.h"
#include "support/matchers.h"

namespace asbuilt::evaluate {
namespace {

using test::Scenario;

TEST(Evaluate, TruePosesAreAllRightWithRatioOneAndNoError) {
  const Scenario scenario("true_poses");
  const Evaluation evaluation = scenario.evaluated().value();
  EXPECT_EQ(evaluation.scans, 4U);
  EXPECT_EQ(evaluation.present, 3U);
  EXPECT_EQ(evaluation.accepted, 3U);
  EXPECT_EQ(evaluation.right, 3U);
  EXPECT_EQ(evaluation.wrong, 0U);
  EXPECT_EQ(evaluation.recall, 1.0);
  EXPECT_EQ(evaluation.precision, 1.0);
  EXPECT_NEAR(*evaluation.ratio_to_oracle, 1.0, 1e-9);
  EXPECT_NEAR(*evaluation.relative_pose_error_sigma, 0.0, 1e-9);
  // The mean distance of points with normal noise lies below sigma, and not far below.
  EXPECT_LT(*evaluation.oracle_distance_mm, evaluation.noise_sigma_mm);
  EXPECT_GT(*evaluation.oracle_distance_mm, 0.2 * evaluation.noise_sigma_mm);
}

TEST(Evaluate, ACommonMotionOfAllPosesCostsNothing) {
  Scenario scenario("common_motion");
  Vector6d twist;
  twist << 0.003, -0.002, 0.004, 0.8, -0.5, 0.3;
  for (io::ScanRecord& scan : scenario.record.scans) {
    if (scan.model_from_scan) scan.model_from_scan = pose_from_twist(twist) * *scan.model_from_scan;
  }
  const Evaluation evaluation = scenario.evaluated().value();
  EXPECT_EQ(evaluation.right, 3U);
  EXPECT_NEAR(*evaluation.ratio_to_oracle, 1.0, 1e-4);
  EXPECT_NEAR(*evaluation.relative_pose_error_sigma, 0.0, 1e-6);
  EXPECT_GT(evaluation.per_scan[scenario.first_present()].error->add_mm, 0.5);
}

TEST(Evaluate, APoseThatThePartsSymmetryMakesTheSameIsRight) {
  Scenario scenario("symmetry");
  // The truth's model made a box, centred on the origin of its frame: four rotations map it onto itself.
  const auto box = [&](const Eigen::Vector3d& size) {
    ASSERT_TRUE(io::write_mesh_ply(scenario.folder / "model.ply", simulate::box(size)));
  };
  const Pose half_turn(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitY()));
  const Pose quarter_turn(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitY()));
  io::ScanRecord& scan = scenario.record.scans[scenario.first_present()];
  const Pose truth = *scan.model_from_scan;
  box({100, 60, 40});
  scan.model_from_scan = half_turn * truth;
  EXPECT_EQ(scenario.evaluated().value().right, 3U);
  EXPECT_LT(scenario.evaluated().value().per_scan[scenario.first_present()].error->max_vertex_mm, 0.5);
  scan.model_from_scan = quarter_turn * truth;
  EXPECT_EQ(scenario.evaluated().value().wrong, 1U);
}

TEST(Evaluate, RelativePoseErrorOfOppositeShiftsIsTheirWeightedSpread) {
  Scenario scenario("opposite_shifts", 0.5);  // two scans with the part
  const double shift = 0.4;
  std::vector<double> counts;
  for (std::size_t i = 0; i < 4; ++i) {
    auto& pose = scenario.record.scans[i].model_from_scan;
    if (!pose) continue;
    pose = Pose(Eigen::Translation3d(counts.empty() ? shift : -shift, 0, 0)) * *pose;
    counts.push_back(static_cast<double>(std::ranges::count(scenario.simulation.scans[i].labels, 1)));
  }
  ASSERT_EQ(counts.size(), 2U);
  // If G could only shift: two clusters 2 s apart with shares p and 1 - p spread by 2 s sqrt(p (1 - p)).
  // A turn of G lets it take off a little more where the scans see different sides.
  const double p = counts[0] / (counts[0] + counts[1]), most = 2.0 * shift * std::sqrt(p * (1.0 - p));
  const Evaluation evaluation = scenario.evaluated().value();
  EXPECT_LE(*evaluation.relative_pose_error_mm, most + 1e-9);
  EXPECT_GT(*evaluation.relative_pose_error_mm, 0.5 * most);
  EXPECT_NEAR(*evaluation.relative_pose_error_sigma, *evaluation.relative_pose_error_mm / evaluation.noise_sigma_mm,
              1e-12);
  EXPECT_GT(*evaluation.ratio_to_oracle, 1.1);
}

TEST(Evaluate, RightEndsAtTwoPercentOfTheDiameter) {
  for (const double share : {0.0199, 0.0201}) {
    Scenario scenario("tolerance");
    auto& pose = *scenario.record.scans[scenario.first_present()].model_from_scan;
    pose = Pose(Eigen::Translation3d(0, share * diameter(scenario.simulation.model), 0)) * pose;
    const Evaluation evaluation = scenario.evaluated().value();
    EXPECT_EQ(evaluation.right, share < 0.02 ? 3U : 2U);
    EXPECT_EQ(evaluation.wrong, share < 0.02 ? 0U : 1U);
  }
}

TEST(Evaluate, AnAcceptedPoseWhereThePartIsNotIsWrong) {
  Scenario scenario("absent");
  for (io::ScanRecord& scan : scenario.record.scans) {
    scan.status = io::ScanStatus::accepted;
    if (!scan.model_from_scan) scan.model_from_scan = Pose::Identity();
  }
  const Evaluation evaluation = scenario.evaluated().value();
  EXPECT_EQ(evaluation.accepted, 4U);
  EXPECT_EQ(evaluation.wrong, 1U);
  EXPECT_DOUBLE_EQ(*evaluation.precision, 0.75);
  EXPECT_DOUBLE_EQ(*evaluation.recall, 1.0);
}

TEST(Evaluate, MissingAndRejectedScansLowerRecallOnly) {
  Scenario scenario("missing");
  const std::size_t first = scenario.first_present();
  scenario.record.scans.erase(scenario.record.scans.begin() + static_cast<std::ptrdiff_t>(first));
  const Evaluation evaluation = scenario.evaluated().value();
  EXPECT_EQ(evaluation.per_scan[first].status, "missing");
  EXPECT_DOUBLE_EQ(*evaluation.recall, 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(*evaluation.precision, 1.0);
}

TEST(Evaluate, DisconnectedScansAreNotAcceptedButTold) {
  Scenario scenario("disconnected");
  scenario.record.scans[scenario.first_present()].status = io::ScanStatus::disconnected;
  const Evaluation evaluation = scenario.evaluated().value();
  EXPECT_EQ(evaluation.accepted, 2U);
  EXPECT_EQ(evaluation.disconnected_right, 1U);
}

TEST(Evaluate, NothingAcceptedHasNoRatio) {
  Scenario scenario("nothing");
  for (io::ScanRecord& scan : scenario.record.scans) {
    scan.status = io::ScanStatus::rejected;
    scan.model_from_scan.reset();
  }
  const Evaluation evaluation = scenario.evaluated().value();
  EXPECT_FALSE(evaluation.ratio_to_oracle.has_value());
  EXPECT_FALSE(evaluation.precision.has_value());
  EXPECT_EQ(evaluation.recall, 0.0);
  EXPECT_TRUE(nlohmann::json::parse(to_json(evaluation))["ratio_to_oracle"].is_null());
}

// A second placement in the first scan that shows the part: in the truth, and in the result if it was looked for.
struct TwoPlacements : Scenario {
  Pose second_pose;
  std::size_t index = first_present();

  explicit TwoPlacements(const std::string& name) : Scenario(name) {
    second_pose = Pose(Eigen::Translation3d(300, 0, 0)) * *simulation.scans[index].model_from_scan;
    simulation.scans[index].other_placements.push_back({second_pose, 2, 0.5, 0.1});
    EXPECT_TRUE(simulate::write_simulation(folder, simulation).has_value());
  }
  void find_all() {
    record.options.emplace_back("instances", std::string("all"));
    io::ScanRecord entry = record.scans[index];
    entry.instance = 2;
    entry.model_from_scan = second_pose;
    record.scans.insert(record.scans.begin() + static_cast<std::ptrdiff_t>(index) + 1, entry);
  }
};

TEST(Evaluate, EitherOfTwoPlacementsIsRightWhenOneIsWanted) {
  TwoPlacements scenario("one_of_two");
  EXPECT_EQ(scenario.evaluated()->present, 3U);
  EXPECT_EQ(scenario.evaluated()->right, 3U);
  scenario.record.scans[scenario.index].model_from_scan = scenario.second_pose;
  const Evaluation evaluation = scenario.evaluated().value();
  EXPECT_EQ(evaluation.right, 3U);
  EXPECT_EQ(evaluation.wrong, 0U);
  EXPECT_DOUBLE_EQ(evaluation.per_scan[scenario.index].hidden, 0.1);
}

TEST(Evaluate, EveryPlacementCountsWhenAllAreWanted) {
  TwoPlacements scenario("two_of_two");
  scenario.find_all();
  Evaluation evaluation = scenario.evaluated().value();
  EXPECT_EQ(evaluation.scans, 4U);
  EXPECT_EQ(evaluation.present, 4U);
  EXPECT_EQ(evaluation.right, 4U);
  EXPECT_EQ(evaluation.per_scan[scenario.index + 1].name, evaluation.per_scan[scenario.index].name + "#2");

  // In another order they are the same two.
  std::swap(scenario.record.scans[scenario.index].model_from_scan,
            scenario.record.scans[scenario.index + 1].model_from_scan);
  EXPECT_EQ(scenario.evaluated()->right, 4U);

  // One of them missing lowers recall; the same one twice is wrong.
  scenario.record.scans[scenario.index].model_from_scan = scenario.record.scans[scenario.index + 1].model_from_scan;
  evaluation = scenario.evaluated().value();
  EXPECT_EQ(evaluation.right, 3U);
  EXPECT_EQ(evaluation.wrong, 1U);
  scenario.record.scans.erase(scenario.record.scans.begin() + static_cast<std::ptrdiff_t>(scenario.index) + 1);
  evaluation = scenario.evaluated().value();
  EXPECT_EQ(evaluation.present, 4U);
  EXPECT_EQ(evaluation.right, 3U);
  EXPECT_EQ(evaluation.wrong, 0U);
  EXPECT_EQ(evaluation.per_scan[scenario.index + 1].status, "missing");
}

TEST(Evaluate, SegmentsAreJudgedPointByPoint) {
  Scenario scenario("segments");
  const std::size_t index = scenario.first_present();
  const simulate::SimulatedScan& scan = scenario.simulation.scans[index];
  // Every other point of the part, as many points of other things as half of those, and a margin that must not count.
  std::vector<float> x, y, z;
  std::vector<std::uint8_t> part;
  const auto add = [&](std::size_t i, int flag) {
    x.push_back(scan.points_in_scan[i].x());
    y.push_back(scan.points_in_scan[i].y());
    z.push_back(scan.points_in_scan[i].z());
    part.push_back(static_cast<std::uint8_t>(flag));
  };
  std::size_t seen = 0, taken = 0, others = 0;
  for (std::size_t i = 0; i < scan.labels.size(); ++i) {
    if (scan.labels[i] == 1 && seen++ % 2 == 0) add(i, ++taken > 0);
  }
  for (std::size_t i = 0; i < scan.labels.size(); ++i) {
    if (scan.labels[i] != 1) add(i, 2 * others < taken ? (++others, 1) : 0);
  }
  scenario.record.scans[index].segment_points = taken + others;
  const auto file = scenario.folder / "result" / io::segment_file(index, scan.name);
  std::filesystem::create_directories(file.parent_path());
  const std::vector<io::PlyColumn> columns{{"x", std::span<const float>(x)},
                                           {"y", std::span<const float>(y)},
                                           {"z", std::span<const float>(z)},
                                           {"part", std::span<const std::uint8_t>(part)}};
  ASSERT_TRUE(io::write_ply(file, columns).has_value());
  const Evaluation evaluation = scenario.evaluated().value();
  EXPECT_NEAR(*evaluation.per_scan[index].segment_precision,
              static_cast<double>(taken) / static_cast<double>(taken + others), 1e-12);
  EXPECT_NEAR(*evaluation.per_scan[index].segment_recall, static_cast<double>(taken) / static_cast<double>(seen),
              1e-12);
}

TEST(Evaluate, TheReconstructionIsHeldAgainstTheTrueSurface) {
  Scenario scenario("reconstruction");
  // True poses but for one motion of all; the cloud is the union of the part's points, and three that fly.
  Vector6d twist;
  twist << 0.003, -0.002, 0.004, 0.8, -0.5, 0.3;
  const Pose motion = pose_from_twist(twist);
  std::array<std::vector<float>, 3> columns;
  const auto add = [&](const Eigen::Vector3d& point_in_model) {
    const Eigen::Vector3d moved = motion * point_in_model;
    for (Eigen::Index c = 0; c < 3; ++c) columns[static_cast<std::size_t>(c)].push_back(static_cast<float>(moved[c]));
  };
  for (std::size_t s = 0; s < scenario.simulation.scans.size(); ++s) {
    const simulate::SimulatedScan& scan = scenario.simulation.scans[s];
    if (!scan.model_from_scan) continue;
    scenario.record.scans[s].model_from_scan = motion * *scan.model_from_scan;
    for (std::size_t i = 0; i < scan.labels.size(); ++i) {
      if (scan.labels[i] == 1) add(*scan.model_from_scan * scan.points_in_scan[i].cast<double>());
    }
  }
  const std::size_t points = columns[0].size();
  EXPECT_FALSE(scenario.evaluated().value().reconstruction_beyond_share);  // there is none yet
  const auto write = [&] {
    std::vector<io::PlyColumn> ply;
    for (std::size_t c = 0; c < 3; ++c) ply.push_back({std::string(1, "xyz"[c]), std::span<const float>(columns[c])});
    std::filesystem::create_directories(scenario.folder / "result");
    ASSERT_TRUE(io::write_ply(scenario.folder / "result" / "reconstruction.ply", ply).has_value());
  };
  write();
  const Evaluation true_points = scenario.evaluated().value();
  EXPECT_EQ(true_points.reconstruction_points, points);
  EXPECT_EQ(*true_points.reconstruction_beyond_share, *true_points.oracle_beyond_share);
  EXPECT_EQ(*true_points.reconstruction_completeness, 1.0);

  for (int i = 1; i <= 3; ++i) add(Eigen::Vector3d(0, 0, 500.0 * i));
  write();
  const Evaluation flying = scenario.evaluated().value();
  EXPECT_EQ(flying.reconstruction_points, points + 3);
  EXPECT_EQ(flying.reconstruction_beyond, true_points.reconstruction_beyond + 3);
  EXPECT_EQ(*flying.oracle_beyond_share, *true_points.oracle_beyond_share);
  EXPECT_EQ(nlohmann::json::parse(to_json(flying))["reconstruction_beyond"], flying.reconstruction_beyond);

  for (auto& column : columns) column.resize(points / 3);
  write();
  const Evaluation in_part = scenario.evaluated().value();
  EXPECT_LT(*in_part.reconstruction_completeness, 0.95);
  EXPECT_GT(*in_part.reconstruction_completeness, 0.1);
}

TEST(Evaluate, TwoScansOfOneNameAndForeignResultsAreErrors) {
  Scenario scenario("names");
  scenario.record.scans[1].path = "elsewhere/scan_00.ply";
  EXPECT_THAT(scenario.evaluated(), test::FailsWith(ErrorCode::not_possible));
  for (io::ScanRecord& scan : scenario.record.scans) scan.path = "other_" + scan.name + ".ply";
  EXPECT_THAT(scenario.evaluated(), test::FailsWith(ErrorCode::not_possible));
}

TEST(Evaluate, ReadsTheResultFolderAndWritesJsonAndATable) {
  Scenario scenario("folder");
  std::filesystem::create_directories(scenario.folder / "result");
  EXPECT_THAT(evaluate(scenario.folder, scenario.folder / "result", {}, Context(1)),
              test::FailsWith(ErrorCode::unreadable_input));
  ASSERT_TRUE(io::write_file(scenario.folder / "result" / "result.json", io::to_json(scenario.record)).has_value());
  const Evaluation evaluation =
      evaluate(scenario.folder / "truth.json", scenario.folder / "result", {}, Context(1)).value();
  const auto json = nlohmann::json::parse(to_json(evaluation));
  EXPECT_EQ(json["accepted"], 3);
  EXPECT_EQ(json["present"], 3);
  EXPECT_EQ(json["wrong"], 0);
  EXPECT_NEAR(json["ratio_to_oracle"].get<double>(), 1.0, 1e-9);
  EXPECT_EQ(json["per_scan"].size(), 4U);
  EXPECT_THAT(to_table(evaluation), testing::HasSubstr("accepted 3 of 3"));
}

TEST(Evaluate, AToleranceThatMakesNoSenseIsAnError) {
  const Scenario scenario("options");
  const Truth truth = read_truth(scenario.folder).value();
  EXPECT_THAT(evaluate(truth, scenario.record, scenario.folder, EvaluateOptions{0.0}, Context(1)),
              test::FailsWith(ErrorCode::invalid_argument));
}

}  // namespace
}  // namespace asbuilt::evaluate
