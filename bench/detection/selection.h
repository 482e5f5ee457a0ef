// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "cases.h"
#include "parts.h"
#include "record.h"

namespace CLI {
class App;
}

namespace asbuilt::bench {

/// Which cases a process runs, and where their records go.
struct Selection {
  std::filesystem::path output;  ///< cases.jsonl lies in it
  std::filesystem::path data;    ///< folder with cad/; empty: only our own parts
  std::string seeds = "1..120", group = "distinct", shard = "0/1";
  std::vector<std::string> parts;
  std::uint64_t stride = 1;
  double point_share = 1.0;
  int threads = 0;
};

/// The options of a subcommand that runs cases.
void add_options(CLI::App& app, Selection& selection);

/// The parts of the selection's group, or all. They do not depend on what else is selected, so that a seed always means
/// the same.
[[nodiscard]] Result<std::vector<SuitePart>> suite_parts(const Selection& selection);

/// Its cases that have no record of this mode yet, part by part, so that each is prepared once and one at a time.
[[nodiscard]] Result<std::vector<Case>> open_cases(const Selection& selection, const std::string& mode,
                                                   const std::vector<SuitePart>& parts);

/// Fills in what came of a scan.
using Judge = std::function<Result<void>(CaseRecord&, const CaseScan&)>;

/// Runs the open cases: `judge_for` prepares a part, what it gives back judges the scans of that part.
[[nodiscard]] Result<void> run_cases(const Selection& selection, const std::string& mode,
                                     const std::function<Result<Judge>(const SuitePart&)>& judge_for,
                                     const Context& context);

}  // namespace asbuilt::bench
