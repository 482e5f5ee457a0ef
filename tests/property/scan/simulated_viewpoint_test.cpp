// SPDX-License-Identifier: Apache-2.0
// Does `automatic` find out where a scan was taken? Simulated scans have their sensor at the origin.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "asbuilt/core/median.h"
#include "asbuilt/scan/scan.h"
#include "asbuilt/simulate/simulate.h"
#include "support/parts.h"

namespace asbuilt::scan {
namespace {

std::vector<simulate::SimulatedScan> scans_by(const std::string& sensor) {
  simulate::SimulateOptions options;
  options.scans = 3;
  options.points = 20000;
  options.sensor = sensor;
  options.clutter_objects = 5;
  options.clutter_low = 0.0;
  options.clutter_high = 1.0;
  options.seed = 11;
  return simulate::simulate(test::stepped_block(), options, Context(2)).value().scans;
}

Scan prepared(const std::vector<Eigen::Vector3f>& points, const Pose& moved) {
  PointCloud raw;
  for (const Eigen::Vector3f& p : points) raw.positions.push_back((moved * p.cast<double>()).cast<float>());
  return prepare_scan(raw, std::nullopt, {}, {}, Context(2)).value();
}

class AutomaticViewpoint : public testing::TestWithParam<std::string> {};

TEST_P(AutomaticViewpoint, AcceptsTheTrueOne) {
  for (const simulate::SimulatedScan& simulated : scans_by(GetParam())) {
    const Scan scan = prepared(simulated.points_in_scan, Pose::Identity());
    EXPECT_EQ(scan.viewpoint.kind, Viewpoint::Kind::point) << simulated.name;
    EXPECT_TRUE(scan.viewpoint.value.isZero(0.0)) << simulated.name;
    EXPECT_THAT(scan.warnings, testing::IsEmpty()) << simulated.name;
  }
}

// The same scan in other frames: the origin is where `eye` was.
Pose origin_at(const Eigen::Vector3d& eye) { return Pose(Eigen::Translation3d(-eye)); }

Eigen::Vector3d middle_of(const std::vector<Eigen::Vector3f>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& p : points) sum += p.cast<double>();
  return sum / static_cast<double>(points.size());
}

double median_range(const std::vector<Eigen::Vector3f>& points) {
  std::vector<float> ranges;
  for (const Eigen::Vector3f& p : points) ranges.push_back(p.norm());
  return static_cast<double>(median_of(std::move(ranges)));
}

TEST(SimulatedViewpoint, IsFoundWhereTheOriginIsBesideTheScene) {
  for (const simulate::SimulatedScan& simulated : scans_by("structured-light")) {
    const Eigen::Vector3d middle = middle_of(simulated.points_in_scan);
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector3d beside = middle + Eigen::Vector3d(side * middle.norm(), 0.0, 0.0);
      const Scan scan = prepared(simulated.points_in_scan, origin_at(beside));
      ASSERT_EQ(scan.viewpoint_source, ViewpointSource::points) << simulated.name;
      EXPECT_LT((scan.viewpoint.value + beside).norm(), 0.15 * median_range(simulated.points_in_scan))
          << simulated.name;
      EXPECT_THAT(scan.warnings, testing::SizeIs(1)) << simulated.name;
      EXPECT_TRUE(scan.normals_oriented) << simulated.name;
    }
  }
}

// From anywhere within, a hall looks single-layered; its points are densest where the scanner stood.
TEST(SimulatedViewpoint, IsNotTheOriginElsewhereInTheHall) {
  for (const simulate::SimulatedScan& simulated : scans_by("laser-scanner")) {
    const double range = median_range(simulated.points_in_scan);
    const Eigen::Vector3d elsewhere(0.6 * range, 0.3 * range, 0.0);
    const Scan scan = prepared(simulated.points_in_scan, origin_at(elsewhere));
    ASSERT_EQ(scan.viewpoint_source, ViewpointSource::points) << simulated.name;
    EXPECT_LT((scan.viewpoint.value + elsewhere).norm(), 0.15 * range) << simulated.name;
  }
}

// What was measured from several places is not taken for a scan from one.
TEST(SimulatedViewpoint, OfAMergedCloudIsNotKnown) {
  std::vector<Eigen::Vector3f> merged;
  for (const simulate::SimulatedScan& simulated : scans_by("structured-light")) {
    for (const Eigen::Vector3f& p : simulated.points_in_scan) {
      merged.push_back((*simulated.model_from_scan * p.cast<double>()).cast<float>());
    }
  }
  EXPECT_EQ(prepared(merged, Pose::Identity()).viewpoint_source, ViewpointSource::none);
}

// Depth alone cannot tell front from back, signed normals can.
TEST(SimulatedViewpoint, BehindTheSceneIsRejectedWhereTheFileHasNormals) {
  for (const std::string sensor : {"structured-light", "laser-scanner"}) {
    for (const simulate::SimulatedScan& simulated : scans_by(sensor)) {
      PointCloud with_normals = prepared(simulated.points_in_scan, Pose::Identity()).cloud;
      const Scan truly = prepare_scan(with_normals, std::nullopt, {}, {}, Context(2)).value();
      EXPECT_TRUE(truly.viewpoint.known()) << simulated.name;
      for (Eigen::Vector3f& normal : with_normals.normals) normal = -normal;  // as seen from the other side
      const Scan flipped = prepare_scan(with_normals, std::nullopt, {}, {}, Context(2)).value();
      EXPECT_FALSE(flipped.viewpoint.known()) << simulated.name;
      EXPECT_TRUE(flipped.normals_oriented) << "by the file";
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Simulated, AutomaticViewpoint, testing::Values("structured-light", "laser-scanner"),
                         [](const auto& sensor) {
                           return sensor.param == "laser-scanner" ? "LaserScanner" : "StructuredLight";
                         });

}  // namespace
}  // namespace asbuilt::scan
