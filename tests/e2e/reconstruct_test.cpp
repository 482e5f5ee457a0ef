// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <map>
#include <set>

#include "asbuilt/evaluate/evaluate.h"
#include "asbuilt/io/file.h"
#include "asbuilt/io/ply_writer.h"
#include "asbuilt/pipeline.h"
#include "asbuilt/simulate/parts.h"
#include "asbuilt/simulate/simulate.h"
#include "support/parts.h"

namespace asbuilt {
namespace {

namespace fs = std::filesystem;

/// Scenes of a virtual scanner on disk, and where their results go.
class Reconstruct : public testing::Test {
 protected:
  Reconstruct()
      : base_(fs::path(testing::TempDir()) / "asbuilt_e2e" /
              testing::UnitTest::GetInstance()->current_test_info()->name()) {
    fs::remove_all(base_);
  }
  ~Reconstruct() override { fs::remove_all(base_); }

  void simulate_scenes(simulate::SimulateOptions options) {
    options.points = 40000;
    const auto simulation = simulate::simulate(test::casing(), options, Context(2));
    ASSERT_TRUE(simulation.has_value()) << simulation.error().message;
    const auto written = simulate::write_simulation(scenes(), *simulation);
    ASSERT_TRUE(written.has_value()) << written.error().message;
    for (const auto& scan : simulation->scans) scans_.push_back((scenes() / (scan.name + ".ply")).string());
  }

  [[nodiscard]] fs::path scenes() const { return base_ / "scenes"; }
  [[nodiscard]] fs::path result() const { return base_ / "result"; }

  [[nodiscard]] Result<io::RunRecord> reconstruct(const pipeline::Options& options = {}) const {
    return pipeline::reconstruct((scenes() / "model.ply").string(), scans_, options, {result(), false, {}}, Context(2));
  }

  [[nodiscard]] evaluate::Evaluation evaluated() const {
    return evaluate::evaluate(scenes() / "truth.json", result(), {}, Context(2)).value();
  }

  fs::path base_;
  std::vector<std::string> scans_;
};

TEST_F(Reconstruct, BringsClutteredScansTogetherWithinHalfASigma) {
  simulate_scenes({.scans = 6, .seed = 11, .as_built = {}});
  const auto record = reconstruct();
  ASSERT_TRUE(record.has_value()) << record.error().message;
  const evaluate::Evaluation figures = evaluated();
  EXPECT_EQ(figures.wrong, 0U) << evaluate::to_table(figures);
  EXPECT_GE(figures.right, 5U) << evaluate::to_table(figures);
  // style.md, section 8: within half a sigma after the common gauge.
  EXPECT_LE(figures.relative_pose_error_sigma.value(), 0.5) << evaluate::to_table(figures);
}

TEST_F(Reconstruct, AcceptsNothingWhereThePartIsAbsent) {
  simulate_scenes({.scans = 4, .seed = 12, .absent_share = 1.0, .decoys = 1, .as_built = {}});
  const auto record = reconstruct();
  ASSERT_TRUE(record.has_value()) << record.error().message;
  for (const io::ScanRecord& scan : record->scans) {
    EXPECT_NE(scan.status, io::ScanStatus::accepted) << scan.name << ": " << scan.reason;
    EXPECT_FALSE(scan.reason_code.empty());
    EXPECT_FALSE(scan.reason.empty());
  }
  EXPECT_EQ(record->state, io::RunState::failed);
  EXPECT_FALSE(fs::exists(result() / "reconstruction.ply"));
}

TEST_F(Reconstruct, ASecondPlacementInAScanIsAmbiguousUnlessAllAreWanted) {
  simulate_scenes({.scans = 3, .seed = 14, .clutter_objects = 3, .hidden_high = 0.15, .instances = 2, .as_built = {}});
  const auto one = reconstruct();
  ASSERT_TRUE(one.has_value()) << one.error().message;
  ASSERT_EQ(one->scans.size(), 3U);
  for (const io::ScanRecord& scan : one->scans) {
    EXPECT_EQ(scan.status, io::ScanStatus::ambiguous) << scan.name << ": " << scan.reason;
    EXPECT_EQ(scan.reason_code, "second_instance") << scan.name << ": " << scan.reason;
  }
  EXPECT_EQ(evaluated().present, 3U);

  fs::remove_all(result());
  pipeline::Options options;
  options.instances = pipeline::Instances::all;
  const auto all = reconstruct(options);
  ASSERT_TRUE(all.has_value()) << all.error().message;
  const evaluate::Evaluation figures = evaluated();
  EXPECT_EQ(figures.scans, 3U);
  EXPECT_EQ(figures.present, 6U);
  EXPECT_EQ(figures.right + figures.disconnected_right, 6U) << evaluate::to_table(figures);
  EXPECT_EQ(figures.wrong, 0U) << evaluate::to_table(figures);
  for (const evaluate::ScanFigures& scan : figures.per_scan) {
    EXPECT_GE(scan.segment_recall.value(), 0.95) << scan.name;
    EXPECT_GE(scan.segment_precision.value(), 0.98) << scan.name;
  }

  // No point of a scan belongs to two placements, and the names tell them apart.
  std::map<std::string, std::set<std::array<double, 3>>> points_of_file;
  std::map<std::string, std::size_t> claims;
  for (std::size_t i = 0; i < all->scans.size(); ++i) {
    const io::ScanRecord& scan = all->scans[i];
    EXPECT_EQ(scan.instances_in_scan, 2) << scan.name;
    EXPECT_EQ(scan.name.ends_with("#2"), scan.instance == 2) << scan.name;
    const auto vertices = io::read_ply_vertices(result() / io::segment_file(i, scan.name)).value();
    const auto &x = *vertices.find("x"), &y = *vertices.find("y"), &z = *vertices.find("z");
    for (std::size_t k = 0; k < x.size(); ++k) {
      if ((*vertices.find("part"))[k] == 0.0) continue;
      points_of_file[scan.path].insert({x[k], y[k], z[k]});
      ++claims[scan.path];
    }
  }
  for (const auto& [path, count] : claims) EXPECT_EQ(points_of_file[path].size(), count) << path;
}

// Two castings of one CAD that were warped differently, their scans in one pile: what is given back is one of them.
TEST_F(Reconstruct, OfTwoCastingsGivesBackOne) {
  for (const std::uint64_t casting : {1U, 2U}) {
    simulate::SimulateOptions options{.scans = 5, .seed = 2 + casting, .as_built = {}};
    options.points = 60000;
    options.as_built.warp_ratio = 0.006;
    const auto simulation = simulate::simulate(simulate::valve_body(), options, Context(2));
    ASSERT_TRUE(simulation.has_value()) << simulation.error().message;
    const fs::path folder = base_ / ("casting_" + std::to_string(casting));
    ASSERT_TRUE(simulate::write_simulation(folder, *simulation).has_value());
    fs::create_directories(scenes());
    fs::copy_file(folder / "model.ply", scenes() / "model.ply", fs::copy_options::overwrite_existing);
    for (const auto& scan : simulation->scans) {
      scans_.push_back((scenes() / fmt::format("casting_{}_{}.ply", casting, scan.name)).string());
      fs::copy_file(folder / (scan.name + ".ply"), scans_.back());
    }
  }
  const auto record = reconstruct();
  ASSERT_TRUE(record.has_value()) << record.error().message;
  std::map<std::string, int> accepted;  // by casting
  for (const io::ScanRecord& scan : record->scans) {
    if (scan.status == io::ScanStatus::accepted) {
      ++accepted[scan.name.substr(0, 9)];
    } else if (scan.status == io::ScanStatus::disconnected) {
      EXPECT_EQ(scan.reason_code, "other_individual") << scan.name;
      EXPECT_NE(scan.reason.find("casting_"), std::string::npos) << "names the scans that belong together";
    }
  }
  ASSERT_EQ(accepted.size(), 1U) << "the castings are mixed";
  EXPECT_GE(accepted.begin()->second, 3);
}

TEST_F(Reconstruct, StopsWhenAskedAndGoesOnToTheSameBytes) {
  simulate_scenes({.scans = 2, .seed = 13, .as_built = {}});
  std::stop_source source;
  Context context(2);
  context.stop = source.get_token();
  pipeline::Output output{result(), false, {}};
  output.on_stage = [&](std::string_view stage, std::string_view scan) {
    if (stage == "verify" && scan == "scan_01") source.request_stop();
  };
  const auto model = (scenes() / "model.ply").string();
  const auto stopped = pipeline::reconstruct(model, scans_, {}, output, context);
  ASSERT_FALSE(stopped.has_value());
  EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  const auto partial = io::read_run_record(result() / "result.json");
  ASSERT_TRUE(partial.has_value());
  EXPECT_EQ(partial->state, io::RunState::partial);
  EXPECT_EQ(partial->scans.size(), 1U);

  ASSERT_TRUE(reconstruct().has_value());
  const auto resumed = io::read_file(result() / "result.json");
  fs::remove_all(result());
  ASSERT_TRUE(reconstruct().has_value());
  EXPECT_EQ(io::read_file(result() / "result.json").value(), resumed.value());

  // Again over the finished result, whose segments were cut anew: the joint half begins with those of the scan half.
  const std::vector<fs::path> files{result() / "reconstruction.ply", result() / io::segment_file(0, "scan_00"),
                                    result() / io::segment_file(1, "scan_01")};
  std::vector<std::string> first;
  for (const fs::path& file : files) first.push_back(io::read_file(file).value());
  EXPECT_NE(io::read_ply_vertices(files[1]).value().find("part_detected"), nullptr);
  ASSERT_TRUE(reconstruct().has_value());
  for (std::size_t i = 0; i < files.size(); ++i) EXPECT_EQ(io::read_file(files[i]).value(), first[i]) << files[i];
}

}  // namespace
}  // namespace asbuilt
