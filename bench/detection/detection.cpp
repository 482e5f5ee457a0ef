// SPDX-License-Identifier: Apache-2.0
// asbuilt_detection: the suite of simulated scans for detection and verification. bench/detection/run calls it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cstdio>
#include <exception>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "asbuilt/io/file.h"
#include "cases.h"
#include "parts.h"
#include "product.h"
#include "record.h"
#include "summary.h"

namespace asbuilt::bench {
namespace {

struct Arguments {
  std::filesystem::path data, output;
  std::string seeds = "1..120", group = "distinct", mode = "default", shard = "0/1";
  std::vector<std::string> parts, settings;
  std::uint64_t stride = 1;
  double point_share = 1.0;
  int threads = 0;

  [[nodiscard]] std::filesystem::path cases_file() const { return output / "cases.jsonl"; }
};

/// "A..B" or "A/B" as two numbers.
Result<std::pair<std::uint64_t, std::uint64_t>> number_pair(const std::string& text, std::string_view separator) {
  const std::size_t at = text.find(separator);
  std::uint64_t first = 0, second = 0;
  const auto parse = [](std::string_view digits, std::uint64_t& value) {
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    return error == std::errc() && end == digits.data() + digits.size();
  };
  if (at == std::string::npos || !parse(std::string_view(text).substr(0, at), first) ||
      !parse(std::string_view(text).substr(at + separator.size()), second)) {
    return fail(ErrorCode::invalid_argument, fmt::format("'{}' is not two numbers with {} between", text, separator));
  }
  return std::pair(first, second);
}

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

Result<std::vector<SuitePart>> suite_parts(const Arguments& arguments) {
  std::vector<SuitePart> parts = own_parts();
  if (!arguments.data.empty()) {
    ASBUILT_TRY(more, parts_of(arguments.data / "cad"));
    std::ranges::move(more, std::back_inserter(parts));
  }
  std::erase_if(parts, [&](const SuitePart& part) { return name_of(part.group) != arguments.group; });
  if (parts.empty()) return fail(ErrorCode::invalid_argument, fmt::format("no part is {}", arguments.group));
  return parts;
}

/// What this process has to do, part by part, so that each is prepared once and one at a time.
Result<std::vector<Case>> wanted_cases(const Arguments& arguments, const std::vector<SuitePart>& parts) {
  ASBUILT_TRY(range, number_pair(arguments.seeds, ".."));
  ASBUILT_TRY(shard, number_pair(arguments.shard, "/"));
  if (shard.second == 0 || shard.first >= shard.second || arguments.stride == 0) {
    return fail(ErrorCode::invalid_argument, "a shard is I/N with I below N, and the stride at least 1");
  }
  ASBUILT_TRY(records, read_records(arguments.cases_file()));
  std::set<std::uint64_t> done;
  for (const CaseRecord& record : records) {
    if (record.mode == arguments.mode && record.group == arguments.group) done.insert(record.seed);
  }
  std::vector<Case> cases;
  std::uint64_t number = 0;
  for (std::uint64_t seed = range.first; seed <= range.second; seed += arguments.stride) {
    const bool own = number++ % shard.second == shard.first;
    if (!own || done.contains(seed)) continue;
    const Case the_case = case_of(seed, parts, arguments.point_share);
    const bool wanted =
        arguments.parts.empty() || std::ranges::find(arguments.parts, parts[the_case.part].name) != arguments.parts.end();
    if (wanted) cases.push_back(the_case);
  }
  std::ranges::stable_sort(cases, {}, &Case::part);
  return cases;
}

Result<void> run_cases(const Arguments& arguments) {
  ASBUILT_TRY(options, options_of(arguments));
  ASBUILT_TRY(parts, suite_parts(arguments));
  std::filesystem::create_directories(arguments.output);
  ASBUILT_TRY(cases, wanted_cases(arguments, parts));
  const Context context(arguments.threads);
  std::optional<PreparedPart> part;
  std::size_t part_index = parts.size();
  for (const Case& the_case : cases) {
    const SuitePart& suite_part = parts[the_case.part];
    if (the_case.part != part_index) {
      part.reset();
      ASBUILT_TRY(made, prepared(suite_part, options, context));
      part = std::move(made);
      part_index = the_case.part;
    }
    ASBUILT_TRY(scan, scan_of(the_case, parts, context));
    CaseRecord record = record_of(the_case, suite_part, scan);
    record.mode = arguments.mode;
    ASBUILT_CHECK(judge(record, scan, suite_part, *part, options, context));
    ASBUILT_CHECK(append(arguments.cases_file(), record));
    fmt::print(stderr, "{} {} {} hidden {:.2f}: {} {}{}, {:.1f} s\n", record.seed, record.part, record.content,
               record.hidden, record.status, record.reason_code,
               record.found() ? "right" : record.wrong() ? "WRONG" : "", record.seconds());
  }
  return {};
}

Result<void> summarise(const Arguments& arguments) {
  ASBUILT_TRY(records, read_records(arguments.cases_file()));
  const nlohmann::ordered_json summary = summary_of(records);
  const std::string text = tables(summary);
  ASBUILT_CHECK(io::write_file(arguments.output / "summary.json", summary.dump(1) + "\n"));
  ASBUILT_CHECK(io::write_file(arguments.output / "summary.md", text));
  fmt::print("{}", text);
  return {};
}

int run(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("The detection suite: simulated scans with and without the part, judged as the product judges them");
  app.require_subcommand(1);
  CLI::App* cases = app.add_subcommand("cases", "Run cases and append a line for each to OUT/cases.jsonl");
  cases->add_option("output", arguments.output, "OUT; cases that it holds already are not run again")->required();
  cases->add_option("--seeds", arguments.seeds, "FIRST..LAST, one scan a seed")->capture_default_str();
  cases->add_option("--stride", arguments.stride, "take every so many-th seed only")->capture_default_str();
  cases->add_option("--shard", arguments.shard, "I/N: the I-th (from 0) of N processes")->capture_default_str();
  cases->add_option("--data", arguments.data, "folder with cad/ (see bench/README.md); else only our own parts");
  cases->add_option("--group", arguments.group, "distinct or symmetric")->capture_default_str();
  cases->add_option("--part", arguments.parts, "only the cases of these parts");
  cases->add_option("--mode", arguments.mode, "default, none (no viewpoint) or paper")
      ->check(CLI::IsMember({"default", "none", "paper"}))
      ->capture_default_str();
  cases->add_option("--set", arguments.settings, "NAME=VALUE for any option of the product, for ablations");
  cases->add_option("--point-share", arguments.point_share, "scales the points of all scans")->capture_default_str();
  cases->add_option("--threads", arguments.threads, "0: all cores")->capture_default_str();
  CLI::App* summary = app.add_subcommand("summary", "Figures of OUT/cases.jsonl: summary.json, summary.md");
  summary->add_option("output", arguments.output, "OUT")->required();
  CLI11_PARSE(app, argc, argv);

  const Result<void> done = cases->parsed() ? run_cases(arguments) : summarise(arguments);
  if (done) return 0;
  fmt::print(stderr, "asbuilt_detection: {}\n", done.error().message);
  return 1;
}

}  // namespace
}  // namespace asbuilt::bench

int main(int argc, char** argv) {
  try {
    return asbuilt::bench::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "asbuilt_detection: %s\n", error.what());
    return 1;
  }
}
