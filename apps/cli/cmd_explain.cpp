// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "asbuilt/io/run_record.h"
#include "asbuilt/pipeline/scan_hints.h"
#include "commands.h"
#include "options.h"

namespace asbuilt::cli {
namespace {

struct Arguments {
  std::string folder, scan;
};

std::string input_sentence(const io::ScanRecord& scan) {
  if (scan.points == 0) return {};
  std::string text =
      fmt::format("  It holds {} usable points, about {:.3g} mm apart, with a noise of {:.3g} mm (1 sigma)",
                  scan.points, scan.spacing, scan.noise_sigma);
  if (scan.viewpoint) {
    text += fmt::format("; {} {:.4g}, {:.4g}, {:.4g}.\n",
                        scan.viewpoint_kind == "point" ? "the sensor stood at" : "its parallel rays fly along",
                        scan.viewpoint->x(), scan.viewpoint->y(), scan.viewpoint->z());
  } else {
    text += "; where the sensor stood is not known.\n";
  }
  for (const std::string& warning : scan.warnings) text += fmt::format("  Note: {}\n", warning);
  return text;
}

std::string figures_sentence(const io::ScanRecord& scan) {
  if (scan.candidates.empty()) return {};
  return fmt::format(
      "  Of what should be visible of the part {:.0f} % was found (score {:.3f}; {:.0f} % of the whole surface), "
      "{:.0f} % "
      "was seen through (free space), and {:.0f} % of the normals agree. The next different pose is {:.3f} worse.\n",
      100.0 * scan.score, scan.score, 100.0 * scan.visible_share, 100.0 * scan.free_space_violations,
      100.0 * scan.normal_agreement, scan.margin);
}

std::string candidate_lines(const io::ScanRecord& scan) {
  std::string text;
  for (std::size_t i = 0; i < scan.candidates.size(); ++i) {
    const io::CandidateRecord& candidate = scan.candidates[i];
    const Eigen::Vector3d at = candidate.model_from_scan.inverse().translation();
    text += fmt::format(
        "  candidate {}: score {:.3f}, normals {:.0f} %, seen through {:.0f} %, votes {:.4g}, model origin at "
        "({:.4g}, {:.4g}, {:.4g}) mm in the scan\n",
        i, candidate.score, 100.0 * candidate.normal_agreement, 100.0 * candidate.free_space_violations,
        candidate.votes, at.x(), at.y(), at.z());
  }
  return text;
}

std::string registration_sentences(const io::RunRecord& record, std::size_t index) {
  const io::ScanRecord& scan = record.scans[index];
  std::string text;
  if (scan.component) text += fmt::format("  It belongs to component {} of the pose graph.\n", *scan.component);
  if (scan.covariance) {
    const double translation_sigma = std::sqrt(scan.covariance->bottomRightCorner<3, 3>().trace());
    if (translation_sigma > 0.0) {
      text +=
          fmt::format("  The joint refinement holds its position to about {:.3g} mm (1 sigma, all axes together).\n",
                      translation_sigma);
    }
  }
  if (!record.graph) return text;
  for (const io::OverlapRecord& pair : record.graph->overlaps) {
    if (!pair.linked) continue;
    const int self = static_cast<int>(index);
    const int other = pair.a == self ? pair.b : pair.b == self ? pair.a : -1;
    if (other < 0) continue;
    text += fmt::format("  It is linked to {} (overlap {:.0f} %).\n",
                        record.scans[static_cast<std::size_t>(other)].name, 100.0 * pair.overlap);
  }
  return text;
}

std::string advice_for(const io::ScanRecord& scan) {
  if (scan.status == io::ScanStatus::ambiguous) {
    return fmt::format("  To choose one yourself, run detect or reconstruct again with --accept {}:CANDIDATE.\n",
                       scan.name);
  }
  if (scan.status == io::ScanStatus::rejected && !scan.candidates.empty()) {
    return fmt::format(
        "  If a candidate below is right after all: --accept {}:CANDIDATE. A pose you know: --poses FILE.\n",
        scan.name);
  }
  if (scan.status == io::ScanStatus::disconnected)
    return "  A scan that overlaps both sides would join it to the others.\n";
  return {};
}

std::string explanation_of(const io::RunRecord& record, std::size_t index) {
  const io::ScanRecord& scan = record.scans[index];
  std::string text = fmt::format("{} ({}) is {}", scan.name, scan.path, io::name_of(scan.status));
  if (!scan.reason_code.empty()) text += fmt::format(" [{}]", scan.reason_code);
  text += scan.reason.empty() ? ".\n" : fmt::format(": {}.\n", scan.reason);
  text += input_sentence(scan) + figures_sentence(scan) + registration_sentences(record, index) + advice_for(scan) +
          candidate_lines(scan);
  return text;
}

std::string state_sentence(const io::RunRecord& record) {
  if (record.state != io::RunState::partial) return {};
  return "The run is not finished: give its command again, it goes on from there.\n";
}

Result<int> run(const Arguments& arguments, Shell& shell) {
  ASBUILT_TRY(record, io::read_run_record(std::filesystem::path(arguments.folder) / "result.json"));
  std::string text = state_sentence(record);
  bool found = false;
  for (std::size_t i = 0; i < record.scans.size(); ++i) {
    const io::ScanRecord& scan = record.scans[i];
    if (!arguments.scan.empty() && !pipeline::names_scan(arguments.scan, scan.path, scan.name)) continue;
    found = true;
    text += explanation_of(record, i);
  }
  if (!found && !arguments.scan.empty()) {
    return fail(ErrorCode::invalid_argument, fmt::format("{}: has no scan '{}'; asbuilt explain {} lists them all",
                                                         arguments.folder, arguments.scan, arguments.folder));
  }
  shell.print_json(io::to_json(record));
  shell.print_result(text);
  return kDone;
}

}  // namespace

void add_explain_command(CLI::App& app, Shell& shell) {
  CLI::App* command = app.add_subcommand("explain", "Why a scan was accepted or rejected, in words and numbers");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("DIR", arguments->folder, "Folder that detect, register or reconstruct wrote")->required();
  command->add_option("SCAN", arguments->scan, "One scan, by name or path (default: all)");
  add_common_options(*command, shell, false);
  command->footer(
      "Examples:\n"
      "  asbuilt explain result\n"
      "  asbuilt explain result scan_03");
  run_on_call(*command, shell, [arguments, &shell] { return run(*arguments, shell); });
}

}  // namespace asbuilt::cli
