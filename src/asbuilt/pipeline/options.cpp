// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/options.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>

#include "asbuilt/pipeline/scan_hints.h"

namespace asbuilt::pipeline {
namespace {

constexpr std::string_view kGaugeNames[] = {"best_fit", "fixed"};
constexpr std::string_view kInstancesNames[] = {"one", "all"};
constexpr std::string_view kAlignmentNames[] = {"as_refined", "best_fit"};

io::OptionValue value_of(bool value) { return value; }
io::OptionValue value_of(int value) { return std::int64_t{value}; }
io::OptionValue value_of(double value) { return value; }

bool take(bool& target, const io::OptionValue& value) {
  const auto* held = std::get_if<bool>(&value);
  if (held != nullptr) target = *held;
  return held != nullptr;
}
bool take(std::string& target, const io::OptionValue& value) {
  const auto* held = std::get_if<std::string>(&value);
  if (held != nullptr) target = *held;
  return held != nullptr;
}
bool take(std::vector<std::string>& target, const io::OptionValue& value) {
  const auto* held = std::get_if<std::vector<std::string>>(&value);
  if (held != nullptr) target = *held;
  return held != nullptr;
}
bool take(int& target, const io::OptionValue& value) {
  const auto* held = std::get_if<std::int64_t>(&value);
  if (held != nullptr) target = static_cast<int>(*held);
  return held != nullptr;
}
bool take(std::uint64_t& target, const io::OptionValue& value) {
  const auto* held = std::get_if<std::int64_t>(&value);
  if (held != nullptr) target = static_cast<std::uint64_t>(*held);
  return held != nullptr;
}
bool take(double& target, const io::OptionValue& value) {
  if (const auto* whole = std::get_if<std::int64_t>(&value)) {
    target = static_cast<double>(*whole);
    return true;
  }
  const auto* held = std::get_if<double>(&value);
  if (held != nullptr) target = *held;
  return held != nullptr;
}
bool take(io::Unit& target, const io::OptionValue& value) {
  const auto* held = std::get_if<std::string>(&value);
  if (held == nullptr) return false;
  const auto unit = *held == "stated" ? Result<io::Unit>(io::Unit::stated) : io::unit_from_name(*held);
  if (unit) target = *unit;
  return unit.has_value();
}
bool take(Gauge& target, const io::OptionValue& value) {
  const auto* held = std::get_if<std::string>(&value);
  if (held == nullptr) return false;
  target = *held == kGaugeNames[1] ? Gauge::fixed : Gauge::best_fit;
  return *held == kGaugeNames[0] || *held == kGaugeNames[1];
}
bool take(Instances& target, const io::OptionValue& value) {
  const auto* held = std::get_if<std::string>(&value);
  if (held == nullptr) return false;
  target = *held == kInstancesNames[1] ? Instances::all : Instances::one;
  return *held == kInstancesNames[0] || *held == kInstancesNames[1];
}

std::string unit_name(io::Unit unit) {
  return unit == io::Unit::stated ? std::string("stated") : std::string(io::name_of(unit));
}

}  // namespace

Result<void> Options::validate() const {
  ASBUILT_CHECK(model.validate());
  ASBUILT_CHECK(scan.validate());
  ASBUILT_CHECK(detect.validate());
  ASBUILT_CHECK(verify.validate());
  ASBUILT_CHECK(graph.validate());
  ASBUILT_CHECK(refine.validate());
  ASBUILT_CHECK(fuse.validate());
  ASBUILT_CHECK(surface_mesh.validate());
  ASBUILT_CHECK(inspect.validate());
  for (const std::string& text : accept) {
    if (auto acceptance = parse_acceptance(text); !acceptance) return tl::unexpected(acceptance.error());
  }
  for (const std::string& text : scan_units) {
    if (auto unit = parse_unit_of_scan(text); !unit) return tl::unexpected(unit.error());
  }
  return {};
}

io::ReadOptions scan_reading(const Options& options, const std::string& path, const Context& context) {
  io::ReadOptions reading = options.scan_unit;
  const std::string name = std::filesystem::path(path).stem().string();
  for (const std::string& text : options.scan_units) {
    const auto own = parse_unit_of_scan(text);  // validated before
    if (own && names_scan(own->scan, path, name)) reading.unit = own->unit;
  }
  reading.columns = options.columns;
  reading.camera = options.camera;
  reading.context = context;
  return reading;
}

io::ModelReadOptions model_reading(const Options& options) {
  io::ModelReadOptions reading = options.model_unit;
  reading.tessellation_tolerance = options.tessellation_tolerance;
  return reading;
}

Options with_paper_mode_applied(const Options& options) {
  Options applied = options;
  if (!options.paper_mode) return applied;
  applied.detect = options.detect.as_published();
  applied.verify = options.verify.as_published();
  applied.graph.paper_mode = true;
  applied.refine = options.refine.as_published();
  applied.fuse.paper_mode = true;
  applied.gauge = Gauge::fixed;
  return applied;
}

io::Options recorded(const Options& options, std::initializer_list<Half> halves) {
  const auto wanted = [&](Half half) { return std::ranges::find(halves, half) != halves.end(); };
  io::Options record;
  if (wanted(Half::model)) {
    record.emplace_back("unit", unit_name(options.model_unit));
    record.emplace_back("tessellation_tolerance", options.tessellation_tolerance);
  }
  if (wanted(Half::scan)) {
    record.emplace_back("scan_unit", unit_name(options.scan_unit));
    record.emplace_back("scan_units", options.scan_units);
    record.emplace_back("columns", options.columns);
    record.emplace_back("camera", options.camera);
    record.emplace_back("viewpoint", options.viewpoint);
    record.emplace_back("poses", options.poses);
    record.emplace_back("exclude", options.exclude);
    record.emplace_back("accept", options.accept);
    record.emplace_back("instances", std::string(kInstancesNames[static_cast<int>(options.instances)]));
    record.emplace_back("seed", static_cast<std::int64_t>(options.seed));
    record.emplace_back("memory", options.memory_gb);
    record.emplace_back("paper_mode", options.paper_mode);
  }
  Options fields = options;  // the visitor wants something it may write to
  for_each_stage_field(fields, [&](Half half, const std::string& name, auto& value, std::string_view) {
    if (half != Half::joint && wanted(half)) record.emplace_back(name, value_of(value));
  });
  if (!wanted(Half::joint)) return record;
  record.emplace_back("joint_paper_mode", options.paper_mode);
  record.emplace_back("gauge", std::string(kGaugeNames[static_cast<int>(options.gauge)]));
  record.emplace_back("mesh", options.mesh);
  record.emplace_back("watertight", options.watertight);
  std::vector<std::string> tolerance;
  if (options.inspect.tolerance) {
    tolerance = {fmt::format("{}", options.inspect.tolerance->low_mm),
                 fmt::format("{}", options.inspect.tolerance->high_mm)};
  }
  record.emplace_back("tolerance", tolerance);
  record.emplace_back("tolerance_file", options.tolerance_file);
  record.emplace_back("reference", options.reference);
  record.emplace_back("alignment", std::string(kAlignmentNames[static_cast<int>(options.alignment)]));
  record.emplace_back("align_on", options.align_on);
  for_each_stage_field(fields, [&](Half half, const std::string& name, auto& value, std::string_view) {
    if (half == Half::joint) record.emplace_back(name, value_of(value));
  });
  return record;
}

Result<void> take_over(Options& options, const io::Options& record) {
  const auto assign = [&record](std::string_view name, auto& target) -> Result<void> {
    const auto found =
        std::ranges::find(record, name, [](const auto& option) { return std::string_view(option.first); });
    if (found == record.end() || take(target, found->second)) return {};
    return fail(ErrorCode::invalid_argument,
                fmt::format("the recorded option '{}' has a value of the wrong kind", name));
  };
  ASBUILT_CHECK(assign("unit", options.model_unit));
  ASBUILT_CHECK(assign("scan_unit", options.scan_unit));
  ASBUILT_CHECK(assign("scan_units", options.scan_units));
  ASBUILT_CHECK(assign("tessellation_tolerance", options.tessellation_tolerance));
  ASBUILT_CHECK(assign("columns", options.columns));
  ASBUILT_CHECK(assign("camera", options.camera));
  ASBUILT_CHECK(assign("viewpoint", options.viewpoint));
  ASBUILT_CHECK(assign("poses", options.poses));
  ASBUILT_CHECK(assign("exclude", options.exclude));
  ASBUILT_CHECK(assign("accept", options.accept));
  ASBUILT_CHECK(assign("instances", options.instances));
  ASBUILT_CHECK(assign("seed", options.seed));
  ASBUILT_CHECK(assign("memory", options.memory_gb));
  ASBUILT_CHECK(assign("paper_mode", options.paper_mode));
  ASBUILT_CHECK(assign("gauge", options.gauge));
  ASBUILT_CHECK(assign("mesh", options.mesh));
  ASBUILT_CHECK(assign("watertight", options.watertight));
  Result<void> outcome;
  for_each_stage_field(options, [&](Half, const std::string& name, auto& value, std::string_view) {
    if (outcome) outcome = assign(name, value);
  });
  return outcome;
}

io::Options recorded_inspection(const Options& options) {
  constexpr std::string_view kOwn[] = {"tolerance", "tolerance_file", "reference", "alignment", "align_on"};
  io::Options record = recorded(options, {Half::model});
  record.emplace_back("scan_unit", unit_name(options.scan_unit));
  for (auto& option : recorded(options, {Half::joint})) {
    const bool is_own = option.first.starts_with("inspect_") || std::ranges::find(kOwn, option.first) != std::end(kOwn);
    if (is_own) record.push_back(std::move(option));
  }
  return record;
}

io::Options merged(io::Options earlier, const io::Options& later) {
  for (const auto& [name, value] : later) {
    const auto found = std::ranges::find(earlier, name, &io::Options::value_type::first);
    if (found != earlier.end()) {
      found->second = value;
    } else {
      earlier.emplace_back(name, value);
    }
  }
  return earlier;
}

Result<Acceptance> parse_acceptance(std::string_view text) {
  const std::size_t colon = text.rfind(':');
  Acceptance acceptance;
  if (colon != std::string_view::npos && colon > 0) {
    acceptance.scan = text.substr(0, colon);
    const std::string_view number = text.substr(colon + 1);
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), acceptance.candidate);
    if (error == std::errc() && end == number.data() + number.size() && acceptance.candidate >= 0) return acceptance;
  }
  return fail(ErrorCode::invalid_argument,
              fmt::format("--accept {}: expected SCAN:CANDIDATE, for example scan_03:1 (asbuilt explain lists the "
                          "candidates of a scan)",
                          text));
}

Result<UnitOfScan> parse_unit_of_scan(std::string_view text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos || colon == 0) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("--scan-unit {}: expected UNIT or SCAN:UNIT, for example scan_03.ply:m", text));
  }
  const auto unit = io::unit_from_name(text.substr(colon + 1));
  if (!unit) return fail(unit.error().code, fmt::format("--scan-unit {}: {}", text, unit.error().message));
  return UnitOfScan{std::string(text.substr(0, colon)), *unit};
}

}  // namespace asbuilt::pipeline
