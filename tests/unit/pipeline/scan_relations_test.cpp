// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/scan_relations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "asbuilt/core/random.h"
#include "asbuilt/simulate/parts.h"
#include "asbuilt/verify/near_poses.h"

namespace asbuilt::pipeline {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kRadius = 50.0, kHeight = 40.0, kSigma = 0.1;  // mm
constexpr double kNearEqual = 0.01;                             // of the diameter; the ribs stand out by less
const Eigen::Vector3d kAxis = Eigen::Vector3d::UnitZ();

constexpr double kPeriod = 2.0 * kPi / 10.0;

// Ten ribs, 5 mm wide and 0.75 mm high, around a drum.
double rib(double angle) {
  return 0.75 * std::clamp(3.0 - std::abs(std::remainder(angle, kPeriod) * kRadius), 0.0, 1.0);
}

const LoadedModel& drum() {
  static const LoadedModel model = [] {
    std::vector<Eigen::Vector2d> outline;
    constexpr int kSides = 900;
    for (int i = 0; i < kSides; ++i) {
      const double angle = 2.0 * kPi * i / kSides, radius = kRadius + rib(angle);
      outline.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
    }
    LoadedModel loaded;
    loaded.prepared = model::prepare(simulate::extruded(outline, kHeight), {}, Context(2)).value();
    return loaded;
  }();
  return model;
}

// What is seen of the drum from one side, or, of one that shows no rib, of its end; at a pose that is turned `off_rad`
// too far.
PosedScan scan_of(int index, double from_rad, bool shows_ribs, double off_rad) {
  PosedScan scan;
  scan.index = index;
  scan.noise_sigma_mm = kSigma;
  Random random(static_cast<std::uint64_t>(index), "drum", 0);
  for (int i = 0; i < 12000; ++i) {
    const double angle = from_rad + random.uniform(-1.2, 1.2);
    const Eigen::Vector3d outwards(std::cos(angle), std::sin(angle), 0.0);
    const double noise = kSigma * random.normal(), across = random.uniform(0.0, 1.0);
    const Eigen::Vector3d normal = shows_ribs ? outwards : kAxis;
    const Eigen::Vector3d point = shows_ribs
                                      ? (kRadius + rib(angle) + noise) * outwards + (across - 0.5) * kHeight * kAxis
                                      : 0.9 * kRadius * std::sqrt(across) * outwards + (0.5 * kHeight + noise) * kAxis;
    scan.part.positions.push_back(point.cast<float>());
    scan.part.normals.push_back(normal.cast<float>());
  }
  scan.model_from_local_detected = Pose(Eigen::AngleAxisd(off_rad, kAxis));
  return scan;
}

io::RunRecord record_of(std::size_t scans) {
  io::RunRecord record;
  record.scans.resize(scans);
  for (io::ScanRecord& scan : record.scans) scan.status = io::ScanStatus::accepted;
  return record;
}

double turn_off_mm(const PosedScan& scan) {
  const Eigen::Matrix3d turn = scan.model_from_local_detected.linear();
  return std::abs(std::remainder(std::atan2(turn(1, 0), turn(0, 0)), kPeriod)) * kRadius;
}

TEST(ChooseTurns, BringsScansToTheirRibsAndTakesOutWhatShowsNone) {
  ASSERT_TRUE(verify::turns_are_nearly_equal(drum().prepared, kNearEqual));
  std::vector<PosedScan> scans{scan_of(0, 0.5, true, 0.21), scan_of(1, 1.0, false, 0.4), scan_of(2, 3.0, true, -1.1)};
  io::RunRecord record = record_of(3);
  ASSERT_TRUE(choose_turns(scans, drum(), kNearEqual, record, Context(2)));
  ASSERT_EQ(scans.size(), 2U);
  EXPECT_EQ(scans[0].index, 0);
  EXPECT_EQ(scans[1].index, 2);
  for (const PosedScan& scan : scans) EXPECT_LT(turn_off_mm(scan), 0.003 * drum().prepared.diameter) << scan.index;
  EXPECT_EQ(record.scans[0].status, io::ScanStatus::accepted);
  EXPECT_EQ(record.scans[1].status, io::ScanStatus::ambiguous);
  EXPECT_EQ(record.scans[1].reason_code, "symmetry");
  EXPECT_NE(record.scans[1].reason.find("turn"), std::string::npos);
}

// One scan with ribs tells nothing about the others: all stay, and all say so.
TEST(ChooseTurns, TakesNothingOutWhereFewerThanTwoShowTheirs) {
  std::vector<PosedScan> scans{scan_of(0, 0.5, true, 0.0), scan_of(1, 1.0, false, 0.4), scan_of(2, 3.0, false, 0.2)};
  io::RunRecord record = record_of(3);
  ASSERT_TRUE(choose_turns(scans, drum(), kNearEqual, record, Context(2)));
  EXPECT_EQ(scans.size(), 3U);
  for (const io::ScanRecord& scan : record.scans) {
    EXPECT_EQ(scan.status, io::ScanStatus::accepted);
    EXPECT_EQ(scan.reason_code, "symmetry");
  }
}

LoadedModel round_model(bool sphere) {
  LoadedModel loaded;
  loaded.prepared.symmetry.kind = sphere ? model::SymmetryGroup::Kind::sphere : model::SymmetryGroup::Kind::revolution;
  return loaded;
}

TEST(ChooseTurns, SaysOfRoundPartsThatNobodyKnowsHowScansAreTurned) {
  for (const bool sphere : {false, true}) {
    std::vector<PosedScan> scans(3);
    for (int i = 0; i < 3; ++i) scans[static_cast<std::size_t>(i)].index = i;
    io::RunRecord record = record_of(3);
    record.scans[1].reason_code = "accepted_by_user";
    ASSERT_TRUE(choose_turns(scans, round_model(sphere), kNearEqual, record, Context(1)));
    EXPECT_EQ(scans.size(), 3U) << "the surface is the same at any turn: nothing is left out";
    for (const int other : {0, 2}) {
      const io::ScanRecord& scan = record.scans[static_cast<std::size_t>(other)];
      EXPECT_EQ(scan.status, io::ScanStatus::accepted);
      EXPECT_EQ(scan.reason_code, "symmetry");
      EXPECT_NE(scan.reason.find(sphere ? "its centre" : "its axis"), std::string::npos) << scan.reason;
    }
    EXPECT_EQ(record.scans[1].reason_code, "accepted_by_user");
  }
  std::vector<PosedScan> alone(1);
  io::RunRecord record = record_of(1);
  ASSERT_TRUE(choose_turns(alone, round_model(false), kNearEqual, record, Context(1)));
  EXPECT_TRUE(record.scans[0].reason_code.empty()) << "one scan is turned against nobody";
}

TEST(ChooseTurns, LeavesAloneWhatTheUserVouchesForAndPartsWhoseTurnsDiffer) {
  std::vector<PosedScan> scans{scan_of(0, 0.5, true, 0.21), scan_of(1, 3.0, true, 0.4)};
  io::RunRecord record = record_of(2);
  record.scans[0].reason_code = "accepted_by_user";
  ASSERT_TRUE(choose_turns(scans, drum(), kNearEqual, record, Context(2)));
  EXPECT_NEAR(turn_off_mm(scans[0]), 0.21 * kRadius, 1e-6) << "vouched for";
  EXPECT_LT(turn_off_mm(scans[1]), 0.003 * drum().prepared.diameter);
  scans[1].model_from_local_detected = Pose(Eigen::AngleAxisd(0.4, kAxis));
  ASSERT_TRUE(choose_turns(scans, drum(), 0.001, record, Context(2)));
  EXPECT_NEAR(turn_off_mm(scans[1]), (kPeriod - 0.4) * kRadius, 1e-6) << "ribs of 0.7 % are not nearly equal to 0.1 %";
}

}  // namespace
}  // namespace asbuilt::pipeline
