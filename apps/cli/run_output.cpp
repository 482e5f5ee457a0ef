// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <filesystem>

#include "commands.h"

namespace asbuilt::cli {
namespace {

std::size_t count_of(const io::RunRecord& record, io::ScanStatus status) {
  return static_cast<std::size_t>(std::ranges::count(record.scans, status, &io::ScanRecord::status));
}

std::string line_of(const io::ScanRecord& scan) {
  const std::string status(io::name_of(scan.status));
  const bool fine = scan.status == io::ScanStatus::accepted && scan.reason_code.empty();
  const std::string reason = fine ? fmt::format("score {:.2f}, normals agree {:.0f} %, {} points", scan.score,
                                                100.0 * scan.normal_agreement, scan.segment_points)
                                  : fmt::format("{}: {}", scan.reason_code, scan.reason);
  return fmt::format("  {:<16} {:<12} {}\n", scan.name, status, reason);
}

std::string joint_lines(const io::RunRecord& record) {
  std::string text;
  if (record.graph) {
    const auto linked = std::ranges::count_if(record.graph->overlaps, &io::OverlapRecord::linked);
    text += fmt::format("graph: {} links, {} component(s)\n", linked, record.graph->components.size());
  }
  if (record.refinement && !record.refinement->empty()) {
    const io::RefinementRecord& refinement = record.refinement->front();
    text += fmt::format("refinement: rms {:.4g} -> {:.4g} mm between scans, {} iterations{}{}\n", refinement.rms_before,
                        refinement.rms_after, refinement.iterations, refinement.converged ? "" : ", not converged",
                        refinement.on_model ? "; scans hold one another loosely, the CAD has helped" : "");
  }
  if (record.deviation) {
    const io::DeviationRecord& deviation = *record.deviation;
    text += fmt::format(
        "deviation from the CAD: mean {:+.4g} mm, sigma {:.4g} mm, 95 % within {:.4g} mm; {:.0f} % of "
        "the surface scanned\n",
        deviation.mean, deviation.sigma, deviation.p95, 100.0 * deviation.coverage);
    if (deviation.in_tolerance) {
      text += fmt::format("tolerance: {}, {:.2f} % of the scanned surface within\n", deviation.verdict,
                          100.0 * *deviation.in_tolerance);
    }
  }
  return text;
}

/// Without what cannot change the result: where it is written, how fast, and what is said on the way.
std::vector<std::string> telling_arguments(const std::vector<std::string>& arguments) {
  constexpr std::string_view kWithValue[] = {"-o", "--output", "--threads", "--memory"};
  constexpr std::string_view kAlone[] = {"-q", "--quiet", "--json", "--force"};
  std::vector<std::string> telling;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string_view name = std::string_view(arguments[i]).substr(0, arguments[i].find('='));
    if (std::ranges::find(kAlone, name) != std::end(kAlone)) continue;
    if (std::ranges::find(kWithValue, name) == std::end(kWithValue)) {
      telling.push_back(arguments[i]);
    } else if (name.size() == arguments[i].size()) {
      ++i;  // its value is the next one
    }
  }
  return telling;
}

void limit_memory(double gigabytes) {
  if (gigabytes <= 0.0) return;
  const auto bytes = static_cast<rlim_t>(gigabytes * 1e9);
  const rlimit limit{bytes, bytes};
  setrlimit(RLIMIT_DATA, &limit);  // beyond it allocations fail, which is reported scan by scan
}

}  // namespace

std::string summary_of(const io::RunRecord& record, const std::string& folder) {
  std::string text = fmt::format("{}: {} triangles, diameter {:.6g} mm (the diagonal of its bounding box)\n",
                                 record.model.path, record.model.triangles, record.model.diameter);
  for (const io::ScanRecord& scan : record.scans) text += line_of(scan);
  text += fmt::format("{} of {} scans accepted\n", count_of(record, io::ScanStatus::accepted), record.scans.size());
  text += joint_lines(record);
  if (record.deviation) {
    text += fmt::format("report: {}\n", (std::filesystem::path(folder) / "report.html").string());
  }
  text += fmt::format("result: {}\n", (std::filesystem::path(folder) / "result.json").string());
  return text;
}

int exit_code_of(const io::RunRecord& record) {
  using enum io::ScanStatus;
  if (!record.scans.empty() && count_of(record, failed) == record.scans.size()) return kNoReadableInput;
  if (count_of(record, accepted) == 0) return kNotDone;
  const bool undecided =
      std::ranges::any_of(record.scans, [](const io::ScanRecord& scan) { return scan.reason_code == "symmetry"; });
  if (undecided || count_of(record, ambiguous) > 0 || count_of(record, disconnected) > 0) return kAmbiguousOrInPieces;
  const bool judged = record.deviation && !record.deviation->verdict.empty();
  return judged && record.deviation->verdict != "pass" ? kOutOfTolerance : kDone;
}

pipeline::Output output_of(const std::string& folder, Shell& shell) {
  return {folder, shell.common.force,
          [&shell](std::string_view stage, std::string_view scan) { shell.show_stage(stage, scan); },
          telling_arguments(shell.arguments)};
}

void run_on_call(CLI::App& command, Shell& shell, std::function<Result<int>()> work) {
  command.callback([&shell, work = std::move(work)] {
    limit_memory(shell.common.memory_gb);
    shell.finish(work());
  });
}

}  // namespace asbuilt::cli
