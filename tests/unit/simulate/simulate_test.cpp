// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/simulate/simulate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "asbuilt/io/mesh_file.h"
#include "asbuilt/io/scan_file.h"
#include "asbuilt/model/surface_distance.h"
#include "support/matchers.h"
#include "support/parts.h"

namespace asbuilt::simulate {
namespace {

SimulateOptions quick() {
  SimulateOptions options;
  options.scans = 2;
  options.points = 8000;
  options.clutter_objects = 4;
  return options;
}

std::filesystem::path fresh_folder(const std::string& name) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / name;
  std::filesystem::remove_all(folder);
  return folder;
}

TEST(Simulate, TruePosesPutThePartsPointsOntoTheAsBuiltSurface) {
  for (const char* sensor : {"structured-light", "laser-scanner"}) {
    SimulateOptions options = quick();
    options.sensor = sensor;
    options.points = 30000;
    const Simulation simulation = simulate(test::casing(), options, Context(2)).value();
    const NoiseModel noise = noise_model(options, diameter(simulation.model));
    const model::SurfaceDistance surface(simulation.as_built);
    for (const SimulatedScan& scan : simulation.scans) {
      std::size_t part = 0;
      double worst = 0.0;
      for (std::size_t i = 0; i < scan.labels.size(); ++i) {
        if (scan.labels[i] != Label::kPart) continue;
        ++part;
        const Eigen::Vector3d point = scan.points_in_scan[i].cast<double>();
        // Straight on at this range, times what the flattest angle that returns can add, plus rounding.
        const double sigma = noise.axial_sigma(point.norm(), std::cos(84.0 / 180.0 * 3.14159265));
        const double distance = std::abs(surface.nearest(*scan.model_from_scan * point).signed_distance);
        worst = std::max(worst, distance / (sigma + noise.quantum_mm));
      }
      EXPECT_GT(part, 50U);
      EXPECT_LT(worst, 5.5);
    }
  }
}

TEST(Simulate, ACompanionTakesThePlaceOfAnAbsentPart) {
  SimulateOptions options = quick();
  options.absent_share = 1.0;
  options.clutter_objects = 0;
  options.floor = false;
  const std::vector<TriangleMesh> companions{test::stepped_block()};
  const Simulation without = simulate(test::casing(), options, Context(2)).value();
  const Simulation with = simulate(test::casing(), options, Context(2), companions).value();
  for (const SimulatedScan& scan : without.scans) EXPECT_TRUE(scan.points_in_scan.empty());
  for (const SimulatedScan& scan : with.scans) {
    EXPECT_FALSE(scan.model_from_scan);
    EXPECT_GT(std::ranges::count(scan.labels, Label::kFirstThing), 100);
    EXPECT_EQ(std::ranges::count(scan.labels, Label::kPart), 0);
  }
}

TEST(Simulate, CompanionsStandBesideThePart) {
  SimulateOptions options = quick();
  options.clutter_objects = 0;
  const std::vector<TriangleMesh> companions{test::stepped_block()};
  const Simulation simulation = simulate(test::casing(), options, Context(2), companions).value();
  std::ptrdiff_t companion = 0;
  for (const SimulatedScan& scan : simulation.scans) {
    EXPECT_TRUE(scan.model_from_scan);
    EXPECT_GT(std::ranges::count(scan.labels, Label::kPart), 100);
    companion += std::ranges::count(scan.labels, Label::kFirstThing);
  }
  EXPECT_GT(companion, 0);
}

TEST(Simulate, FurtherPlacementsHaveTheirOwnPosesAndLabels) {
  for (const char* sensor : {"structured-light", "laser-scanner"}) {
    SimulateOptions options = quick();
    options.sensor = sensor;
    options.points = 30000;
    options.instances = 3;
    options.as_built.bosses = 2;
    options.clutter_low = 0.0;
    options.clutter_high = 1.0;
    const Simulation simulation = simulate(test::casing(), options, Context(2)).value();
    const double size = diameter(simulation.model), sigma = simulation.noise_sigma_mm;
    const model::SurfaceDistance surface(simulation.as_built);
    for (const SimulatedScan& scan : simulation.scans) {
      ASSERT_EQ(scan.other_placements.size(), 2U) << sensor << " " << scan.name;
      std::vector<Eigen::Vector3d> centres{scan.model_from_scan->inverse() * bounding_box(simulation.model).center()};
      for (const OtherPlacement& other : scan.other_placements) {
        std::size_t points = 0, on_surface = 0;
        for (std::size_t i = 0; i < scan.labels.size(); ++i) {
          if (scan.labels[i] != other.label) continue;
          ++points;
          const Eigen::Vector3d in_model = other.model_from_scan * scan.points_in_scan[i].cast<double>();
          on_surface += std::abs(surface.nearest(in_model).signed_distance) < 4.0 * sigma ? 1 : 0;
        }
        EXPECT_GT(points, 100U) << sensor << " " << scan.name;
        EXPECT_GT(static_cast<double>(on_surface), 0.98 * static_cast<double>(points)) << sensor << " " << scan.name;
        EXPECT_LE(other.hidden, options.hidden_high) << sensor << " " << scan.name;
        EXPECT_LT(other.occlusion, 0.95) << sensor << " " << scan.name;
        const Eigen::Vector3d centre = other.model_from_scan.inverse() * bounding_box(simulation.model).center();
        for (const Eigen::Vector3d& earlier : centres) EXPECT_GT((centre - earlier).norm(), 0.2 * size);
        centres.push_back(centre);
      }
    }
  }
}

TEST(Simulate, OtherPointsAreNotOnThePart) {
  const Simulation simulation = simulate(test::casing(), quick(), Context(2)).value();
  const model::SurfaceDistance surface(simulation.as_built);
  std::size_t close = 0, others = 0;
  for (const SimulatedScan& scan : simulation.scans) {
    for (std::size_t i = 0; i < scan.labels.size(); ++i) {
      if (scan.labels[i] == Label::kPart || scan.labels[i] == Label::kFlying) continue;
      ++others;
      const Eigen::Vector3d point = *scan.model_from_scan * scan.points_in_scan[i].cast<double>();
      close += std::abs(surface.nearest(point, 10.0).signed_distance) < 1.0;
    }
  }
  EXPECT_GT(others, 5000U);
  EXPECT_LT(close, others / 100);  // the floor right under the part
}

TEST(Simulate, AbsentScansHaveNoPartAndNoPose) {
  SimulateOptions options = quick();
  options.scans = 4;
  options.absent_share = 0.5;
  const Simulation simulation = simulate(test::stepped_block(), options, Context(2)).value();
  int absent = 0;
  for (const SimulatedScan& scan : simulation.scans) {
    const auto part = std::ranges::count(scan.labels, Label::kPart);
    EXPECT_EQ(part == 0, !scan.model_from_scan.has_value());
    absent += !scan.model_from_scan.has_value();
  }
  EXPECT_EQ(absent, 2);
}

TEST(Simulate, NoiseIsTheRatioOfTheDiameterOrWhatIsGivenInMillimetres) {
  SimulateOptions options;
  options.noise_ratio = 0.001;
  EXPECT_DOUBLE_EQ(noise_model(options, 500.0).sigma_mm, 0.5);
  options.noise_mm = 0.2;
  EXPECT_DOUBLE_EQ(noise_model(options, 500.0).sigma_mm, 0.2);
  EXPECT_DOUBLE_EQ(noise_model(options, 500.0).axial_sigma(noise_model(options, 500.0).reference_mm, 1.0), 0.2);
}

TEST(Simulate, ImpossibleOptionsAreErrorsThatNameTheField) {
  const auto message = [](auto change) {
    SimulateOptions options;
    change(options);
    const auto result = simulate(test::stepped_block(), options, Context(1));
    EXPECT_THAT(result, test::FailsWith(ErrorCode::invalid_argument));
    return result ? std::string() : result.error().message;
  };
  using testing::HasSubstr;
  EXPECT_THAT(message([](auto& o) { o.scans = 0; }), HasSubstr("scans"));
  EXPECT_THAT(message([](auto& o) { o.points = 1; }), HasSubstr("points"));
  EXPECT_THAT(message([](auto& o) { o.sensor = "sonar"; }), HasSubstr("sonar"));
  EXPECT_THAT(message([](auto& o) { o.pose = "flying"; }), HasSubstr("flying"));
  EXPECT_THAT(message([](auto& o) { o.noise_ratio = std::nan(""); }), HasSubstr("noise_ratio"));
  EXPECT_THAT(message([](auto& o) { o.hidden_low = 0.5; }), HasSubstr("hidden"));
  EXPECT_THAT(message([](auto& o) { o.clutter_high = 1.5; }), HasSubstr("clutter"));
  EXPECT_THAT(message([](auto& o) { o.absent_share = -0.1; }), HasSubstr("absent_share"));
  EXPECT_THAT(message([](auto& o) { o.as_built.dents = -1; }), HasSubstr("dents"));
}

TEST(Simulate, EveryFieldIsListedOnce) {
  SimulateOptions options;
  std::vector<std::string> names;
  for_each_field(options, [&](const char* name, auto&, const char*) { names.emplace_back(name); });
  std::ranges::sort(names);
  EXPECT_EQ(std::ranges::adjacent_find(names), names.end());
  EXPECT_EQ(names.size(), 29U);
}

TEST(Simulate, AModelWithoutAreaAndACancelledRunAreErrors) {
  EXPECT_THAT(simulate({}, quick(), Context(1)), test::FailsWith(ErrorCode::not_possible));
  std::stop_source source;
  source.request_stop();
  Context context(1);
  context.stop = source.get_token();
  EXPECT_THAT(simulate(test::stepped_block(), quick(), context), test::FailsWith(ErrorCode::cancelled));
}

TEST(Simulate, WhatIsWrittenIsReadBack) {
  const Simulation simulation = simulate(test::stepped_block(), quick(), Context(2)).value();
  const std::filesystem::path folder = fresh_folder("asbuilt_simulation");
  ASSERT_TRUE(write_simulation(folder, simulation).has_value());
  for (const SimulatedScan& scan : simulation.scans) {
    const auto read = io::read_scans(folder / (scan.name + ".ply"), io::Unit::stated).value();
    ASSERT_EQ(read.size(), 1U);
    EXPECT_EQ(read.front().cloud.positions, scan.points_in_scan);
    EXPECT_EQ(std::filesystem::file_size(folder / (scan.name + ".labels")), scan.labels.size());
  }
  const TriangleMesh as_built = io::read_mesh(folder / "as_built.ply", io::Unit::stated).value();
  EXPECT_EQ(as_built.triangles, simulation.as_built.triangles);
  EXPECT_TRUE(std::filesystem::exists(folder / "truth.json"));
}

TEST(Simulate, WritingWhereNothingCanBeWrittenIsAnError) {
  const std::filesystem::path file = fresh_folder("asbuilt_not_a_folder");
  std::ofstream(file) << "in the way";
  EXPECT_THAT(write_simulation(file / "scans", {}), test::FailsWith(ErrorCode::unwritable_output));
}

}  // namespace
}  // namespace asbuilt::simulate
