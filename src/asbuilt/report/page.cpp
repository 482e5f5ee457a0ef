// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/report/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "asbuilt/io/base64.h"
#include "asbuilt/report/describe.h"
#include "asbuilt/report/views.h"
#include "asbuilt/web/pages.h"

namespace asbuilt::report {
namespace {

constexpr std::string_view kStyle = R"(
:root { color-scheme: light; --ink: #23292f; --faint: #68717a; --line: #d9dde1; }
body { font: 15px/1.45 system-ui, "Segoe UI", sans-serif; color: var(--ink); max-width: 66rem; margin: 0 auto; padding: 1rem; }
h1 { font-size: 1.5rem; margin: .3rem 0; } h2 { font-size: 1.1rem; margin: 2rem 0 .5rem; border-bottom: 1px solid var(--line); }
.verdict { padding: .8rem 1rem; border-left: .5rem solid #888; background: #f4f5f6; }
.verdict.pass { border-color: #2166ac; } .verdict.fail { border-color: #b2182b; }
.verdict strong { font-size: 1.3rem; text-transform: uppercase; }
.scroll { overflow-x: auto; } table { border-collapse: collapse; font-size: .88rem; }
th, td { text-align: left; padding: .25rem .7rem .25rem 0; border-bottom: 1px solid var(--line); vertical-align: top; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(9rem, 1fr)); gap: .6rem; margin: 1rem 0; }
.figures div { border: 1px solid var(--line); padding: .5rem .7rem; } .figures b { display: block; font-size: 1.15rem; }
.figures span, .note { color: var(--faint); font-size: .85rem; }
.views { display: grid; grid-template-columns: repeat(auto-fit, minmax(18rem, 1fr)); gap: .6rem; } .views img { width: 100%; }
code { font-size: .8rem; word-break: break-all; }
@media print { body { max-width: none; } h2 { break-after: avoid; } tr, img { break-inside: avoid; } }
)";

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

std::string json_for_script(std::string_view json) {
  std::string result;
  result.reserve(json.size());
  for (const char c : json) {
    if (c == '<') {
      result += "\\u003c";
    } else {
      result += c;
    }
  }
  return result;
}

std::string percent(const std::optional<double>& share) {
  return share ? fmt::format("{:.1f} %", 100.0 * *share) : std::string("\u2013");
}

std::string figure(std::string_view value, std::string_view name) {
  return fmt::format("<div><b>{}</b><span>{}</span></div>\n", value, name);
}

std::string unsigned_mm(double value) {
  const std::string text = signed_mm(std::abs(value));
  return (text.front() == '+' ? text.substr(1) : text) + " mm";
}

std::string head_of(const ReportInput& input) {
  const inspect::DeviationReport& deviations = input.deviations;
  const inspect::DeviationStatistics& area = deviations.over_area;
  const std::string verdict =
      deviations.verdict ? std::string(inspect::name_of(*deviations.verdict)) : "no tolerance given";
  std::string html = fmt::format(
      "<h1>Deviation report: {}</h1>\n<div class=\"verdict {}\"><strong>{}</strong><br>{}</div>\n<div "
      "class=\"figures\">\n",
      escaped(std::filesystem::path(input.record.model.path).filename().string()), verdict, verdict,
      escaped(summary_of(input)));
  html += figure(percent(deviations.coverage), "of the surface scanned");
  if (area.count > 0) {
    html += figure(signed_mm(area.mean) + " mm", "mean, over area");
    html += figure(unsigned_mm(area.sigma), "standard deviation, over area");
    html += figure(unsigned_mm(area.p95), "95 % are within");
    html += figure(signed_mm(area.min) + " \u2026 " + signed_mm(area.max) + " mm", "smallest, largest");
  }
  if (area.in_tolerance) html += figure(percent(area.in_tolerance), "of what was scanned in tolerance");
  return html + "</div>\n";
}

std::string histogram_svg(const inspect::DeviationReport& deviations, const ColourMap& colours) {
  constexpr int kBins = 41, kWidth = 820, kHeight = 190;
  std::vector<double> counts(kBins, 0.0);
  const double range = colours.range_mm();
  for (const inspect::Spot& spot : deviations.spots) {
    if (!spot.is_scanned()) continue;
    const double place = (static_cast<double>(spot.deviation_mm) / range + 1.0) * 0.5 * kBins;
    counts[static_cast<std::size_t>(std::clamp(place, 0.0, kBins - 1.0))] += 1.0;
  }
  const double highest = std::max(1.0, *std::ranges::max_element(counts));
  std::string svg = fmt::format("<svg viewBox=\"0 0 {} {}\" width=\"100%\" role=\"img\" aria-label=\"histogram\">\n",
                                kWidth, kHeight + 24);
  const double step = static_cast<double>(kWidth) / kBins;
  for (int i = 0; i < kBins; ++i) {
    const double height = kHeight * counts[static_cast<std::size_t>(i)] / highest;
    const Rgb rgb = colours.colour(range * (2.0 * (i + 0.5) / kBins - 1.0));
    svg += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"#{:02x}{:02x}{:02x}\" "
        "stroke=\"#8a9299\" stroke-width=\".6\"/>\n",
        i * step, kHeight - height, step - 1.0, height, rgb[0], rgb[1], rgb[2]);
  }
  for (const double tick : {-range, -0.5 * range, 0.0, 0.5 * range, range}) {
    const double x = std::clamp((tick / range + 1.0) * 0.5 * kWidth, 24.0, kWidth - 24.0);
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{}\" font-size=\"13\" text-anchor=\"middle\">{}</text>\n", x,
                       kHeight + 17, signed_mm(tick));
  }
  return svg + "</svg>\n<p class=\"note\">Deviation over area, mm; the outermost bars hold what lies beyond.</p>\n";
}

std::string scans_table(const ReportInput& input) {
  if (input.record.scans.empty()) return {};
  std::string html =
      "<h2>Scans</h2>\n<div class=\"scroll\"><table><tr><th>scan<th>status<th class=\"n\">score<th class=\"n\">best "
      "overlap<th class=\"n\">residual, mm<th class=\"n\">points of the part<th>reason</tr>\n";
  for (std::size_t i = 0; i < input.record.scans.size(); ++i) {
    const io::ScanRecord& scan = input.record.scans[i];
    const LinkSummary links = links_of(input.record, static_cast<int>(i));
    html += fmt::format(
        "<tr><td>{}<td>{}<td class=\"n\">{:.2f}<td class=\"n\">{}<td class=\"n\">{}<td class=\"n\">{}<td>{}</tr>\n",
        escaped(scan.name), io::name_of(scan.status), scan.score, percent(links.best_overlap),
        links.residual_mm ? fmt::format("{:.4g}", *links.residual_mm) : "\u2013", scan.segment_points,
        escaped(scan.reason));
  }
  return html + "</table></div>\n";
}

std::string faces_table(const ReportInput& input) {
  std::string html =
      "<h2>Faces</h2>\n<div class=\"scroll\"><table><tr><th>face<th>verdict<th class=\"n\">scanned<th class=\"n\">in "
      "tolerance<th class=\"n\">mean, mm<th class=\"n\">sigma, mm<th class=\"n\">smallest<th "
      "class=\"n\">largest</tr>\n";
  for (const auto* parts : {&input.deviations.faces, &input.deviations.boxes}) {
    for (const inspect::SurfacePart& part : *parts) {
      const inspect::DeviationStatistics& s = part.statistics;
      html += fmt::format("<tr><td>{}<td>{}<td class=\"n\">{}<td class=\"n\">{}", escaped(part.name),
                          part.verdict ? inspect::name_of(*part.verdict) : "\u2013", percent(part.coverage()),
                          percent(s.in_tolerance));
      for (const double value : {s.mean, s.sigma, s.min, s.max}) {
        html += fmt::format("<td class=\"n\">{}", s.count > 0 ? signed_mm(value) : "\u2013");
      }
      html += "</tr>\n";
    }
  }
  return html + "</table></div>\n";
}

std::string regions_table(const ReportInput& input) {
  std::string html =
      fmt::format("<h2>{}</h2>\n", input.options.has_tolerance() ? "Out of tolerance" : "What stands out");
  const std::size_t shown = input.deviations.regions.size(), found = input.deviations.regions_found;
  if (shown == 0) return html + "<p>No connected region.</p>\n";
  if (found > shown) html += fmt::format("<p>The {} largest of {} regions.</p>\n", shown, found);
  html +=
      "<div class=\"scroll\"><table><tr><th>region<th class=\"n\">area, mm\u00b2<th class=\"n\">peak, mm<th "
      "class=\"n\">standard error<th>at, mm<th>face<th>significant</tr>\n";
  for (std::size_t i = 0; i < input.deviations.regions.size(); ++i) {
    const inspect::Region& r = input.deviations.regions[i];
    html += fmt::format(
        "<tr><td>{}<td class=\"n\">{:.4g}<td class=\"n\">{}<td class=\"n\">{:.2g}<td>{:.1f}, {:.1f}, "
        "{:.1f}<td>{}<td>{}</tr>\n",
        i, r.area_mm2, signed_mm(r.peak.deviation_mm), r.peak.standard_error_mm, r.peak.point.x(), r.peak.point.y(),
        r.peak.point.z(), escaped(input.deviations.faces[r.face].name), r.significant ? "yes" : "no");
  }
  return html + "</table></div>\n";
}

std::string provenance(const ReportInput& input) {
  std::string command = "asbuilt";
  for (const std::string& argument : input.arguments) command += " " + argument;
  std::string html = fmt::format(
      "<h2>Provenance</h2>\n<table>\n<tr><th>command<td><code>{}</code></tr>\n<tr><th>alignment<td>{}: {}</tr>\n"
      "<tr><th>model<td><code>{} sha256 {}</code></tr>\n",
      escaped(command), alignment_method(input), escaped(alignment_detail(input)), escaped(input.record.model.path),
      input.record.model.sha256);
  for (const auto* file : {&input.measured, &input.tolerance_file, &input.reference_file}) {
    if (!*file) continue;
    html += fmt::format("<tr><th>input<td><code>{} sha256 {}</code></tr>\n", escaped((*file)->path), (*file)->sha256);
  }
  for (const io::ScanRecord& scan : input.record.scans) {
    html += fmt::format("<tr><th>scan<td><code>{} sha256 {}</code></tr>\n", escaped(scan.path), scan.sha256);
  }
  return html + fmt::format(
                    "<tr><th>program<td>asbuilt {}; lengths in mm; deviations positive outside the material; times "
                    "in timing.json</tr>\n</table>\n",
                    input.record.version);
}

}  // namespace

std::string page_with_data(std::string_view page, std::string_view report_json, std::string_view scene_json) {
  const std::size_t mark = page.find(web::kReportDataMark);
  ASBUILT_EXPECT(mark != std::string_view::npos, "the data mark in the report page");
  std::string html(page.substr(0, mark));
  html += "<script type=\"application/json\" id=\"asbuilt-report\">" + json_for_script(report_json) + "</script>\n";
  html += "<script type=\"application/json\" id=\"asbuilt-scene\">" + json_for_script(scene_json) + "</script>";
  return html.append(page.substr(mark + web::kReportDataMark.size()));
}

std::string plain_page(const ReportInput& input, const std::vector<std::string>& pictures) {
  std::string html = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\">\n<title>asbuilt "
      "report</title>\n<style>{}</style></head><body>\n",
      kStyle);
  html += head_of(input);
  html +=
      "<h2>Views</h2>\n<p class=\"note\">This program was built without its web pages (nodejs and npm), so there is no "
      "3D view here; grey was not scanned.</p>\n<div class=\"views\">\n";
  const std::vector<View>& views = standard_views();
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    html += fmt::format("<img alt=\"{}\" src=\"data:image/png;base64,{}\">\n", views[i].title,
                        io::base64(std::as_bytes(std::span(pictures[i].data(), pictures[i].size()))));
  }
  html += "</div>\n<h2>Histogram</h2>\n" + histogram_svg(input.deviations, colours_of(input));
  html += faces_table(input) + regions_table(input) + scans_table(input) + provenance(input);
  return html + "</body></html>\n";
}

}  // namespace asbuilt::report
