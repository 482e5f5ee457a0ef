// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "asbuilt/io/file.h"
#include "asbuilt/pipeline.h"
#include "asbuilt/simulate/simulate.h"
#include "support/parts.h"

namespace asbuilt::test {

namespace fs = std::filesystem;

/// Simulated scans that wait in one folder to be put into the watched one.
class LiveScenes : public testing::Test {
 protected:
  LiveScenes()
      : base_(fs::path(testing::TempDir()) / "asbuilt_live" /
              testing::UnitTest::GetInstance()->current_test_info()->name()) {
    fs::remove_all(base_);
    fs::create_directories(watched());
  }
  ~LiveScenes() override { fs::remove_all(base_); }

  void simulate_scenes(int scans, std::uint64_t seed, double absent_share = 0.0, int points = 20000,
                       const TriangleMesh& part = casing()) {
    simulate::SimulateOptions options{.scans = scans,
                                      .points = points,
                                      .seed = seed,
                                      .clutter_objects = 3,
                                      .clutter_high = 0.7,
                                      .absent_share = absent_share,
                                      .as_built = {}};
    const auto simulation = simulate::simulate(part, options, Context(2));
    ASSERT_TRUE(simulation.has_value()) << simulation.error().message;
    ASSERT_TRUE(simulate::write_simulation(base_ / "scenes", *simulation).has_value());
    for (const auto& scan : simulation->scans) names_.push_back(scan.name + ".ply");
  }

  [[nodiscard]] std::string model() const { return (base_ / "scenes" / "model.ply").string(); }
  [[nodiscard]] fs::path watched() const { return base_ / "watched"; }
  [[nodiscard]] fs::path output() const { return base_ / "session"; }

  /// Puts a scan into the watched folder as a careful program does: whole at once.
  std::string put(const std::string& name, const std::string& as = {}) const {
    const fs::path place = watched() / (as.empty() ? name : as);
    fs::copy_file(base_ / "scenes" / name, base_ / "coming", fs::copy_options::overwrite_existing);
    fs::rename(base_ / "coming", place);
    return place.string();
  }

  /// What `asbuilt reconstruct` makes of the files that are now watched, in order of name.
  io::RunRecord reconstruct(const fs::path& folder, const pipeline::Options& options = {}) const {
    std::vector<std::string> paths;
    for (const auto& entry : fs::directory_iterator(watched())) {
      if (entry.is_regular_file()) paths.push_back(entry.path().string());
    }
    std::ranges::sort(paths);
    const auto record = pipeline::reconstruct(model(), paths, options, {folder, false, {}}, Context(2));
    EXPECT_TRUE(record.has_value()) << record.error().message;
    return record.value_or(io::RunRecord{});
  }

  /// Every file of a result but timing.json, by name. The report says which command made it, which is left out here.
  static std::map<std::string, std::string> content(const fs::path& folder) {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (!entry.is_regular_file() || entry.path().filename() == "timing.json") continue;
      std::string bytes = io::read_file(entry.path()).value();
      if (entry.path().stem() == "report") bytes = without_command(bytes);
      files[fs::relative(entry.path(), folder).string()] = io::sha256(bytes);
    }
    return files;
  }

  static std::string without_command(const std::string& report) {
    const std::size_t begin = report.find("\"command\":");
    if (begin == std::string::npos) return report;
    return report.substr(0, begin) + report.substr(report.find('}', begin));
  }

  fs::path base_;
  std::vector<std::string> names_;
};

/// While it lives no file can grow beyond 4096 bytes: what a full disk looks like to this process.
class FullDisk {
 public:
  FullDisk() {
    std::signal(SIGXFSZ, SIG_IGN);
    EXPECT_EQ(::getrlimit(RLIMIT_FSIZE, &before_), 0);
    rlimit small = before_;
    small.rlim_cur = 4096;
    EXPECT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  }
  ~FullDisk() { EXPECT_EQ(::setrlimit(RLIMIT_FSIZE, &before_), 0); }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
};

}  // namespace asbuilt::test
