// SPDX-License-Identifier: Apache-2.0
// Our E57 reader and writer beside the npm package web-e57. Its folder stands in the environment variable
// ASBUILT_WEB_E57 (npm install web-e57 puts it into node_modules); without it, or without node, the tests skip
// themselves.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "asbuilt/io/e57_writer.h"
#include "asbuilt/io/scan_file.h"
#include "unit/io/scans.h"
#include "unit/io/temporary_folder.h"

namespace asbuilt::io {
namespace {

std::string web_e57() {
  const char* folder = std::getenv("ASBUILT_WEB_E57");
  return folder != nullptr && std::filesystem::exists(std::filesystem::path(folder) / "e57_bg.wasm") ? folder : "";
}

#define SKIP_WITHOUT_WEB_E57() \
  if (web_e57().empty()) GTEST_SKIP() << "ASBUILT_WEB_E57 names no folder of web-e57"

/// What web-e57 reads, in mm.
std::vector<Eigen::Vector3d> points_by_web_e57(const std::filesystem::path& path) {
  const std::string command = "node '" ASBUILT_WEB_E57_SCRIPT "' '" + web_e57() + "' '" + path.string() + "'";
  FILE* const pipe = ::popen(command.c_str(), "r");
  std::string text;
  char buffer[4096];
  for (std::size_t got = 0; (got = std::fread(buffer, 1, sizeof(buffer), pipe)) > 0;) text.append(buffer, got);
  EXPECT_EQ(::pclose(pipe), 0);
  std::vector<Eigen::Vector3d> points;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    Eigen::Vector3d point;
    std::istringstream(line) >> point.x() >> point.y() >> point.z();
    points.push_back(1000.0 * point);
  }
  return points;
}

/// What we read, with poses applied, in mm; without points that are none, which web-e57 leaves out.
std::vector<Eigen::Vector3d> points_by_us(const std::filesystem::path& path) {
  std::vector<Eigen::Vector3d> points;
  const auto scans = read_scans(path, Unit::stated);
  EXPECT_TRUE(scans) << scans.error().message;
  for (const ScanFile& scan : *scans) {
    for (const Eigen::Vector3f& p : scan.cloud.positions) {
      if (!p.allFinite()) continue;
      points.push_back(scan.file_from_scan.value_or(Pose::Identity()) * (p.cast<double>() + scan.offset_mm));
    }
  }
  return points;
}

void expect_same(const std::vector<Eigen::Vector3d>& ours, const std::vector<Eigen::Vector3d>& theirs,
                 const std::string& what) {
  ASSERT_EQ(ours.size(), theirs.size()) << what;
  for (std::size_t i = 0; i < ours.size(); ++i) {
    // We keep float, whose step is 0.004 mm at 64 m.
    ASSERT_LT((ours[i] - theirs[i]).norm(), 0.01) << what << ", point " << i;
  }
}

TEST(E57BesideWebE57, BothReadTheSamePointsOfFilesOfOtherSoftware) {
  SKIP_WITHOUT_WEB_E57();
  if (!std::filesystem::exists(test::kFormats)) GTEST_SKIP() << test::kFormats << " is not there";
  for (const char* name :
       {"bunnyDouble", "bunnyInt21", "ColouredCubeDouble", "tinyCartesianFloatRgb", "tiny_spherical",
        "scaled_integer_intensity", "testWithNormals", "translationWithoutRotation", "A_B", "A_moved_B"}) {
    const auto path = test::kFormats / (std::string(name) + ".e57");
    expect_same(points_by_us(path), points_by_web_e57(path), name);
  }
}

TEST(E57BesideWebE57, ItReadsWhatWeWrite) {
  SKIP_WITHOUT_WEB_E57();
  std::srand(1);
  std::vector<E57Scan> scans(2);
  std::vector<Eigen::Vector3d> expected;
  for (std::size_t s = 0; s < scans.size(); ++s) {
    E57Scan& scan = scans[s];
    scan.name = "scan & " + std::to_string(s);
    Pose pose(Eigen::AngleAxisd(0.3 + static_cast<double>(s), Eigen::Vector3d(1, -2, 3).normalized()));
    pose.translation() = Eigen::Vector3d(100, -200, 300.5);
    scan.file_from_scan = pose;
    for (int i = 0; i < 5000; ++i) {
      scan.positions_mm.push_back((s == 0 ? 1000.0 : 20000.0) * Eigen::Vector3d::Random());
      scan.normals.push_back(Eigen::Vector3f::Random().normalized());
      scan.colours.push_back({static_cast<std::uint8_t>(i), 2, 3});
      scan.intensities.push_back(static_cast<float>(i));
      expected.push_back(pose * scan.positions_mm.back());
    }
  }
  const test::TemporaryFolder folder;
  ASSERT_TRUE(write_e57(folder.path() / "ours.e57", scans));
  expect_same(expected, points_by_web_e57(folder.path() / "ours.e57"), "ours.e57");
}

}  // namespace
}  // namespace asbuilt::io
