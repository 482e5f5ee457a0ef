// SPDX-License-Identifier: Apache-2.0
#include "options.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <optional>

namespace asbuilt::cli {
namespace {

using pipeline::Half;

constexpr const char* kHelpGroup = "When detection needs help";

std::string group_of(Half half) {
  switch (half) {
    case Half::model:
      return "The model";
    case Half::scan:
      return "Each scan: preparation, detection, verification";
    case Half::joint:
      return "All scans: graph, refinement, fusion, inspection";
  }
  return {};
}

void add_scan_options(CLI::App& command, pipeline::Options& options) {
  command
      .add_option_function<std::vector<std::string>>(
          "--scan-unit",
          [&options](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) {
              if (text.find(':') != std::string::npos) {
                const auto own = pipeline::parse_unit_of_scan(text);
                if (!own) throw CLI::ValidationError("--scan-unit", own.error().message);
                options.scan_units.push_back(text);
                continue;
              }
              const auto unit = io::unit_from_name(text);
              if (!unit) throw CLI::ValidationError("--scan-unit", unit.error().message);
              options.scan_unit = *unit;
            }
          },
          "Unit of the scans: mm, cm, m, inch or foot, or SCAN:UNIT for one of them; may be given several times (as "
          "the file states, else mm)")
      ->allow_extra_args(false);
  command.add_option(
      "--columns", options.columns,
      "Columns of text scans, out of x y z nx ny nz r g b i, with - for others: for example x,y,z,-,r,g,b");
  command.add_option("--camera", options.camera,
                     "Camera of depth images: fx,fy,cx,cy in pixels (and the steps of depth in a unit), or a file");
  command
      .add_option("--viewpoint", options.viewpoint,
                  "Where the sensor stood, in the scan's coordinates: auto, none, x,y,z, dir:dx,dy,dz, or a CSV file "
                  "with rows SCAN,x,y,z")
      ->capture_default_str();
  command
      .add_option_function<std::string>(
          "--instances",
          [&options](const std::string& name) {
            options.instances = name == "all" ? pipeline::Instances::all : pipeline::Instances::one;
          },
          "Placements of the part in one scan: one (a second makes the scan ambiguous) or all (each is a detection of "
          "its own)")
      ->check(CLI::IsMember({"one", "all"}))
      ->default_str("one");
  command.add_option("--poses", options.poses, "Poses to start from: CSV rows SCAN,a11,...,a44, or JSON")
      ->group(kHelpGroup);
}

void add_choices_about_scans(CLI::App& command, pipeline::Options& options) {
  command.add_option("--exclude", options.exclude, "A scan to leave out; may be given several times")
      ->allow_extra_args(false)
      ->group(kHelpGroup);
  command
      .add_option("--accept", options.accept,
                  "SCAN:CANDIDATE, a candidate that you vouch for (asbuilt explain lists them)")
      ->allow_extra_args(false)
      ->group(kHelpGroup);
}

void add_joint_options(CLI::App& command, pipeline::Options& options) {
  command.add_flag("--mesh", options.mesh, "Also write mesh.ply, a surface mesh, open where nothing was scanned");
  command.add_flag("--watertight", options.watertight,
                   "Also write mesh_watertight.ply: the CAD's skin moved onto what was scanned, the rest filled in");
  command
      .add_option_function<std::string>(
          "--gauge",
          [&options](const std::string& name) {
            options.gauge = name == "fixed" ? pipeline::Gauge::fixed : pipeline::Gauge::best_fit;
          },
          "How the whole is brought into the model frame: best_fit or fixed (to the fixed scan)")
      ->check(CLI::IsMember({"best_fit", "fixed"}))
      ->default_str("best_fit");
  add_inspection_options(command, options);
}

std::optional<inspect::Tolerance> low_and_high(const std::string& text) {
  inspect::Tolerance tolerance;
  const char* const end = text.data() + text.size();
  const auto low = std::from_chars(text.data(), end, tolerance.low_mm);
  if (low.ec != std::errc() || low.ptr == end || *low.ptr != ',') return std::nullopt;
  const auto high = std::from_chars(low.ptr + 1, end, tolerance.high_mm);
  return high.ec == std::errc() && high.ptr == end ? std::optional(tolerance) : std::nullopt;
}

void take_tolerance(const std::string& text, pipeline::Options& options) {
  options.inspect.tolerance = low_and_high(text);
  if (options.inspect.tolerance) return;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(text, ignored)) {
    throw CLI::ValidationError("--tolerance",
                               fmt::format("found '{}', expected LOW,HIGH in mm, for example -0.5,0.5, or a "
                                           "CSV or JSON file that exists",
                                           text));
  }
  options.tolerance_file = text;
}

}  // namespace

std::string flag_of(const std::string& field) {
  std::string flag = "--" + field;
  std::ranges::replace(flag, '_', '-');
  return flag;
}

void add_unit_option(CLI::App& command, const std::string& name, io::Unit& unit, const std::string& help) {
  command.add_option_function<std::string>(
      name,
      [&unit, name](const std::string& text) {
        const auto parsed = io::unit_from_name(text);
        if (!parsed) throw CLI::ValidationError(name, parsed.error().message);
        unit = *parsed;
      },
      help + " (as the file states, else mm)");
}

void add_inspection_options(CLI::App& command, pipeline::Options& options) {
  constexpr const char* kGroup = "Inspection";
  command
      .add_option_function<std::string>(
          "--tolerance", [&options](const std::string& text) { take_tolerance(text, options); },
          "LOW,HIGH in mm: deviations that the drawing allows, or a CSV or JSON file with one per CAD face or box; "
          "exit "
          "code 6 unless the verdict is pass")
      ->group(kGroup);
  command
      .add_option_function<std::string>(
          "--alignment",
          [&options](const std::string& name) {
            options.alignment = name == "best-fit" ? pipeline::Alignment::best_fit : pipeline::Alignment::as_refined;
          },
          "What deviations are measured from: as-refined (as it is) or best-fit (one rigid motion, robust, no scale)")
      ->check(CLI::IsMember({"as-refined", "best-fit"}))
      ->default_str("as-refined")
      ->group(kGroup);
  command
      .add_option("--align-on", options.align_on,
                  "Best fit onto: all, faces:N,N,... (CAD faces), or a CSV file of points on the model")
      ->capture_default_str()
      ->group(kGroup);
  command
      .add_option("--reference", options.reference,
                  "CSV of check points measured by other means, in the model frame: [name,]x,y,z[,sigma] in mm")
      ->group(kGroup);
  command.add_flag("--views", options.views, "Also write views/*.png")->group(kGroup);
  command.add_flag("--colour-steps", options.colour_steps, "Pictures in discrete colours")->group(kGroup);
}

void add_common_options(CLI::App& command, Shell& shell, bool has_output) {
  CommonOptions& common = shell.common;
  constexpr const char* kGroup = "Common";
  command.add_option("--threads", common.threads, "Threads to use (0: all cores)")
      ->check(CLI::Range(0, 1024))
      ->group(kGroup);
  command
      .add_option(
          "--memory", common.memory_gb,
          "Gigabytes to use at most: scans that need more are thinned to find the part (0: half of the machine's for "
          "a scan, no limit otherwise)")
      ->check(CLI::NonNegativeNumber)
      ->group(kGroup);
  command.add_flag("-q,--quiet", common.quiet, "No progress and no summary")->group(kGroup);
  command.add_flag("--json", common.json, "The result as JSON on standard output")->group(kGroup);
  if (has_output) {
    command.add_flag("--force", common.force, "Write into an existing folder, and start anew")->group(kGroup);
  }
  // Read before the other options (see config.cpp); listed here for --help.
  command.add_option("--config", "TOML file with any of these options")->group(kGroup)->expected(1);
}

void add_pipeline_options(CLI::App& command, pipeline::Options& options, std::initializer_list<Half> halves) {
  const auto wanted = [&](Half half) { return std::ranges::find(halves, half) != halves.end(); };
  if (wanted(Half::model)) {
    add_unit_option(command, "--unit", options.model_unit, "Unit of the model: mm, cm, m, inch or foot");
    command
        .add_option("--tessellation-tolerance", options.tessellation_tolerance,
                    "STEP, IGES, BREP: how far triangles may stray from the surface, as a share of the diameter")
        ->check(CLI::Range(1e-6, 0.05))
        ->capture_default_str();
  }
  if (wanted(Half::scan)) add_scan_options(command, options);
  if (wanted(Half::scan) || wanted(Half::joint)) {
    add_choices_about_scans(command, options);
    command.add_flag("--paper-mode", options.paper_mode, "Exactly the published method");
    command.add_option("--seed", options.seed, "Seed of all random choices")->capture_default_str();
  }
  if (wanted(Half::joint)) add_joint_options(command, options);
  pipeline::for_each_stage_field(options, [&](Half half, const std::string& name, auto& value, std::string_view help) {
    if (wanted(half)) add_field(command, name, value, std::string(help), group_of(half));
  });
}

}  // namespace asbuilt::cli
