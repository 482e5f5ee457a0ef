// SPDX-License-Identifier: Apache-2.0
#include "selection.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cstdio>
#include <set>
#include <string_view>
#include <utility>

namespace asbuilt::bench {
namespace {

/// "A..B" or "A/B" as two numbers.
Result<std::pair<std::uint64_t, std::uint64_t>> number_pair(std::string_view text, std::string_view separator) {
  const auto parse = [](std::string_view digits, std::uint64_t& value) {
    const char* last = digits.data() + digits.size();
    const auto [end, error] = std::from_chars(digits.data(), last, value);
    return error == std::errc() && end == last;
  };
  const std::size_t at = text.find(separator);
  std::pair<std::uint64_t, std::uint64_t> numbers;
  if (at != std::string_view::npos && parse(text.substr(0, at), numbers.first) &&
      parse(text.substr(at + separator.size()), numbers.second)) {
    return numbers;
  }
  return fail(ErrorCode::invalid_argument, fmt::format("'{}' is not two numbers with '{}' between", text, separator));
}

bool is_wanted(const std::vector<std::string>& names, const std::string& name) {
  return names.empty() || std::ranges::find(names, name) != names.end();
}

void tell(const CaseRecord& record) {
  const char* truth = record.found() ? " right" : record.wrong() ? " WRONG" : "";
  fmt::print(stderr, "{} {} {} {}, hidden {:.2f}: {} {}{}, {:.1f} s\n", record.mode, record.seed, record.part,
             record.content, record.hidden, record.status, record.reason_code, truth, record.seconds());
}

}  // namespace

void add_options(CLI::App& app, Selection& selection) {
  app.add_option("output", selection.output, "OUT; cases that OUT/cases.jsonl holds already are not run again")
      ->required();
  app.add_option("--seeds", selection.seeds, "FIRST..LAST, one scan a seed")->capture_default_str();
  app.add_option("--stride", selection.stride, "only every so many-th of the seeds")->capture_default_str();
  app.add_option("--shard", selection.shard, "I/N: the I-th (from 0) of N processes")->capture_default_str();
  app.add_option("--data", selection.data, "folder with cad/ (bench/README.md); else only our own parts");
  app.add_option("--group", selection.group, "distinct, symmetric or all: the list of parts")->capture_default_str();
  app.add_option("--part", selection.parts, "only the cases of these parts");
  app.add_option("--point-share", selection.point_share, "scales the points of all scans")->capture_default_str();
  app.add_option("--threads", selection.threads, "0: all cores")->capture_default_str();
}

Result<std::vector<SuitePart>> suite_parts(const Selection& selection) {
  std::vector<SuitePart> parts = own_parts();
  if (!selection.data.empty()) {
    ASBUILT_TRY(more, parts_of(selection.data / "cad"));
    std::ranges::move(more, std::back_inserter(parts));
  }
  if (selection.group != "all") {
    std::erase_if(parts, [&](const SuitePart& part) { return name_of(part.group) != selection.group; });
  }
  if (parts.empty()) {
    return fail(ErrorCode::invalid_argument, fmt::format("there is no part in the group '{}'", selection.group));
  }
  return parts;
}

Result<std::vector<Case>> open_cases(const Selection& selection, const std::string& mode,
                                     const std::vector<SuitePart>& parts) {
  ASBUILT_TRY(range, number_pair(selection.seeds, ".."));
  ASBUILT_TRY(shard, number_pair(selection.shard, "/"));
  if (shard.first >= shard.second || selection.stride == 0) {
    return fail(ErrorCode::invalid_argument, "a shard is I/N with I below N, and the stride at least 1");
  }
  ASBUILT_TRY(records, read_records(selection.output / "cases.jsonl"));
  std::set<std::uint64_t> done;
  for (const CaseRecord& record : records) {
    if (record.mode == mode && record.group == selection.group) done.insert(record.seed);
  }
  std::vector<Case> cases;
  std::uint64_t number = 0;
  for (std::uint64_t seed = range.first; seed <= range.second; seed += selection.stride) {
    const bool own = number++ % shard.second == shard.first;
    if (!own || done.contains(seed)) continue;
    const Case the_case = case_of(seed, parts, selection.point_share);
    if (is_wanted(selection.parts, parts[the_case.part].name)) cases.push_back(the_case);
  }
  std::ranges::stable_sort(cases, {}, &Case::part);
  return cases;
}

Result<void> run_cases(const Selection& selection, const std::string& mode,
                       const std::function<Result<Judge>(const SuitePart&)>& judge_for, const Context& context) {
  ASBUILT_TRY(parts, suite_parts(selection));
  std::filesystem::create_directories(selection.output);
  ASBUILT_TRY(cases, open_cases(selection, mode, parts));
  Judge judge;
  StepTime preparation;
  std::size_t judged_part = parts.size();
  for (const Case& the_case : cases) {
    const SuitePart& part = parts[the_case.part];
    if (the_case.part != judged_part) {
      judge = nullptr;
      preparation = {};
      const Timed timed(preparation);
      ASBUILT_TRY(made, judge_for(part));
      judge = std::move(made);
      judged_part = the_case.part;
    }
    ASBUILT_TRY(scan, scan_of(the_case, parts, context));
    CaseRecord record = record_of(the_case, part, scan);
    record.mode = mode;
    record.group = selection.group;
    record.prepare_model = preparation;
    ASBUILT_CHECK(judge(record, scan));
    ASBUILT_CHECK(append(selection.output / "cases.jsonl", record));
    tell(record);
  }
  return {};
}

}  // namespace asbuilt::bench
