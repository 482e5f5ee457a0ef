// SPDX-License-Identifier: Apache-2.0
// asbuilt_detection: the suite of simulated scans for detection and verification. bench/detection/run calls it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "../program.h"
#include "asbuilt/io/file.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/io/pose_file.h"
#include "asbuilt/simulate/simulate.h"
#include "cases.h"
#include "curves.h"
#include "parts.h"
#include "product.h"
#include "record.h"
#include "selection.h"
#include "self_match.h"
#include "summary.h"

namespace asbuilt::bench {
namespace {

struct Arguments {
  Selection selection;
  std::string mode = "default";
  std::vector<std::string> settings;
  std::filesystem::path write_scans;  ///< folder; empty: none is written
  std::string only;                   ///< group of parts that a summary is about; empty: all that were judged
};

io::OptionValue option_value(const std::string& text) {
  if (text == "true" || text == "false") return text == "true";
  std::int64_t whole = 0;
  const char* end = text.data() + text.size();
  if (const auto parsed = std::from_chars(text.data(), end, whole); parsed.ptr == end) return whole;
  double number = 0.0;
  if (const auto parsed = std::from_chars(text.data(), end, number); parsed.ptr == end) return number;
  return text;
}

/// What the product is told: a mode, and on top of it any of its options as NAME=VALUE.
Result<pipeline::Options> options_of(const Arguments& arguments) {
  pipeline::Options options;
  if (arguments.mode == "none") options.viewpoint = "none";
  options.paper_mode = arguments.mode == "paper";
  options = pipeline::with_paper_mode_applied(options);
  const io::Options known = pipeline::recorded(options, {pipeline::Half::model, pipeline::Half::scan});
  io::Options record;
  for (const std::string& setting : arguments.settings) {
    const std::size_t equals = setting.find('=');
    const std::string name = setting.substr(0, equals);
    if (equals == std::string::npos || std::ranges::find(known, name, &io::Options::value_type::first) == known.end()) {
      return fail(ErrorCode::invalid_argument, fmt::format("--set {}: expected NAME=VALUE of a known option", setting));
    }
    record.emplace_back(name, option_value(setting.substr(equals + 1)));
  }
  ASBUILT_CHECK(pipeline::take_over(options, record));
  ASBUILT_CHECK(options.validate());
  return options;
}

/// A mode of its own for every ablation, so that they stand side by side.
std::string mode_name(const Arguments& arguments) {
  std::string name = arguments.mode;
  for (const std::string& setting : arguments.settings) name += " " + setting;
  return name;
}

Result<void> judge_cases(const Arguments& arguments) {
  ASBUILT_TRY(options, options_of(arguments));
  const Context context(arguments.selection.threads);
  const auto judge_for = [&](const SuitePart& part) -> Result<Judge> {
    if (!arguments.write_scans.empty()) {
      ASBUILT_CHECK(io::write_mesh_ply(arguments.write_scans / (part.name + ".ply"), part.mesh));
    }
    ASBUILT_TRY(made, prepared(part, options, context));
    const auto shared = std::make_shared<const PreparedPart>(std::move(made));
    const auto judge_scan = [&, shared](CaseRecord& record, const CaseScan& scan) -> Result<void> {
      if (!arguments.write_scans.empty()) {  // as `asbuilt detect` reads it, to look at it or to judge it alone
        const std::string stem = fmt::format("{}_{}", record.part, record.seed);
        ASBUILT_CHECK(simulate::write_points(arguments.write_scans / (stem + ".ply"), scan.points_in_scan.positions));
        if (scan.model_from_scan) {
          const std::vector<io::NamedPose> truth = {{stem + ".ply", *scan.model_from_scan}};
          ASBUILT_CHECK(io::write_poses_csv(arguments.write_scans / (stem + ".csv"), truth));
        }
      }
      return judge(record, scan, part, *shared, options, context);
    };
    return [&, judge_scan](CaseRecord& record, const CaseScan& scan) {
      if (arguments.mode == "moved") return judge_scan(record, moved(scan, record.seed));
      return judge_scan(record, scan);
    };
  };
  return run_cases(arguments.selection, mode_name(arguments), judge_for, context);
}

/// What the suite's parts are, and how far each is from its mirror image and from itself turned.
Result<void> describe_parts(const Arguments& arguments) {
  ASBUILT_TRY(parts, suite_parts(arguments.selection));
  const Context context(arguments.selection.threads);
  const std::vector<std::string>& wanted = arguments.selection.parts;
  fmt::print(
      "| part | family | triangles | diameter, mm | mirror image off | turned by: off |\n|---|---|---|---|---|---|\n");
  for (const SuitePart& part : parts) {
    if (!wanted.empty() && std::ranges::find(wanted, part.name) == wanted.end()) continue;
    std::string turns;
    for (const SelfMatch& match : self_matches(part.mesh, false, 6, context)) {
      const Eigen::AngleAxisd turn(match.motion.linear());
      turns += fmt::format(" {:.1f} about ({:.2f} {:.2f} {:.2f}): {:.0f} %", match.angle_deg, turn.axis().x(),
                           turn.axis().y(), turn.axis().z(), 100.0 * match.off_share);
    }
    const auto mirror = self_matches(part.mesh, true, 1, context);
    fmt::print("| {} | {} | {} | {:.1f} | {:.0f} %{} |{} |\n", part.name, part.family, part.mesh.triangles.size(),
               diameter(part.mesh), mirror.empty() ? 100.0 : 100.0 * mirror.front().off_share,
               part.is_own_mirror ? ", its own mirror image" : "", turns);
    std::fflush(stdout);
  }
  return {};
}

std::map<std::string, std::vector<CaseRecord>> by_group(const std::vector<CaseRecord>& records) {
  std::map<std::string, std::vector<CaseRecord>> groups;
  for (const CaseRecord& record : records) groups[record.group].push_back(record);
  return groups;
}

/// Takes out the records of parts that are not of the group.
Result<void> keep_only(std::vector<CaseRecord>& records, Selection selection, const std::string& group) {
  selection.group = group;
  ASBUILT_TRY(parts, suite_parts(selection));
  std::erase_if(records, [&](const CaseRecord& record) {
    return std::ranges::find(parts, record.part, &SuitePart::name) == parts.end();
  });
  return {};
}

Result<void> summarise(const Arguments& arguments) {
  const std::filesystem::path& output = arguments.selection.output;
  ASBUILT_TRY(records, read_records(output / "cases.jsonl"));
  if (!arguments.only.empty()) ASBUILT_CHECK(keep_only(records, arguments.selection, arguments.only));
  const std::string suffix = arguments.only.empty() ? "" : "_" + arguments.only;
  nlohmann::ordered_json summary = summary_of(records);
  const std::string text = tables(summary);
  for (const auto& [group, own] : by_group(records)) {
    for (const Diagram& diagram : diagrams_of(own)) {
      ASBUILT_CHECK(io::write_file(output / fmt::format("{}_{}{}.svg", group, diagram.file, suffix), to_svg(diagram)));
      for (const Series& series : diagram.series) {
        summary["curves"][group][diagram.file][series.name] = {{"x", series.x}, {"y", series.y}};
      }
    }
  }
  ASBUILT_CHECK(io::write_file(output / fmt::format("summary{}.json", suffix), summary.dump(1) + "\n"));
  ASBUILT_CHECK(io::write_file(output / fmt::format("summary{}.md", suffix), text));
  fmt::print("{}", text);
  return {};
}

int run(int argc, char** argv) {
  Arguments arguments;
  Selection& selection = arguments.selection;
  CLI::App app("The detection suite: simulated scans with and without the part, judged as the product judges them");
  app.require_subcommand(1);
  CLI::App* cases = app.add_subcommand("cases", "Run cases and append a line for each to OUT/cases.jsonl");
  add_options(*cases, selection);
  cases->add_option("--mode", arguments.mode, "default, moved (to a frame of its own), none (no viewpoint) or paper")
      ->check(CLI::IsMember({"default", "moved", "none", "paper"}))
      ->capture_default_str();
  cases->add_option("--set", arguments.settings, "NAME=VALUE for any option of the product, for ablations");
  cases
      ->add_option(
          "--write", arguments.write_scans,
          "folder for the scans themselves, as PART_SEED.ply, their true poses, PART_SEED.csv, and the part, PART.ply")
      ->check(CLI::ExistingDirectory);
  CLI::App* summary = app.add_subcommand("summary", "Figures of OUT/cases.jsonl: summary.json, summary.md, curves");
  summary->add_option("output", selection.output, "OUT")->required();
  summary->add_option("--data", selection.data, "as for cases; --only needs it");
  summary->add_option("--only", arguments.only, "only the distinct or the symmetric parts; writes summary_GROUP.*")
      ->check(CLI::IsMember({"distinct", "symmetric"}));
  CLI::App* list = app.add_subcommand("parts", "Print the parts, with brute-force figures of their symmetry");
  list->add_option("--data", selection.data, "folder with cad/; else only our own parts");
  list->add_option("--group", selection.group, "distinct, symmetric or all")->capture_default_str();
  list->add_option("--part", selection.parts, "only these");
  CLI11_PARSE(app, argc, argv);

  const Result<void> done = cases->parsed()     ? judge_cases(arguments)
                            : summary->parsed() ? summarise(arguments)
                                                : describe_parts(arguments);
  if (done) return 0;
  fmt::print(stderr, "asbuilt_detection: {}\n", done.error().message);
  return 1;
}

}  // namespace
}  // namespace asbuilt::bench

int main(int argc, char** argv) {
  return asbuilt::bench::run_program("asbuilt_detection", asbuilt::bench::run, argc, argv);
}
