// SPDX-License-Identifier: Apache-2.0
#include "summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "asbuilt/io/file.h"

namespace asbuilt::bench {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kConverged = 0.1;  // sigma, from the run that starts at the true poses

// The trials of one kind, scene and variant.
struct Group {
  std::string kind, scene, variant, note;
  std::map<std::string, std::vector<double>> figures;

  [[nodiscard]] std::size_t count() const {
    std::size_t most = 0;
    for (const auto& [name, values] : figures) most = std::max(most, values.size());
    return most;
  }
  [[nodiscard]] const std::vector<double>& of(const std::string& name) const {
    static const std::vector<double> none;
    const auto found = figures.find(name);
    return found == figures.end() ? none : found->second;
  }
  [[nodiscard]] double median(const std::string& name) const {
    std::vector<double> values = of(name);
    if (values.empty()) return std::nan("");
    std::ranges::sort(values);
    return values[values.size() / 2];
  }
  [[nodiscard]] double worst(const std::string& name) const {
    const auto& values = of(name);
    return values.empty() ? std::nan("") : *std::ranges::max_element(values);
  }
  [[nodiscard]] double sum(const std::string& name) const {
    double total = 0.0;
    for (const double value : of(name)) total += value;
    return total;
  }
};

Result<std::vector<Group>> read_groups(const std::filesystem::path& file) {
  ASBUILT_TRY(text, io::read_file(file));
  std::vector<Group> groups;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const Json json = Json::parse(line, nullptr, false);
    if (!json.is_object() || !json.contains("figures")) {
      return fail(ErrorCode::unreadable_input, fmt::format("{}, line {}: no trial", file.string(), number));
    }
    const auto kind = json.value("kind", ""), scene = json.value("scene", ""), variant = json.value("variant", "");
    auto group = std::ranges::find_if(
        groups, [&](const Group& g) { return g.kind == kind && g.scene == scene && g.variant == variant; });
    if (group == groups.end()) {
      groups.push_back({kind, scene, variant, {}, {}});
      group = groups.end() - 1;
    }
    group->note = json.value("note", "");
    for (const auto& [name, value] : json.at("figures").items()) group->figures[name].push_back(value.get<double>());
  }
  return groups;
}

std::string number(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : std::string("-");
}

std::string start_table(const std::vector<Group>& groups, const std::string& kind, const char* title) {
  std::string rows;
  for (const Group& group : groups) {
    if (group.kind != kind) continue;
    const auto& apart = group.of("from_reference_sigma");
    const auto converged = std::ranges::count_if(apart, [](double x) { return x < kConverged; });
    rows += fmt::format("| {} | {} | {} | {} | {} | {} | {} | {} of {} | {} |\n", group.scene, group.variant,
                        number(group.median("views"), 0), number(group.median("error_sigma"), 3),
                        number(group.worst("error_sigma"), 3), number(group.median("fits_to_truth_sigma"), 3),
                        number(group.worst("ratio"), 4), converged, apart.size(), number(group.median("seconds"), 2));
  }
  if (rows.empty()) return {};
  return fmt::format(
      "## {}\n\n| scene | start off by | scans | error, median (sigma) | worst | of scans fitted to the true surface "
      "one by one | ratio to oracle, worst | within 0.1 sigma of the run from the truth | seconds, median |\n"
      "|---|---|---|---|---|---|---|---|---|\n{}\n",
      title, rows);
}

std::string simple_table(const std::vector<Group>& groups, const std::string& kind, const char* title) {
  std::string rows;
  for (const Group& group : groups) {
    if (group.kind != kind) continue;
    if (group.figures.empty()) {
      rows += fmt::format("| {} | {} | {} | | |\n", group.scene, group.variant, group.note);
      continue;
    }
    rows += fmt::format("| {} | {} | {} | {} | {} |\n", group.scene, group.variant, group.count(),
                        number(group.median("error_sigma"), 3), number(group.median("seconds"), 2));
  }
  if (rows.empty()) return {};
  return fmt::format(
      "## {}\n\n| scene | variant | runs | error, median (sigma) | seconds, median |\n|---|---|---|---|---|\n{}\n",
      title, rows);
}

std::string wrong_table(const std::vector<Group>& groups) {
  std::string rows;
  for (const Group& group : groups) {
    if (group.kind != "wrong") continue;
    rows += fmt::format("| {} | {} | {} | {:.0f} | {:.0f} | {:.0f} | {:.0f} | {:.0f} |\n", group.scene, group.variant,
                        group.count(), group.sum("found"), group.sum("apart") - group.sum("found"), group.sum("mended"),
                        group.sum("others_dropped"), group.sum("rest_as_if_never_there"));
  }
  if (rows.empty()) return {};
  return "## One wrong pose among right ones\n\n| scene | kind | trials | dropped | apart, in no large component | "
         "brought "
         "back to its place | others dropped | the rest within 0.1 sigma of the run without it |\n"
         "|---|---|---|---|---|---|---|---|\n" +
         rows + "\n";
}

// Horizontal bars of median errors, one a group.
std::string bars_svg(const std::vector<Group>& groups, const std::string& kind, const char* title) {
  std::vector<const Group*> chosen;
  double most = 0.0;
  for (const Group& group : groups) {
    const double value = group.median("error_sigma");
    if (group.kind != kind || !std::isfinite(value)) continue;
    chosen.push_back(&group);
    most = std::max(most, value);
  }
  if (chosen.empty() || !(most > 0.0)) return {};
  constexpr double kLeft = 330.0, kWidth = 480.0, kRow = 24.0, kTop = 50.0;
  // Logarithmic: a switch may cost a factor of ten.
  const double low = 0.01, decades = std::max(1.0, std::ceil(std::log10(most / low)));
  const auto at = [&](double value) { return kLeft + kWidth * std::log10(std::max(value, low) / low) / decades; };
  const double height = kTop + kRow * static_cast<double>(chosen.size()) + 45.0;
  std::string svg = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' width='900' height='{0}' viewBox='0 0 900 {0}' font-family='sans-serif' "
      "font-size='14'>\n<rect width='900' height='{0}' fill='white'/>\n<text x='{1}' y='24' text-anchor='middle' "
      "font-size='16'>{2}</text>\n",
      height, 450, title);
  for (int decade = 0; decade <= static_cast<int>(decades); ++decade) {
    const double value = low * std::pow(10.0, decade), x = at(value);
    svg += fmt::format(
        "<path d='M{:.1f} {:.1f}V{:.1f}' stroke='#ddd'/>\n<text x='{:.1f}' y='{:.1f}' "
        "text-anchor='middle'>{:g}</text>\n",
        x, kTop - 8.0, height - 35.0, x, height - 18.0, value);
  }
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const double y = kTop + kRow * static_cast<double>(i), value = chosen[i]->median("error_sigma");
    svg += fmt::format(
        "<text x='{:.1f}' y='{:.1f}' text-anchor='end'>{}, {}</text>\n<rect x='{:.1f}' y='{:.1f}' "
        "width='{:.1f}' height='14' fill='#0072b2'/>\n<text x='{:.1f}' y='{:.1f}'>{:.2f}</text>\n",
        kLeft - 8.0, y + 12.0, chosen[i]->scene, chosen[i]->variant, kLeft, y, std::max(1.0, at(value) - kLeft),
        at(value) + 6.0, y + 12.0, value);
  }
  svg += fmt::format(
      "<text x='{:.1f}' y='{:.1f}' text-anchor='middle'>relative pose error, sigma (median)</text>\n</svg>\n",
      kLeft + 0.5 * kWidth, height - 3.0);
  return svg;
}

}  // namespace

Result<void> write_summary(const std::filesystem::path& folder) {
  ASBUILT_TRY(groups, read_groups(folder / "trials.jsonl"));
  const std::string tables = start_table(groups, "start", "Given scenes, true segments") +
                             start_table(groups, "own", "Own scenes, as-built deviation 0.2 to 1 % of the diameter") +
                             start_table(groups, "cad", "The same of the parts of the CAD folder") +
                             wrong_table(groups) +
                             simple_table(groups, "ablation", "Each switch turned over, 1 degree and 1 % off") +
                             simple_table(groups, "scale", "Many scans, 1 degree and 1 % off") +
                             simple_table(groups, "peer", "Beside Open3D, 3 degrees and 3 % off, the same pairs");
  Json json = Json::array();
  for (const Group& group : groups) {
    Json figures = Json::object();
    for (const auto& [name, values] : group.figures) {
      figures[name] = {{"median", group.median(name)}, {"worst", group.worst(name)}, {"runs", values.size()}};
    }
    json.push_back({{"kind", group.kind}, {"scene", group.scene}, {"variant", group.variant}, {"figures", figures}});
  }
  ASBUILT_CHECK(io::write_file(folder / "summary.md", tables));
  ASBUILT_CHECK(io::write_file(folder / "summary.json", json.dump(1) + "\n"));
  for (const auto& [kind, title] : {std::pair("ablation", "Each switch of the refinement turned over"),
                                    std::pair("start", "Where starts that are off end"),
                                    std::pair("peer", "Beside Open3D's multiway registration")}) {
    const std::string svg = bars_svg(groups, kind, title);
    if (!svg.empty()) ASBUILT_CHECK(io::write_file(folder / (std::string(kind) + ".svg"), svg));
  }
  fmt::print("{}", tables);
  return {};
}

}  // namespace asbuilt::bench
