// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "asbuilt/evaluate/evaluate.h"
#include "asbuilt/simulate/simulate.h"
#include "support/parts.h"

namespace asbuilt::test {

/// A simulated set on disk and a record that says what the truth says.
struct Scenario {
  std::filesystem::path folder;
  simulate::Simulation simulation;
  io::RunRecord record;

  explicit Scenario(const std::string& name, double absent_share = 0.25) {
    folder = std::filesystem::path(testing::TempDir()) / ("asbuilt_" + name);
    std::filesystem::remove_all(folder);
    simulate::SimulateOptions options;
    options.scans = 4;
    options.points = 6000;
    options.clutter_objects = 3;
    options.clutter_low = 0.0;  // any will do here, and is quicker to find
    options.clutter_high = 1.0;
    options.absent_share = absent_share;
    simulation = simulate::simulate(stepped_block(), options, Context(2)).value();
    EXPECT_TRUE(simulate::write_simulation(folder, simulation).has_value());
    record.state = io::RunState::complete;
    for (const simulate::SimulatedScan& scan : simulation.scans) {
      io::ScanRecord entry;
      entry.path = "somewhere/else/" + scan.name + ".ply";
      entry.name = scan.name;
      entry.status = scan.model_from_scan ? io::ScanStatus::accepted : io::ScanStatus::rejected;
      entry.model_from_scan = scan.model_from_scan;
      record.scans.push_back(entry);
    }
  }

  [[nodiscard]] Result<evaluate::Evaluation> evaluated() const {
    const auto truth = evaluate::read_truth(folder);
    if (!truth) return tl::unexpected(truth.error());
    return evaluate::evaluate(*truth, record, folder / "result", {}, Context(2));
  }

  [[nodiscard]] std::size_t first_present() const {
    std::size_t i = 0;
    while (!simulation.scans[i].model_from_scan) ++i;
    return i;
  }
};

}  // namespace asbuilt::test
