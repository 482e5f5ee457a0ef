// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>

#include "curves.h"

namespace asbuilt::bench {
namespace {

constexpr double kLeft = 70.0, kTop = 45.0, kSide = 480.0, kWidth = 900.0, kHeight = 590.0;
// Okabe and Ito: told apart by colour-blind readers as well.
constexpr std::array kColours{"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"};

constexpr const char* kDashes = " stroke-dasharray='6 4'";

double at_x(double share) { return kLeft + kSide * share; }
double at_y(double share) { return kTop + kSide * (1.0 - share); }

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    result += c == '&' ? "&amp;" : c == '<' ? "&lt;" : std::string(1, c);
  }
  return result;
}

std::string label(double x, double y, const char* anchor, const std::string& text) {
  return fmt::format("<text x='{:.1f}' y='{:.1f}' text-anchor='{}'>{}</text>\n", x, y, anchor, escaped(text));
}

std::string frame(const Diagram& diagram) {
  std::string svg;
  for (int tenth = 0; tenth <= 10; tenth += 2) {
    const double share = 0.1 * tenth;
    svg += fmt::format("<path d='M{:.1f} {:.1f}V{:.1f}M{:.1f} {:.1f}H{:.1f}' stroke='#ddd' fill='none'/>\n",
                       at_x(share), at_y(0.0), at_y(1.0), at_x(0.0), at_y(share), at_x(1.0));
    svg += label(at_x(share), at_y(0.0) + 20.0, "middle", fmt::format("{:.1f}", share));
    svg += label(at_x(0.0) - 8.0, at_y(share) + 5.0, "end", fmt::format("{:.1f}", share));
  }
  svg += fmt::format("<rect x='{}' y='{}' width='{}' height='{}' stroke='#333' fill='none'/>\n", kLeft, kTop, kSide,
                     kSide);
  svg += label(at_x(0.5), kTop - 16.0, "middle", diagram.title);
  svg += label(at_x(0.5), at_y(0.0) + 45.0, "middle", diagram.x_label);
  svg += fmt::format("<g transform='translate({:.1f} {:.1f}) rotate(-90)'>{}</g>\n", kLeft - 48.0, at_y(0.5),
                     label(0.0, 0.0, "middle", diagram.y_label));
  return svg;
}

std::string line_of(const Series& series, const char* colour) {
  std::string path, bars, dots;
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    const double x = at_x(series.x[i]), y = at_y(series.y[i]);
    path += fmt::format("{}{:.1f} {:.1f}", i == 0 ? "M" : "L", x, y);
    if (series.low.empty()) continue;
    bars += fmt::format("M{:.1f} {:.1f}V{:.1f}", x, at_y(series.low[i]), at_y(series.high[i]));
    dots += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='3.5' fill='{}'/>\n", x, y, colour);
  }
  std::string svg = fmt::format("<path d='{}' stroke='{}' stroke-width='2'{} fill='none'/>\n", path, colour,
                                series.dashed ? kDashes : "");
  if (!bars.empty()) svg += fmt::format("<path d='{}' stroke='{}' stroke-opacity='0.45' fill='none'/>\n", bars, colour);
  // A curve of one point would not be seen as a line.
  if (series.low.empty() && series.x.size() == 1) {
    dots = fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='4' fill='{}'/>\n", at_x(series.x[0]), at_y(series.y[0]),
                       colour);
  }
  return svg + dots;
}

}  // namespace

std::string to_svg(const Diagram& diagram) {
  std::string svg = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' width='{0}' height='{1}' viewBox='0 0 {0} {1}' font-family='sans-serif' "
      "font-size='15'>\n<rect width='{0}' height='{1}' fill='white'/>\n",
      kWidth, kHeight);
  svg += frame(diagram);
  double row = kTop + 12.0;
  for (const Series& series : diagram.series) {
    if (series.x.empty()) continue;
    const char* colour = kColours[series.colour % kColours.size()];
    svg += line_of(series, colour);
    svg += fmt::format("<path d='M{:.1f} {:.1f}h30' stroke='{}' stroke-width='2'{}/>\n", at_x(1.0) + 20.0, row - 5.0,
                       colour, series.dashed ? kDashes : "");
    svg += label(at_x(1.0) + 58.0, row, "start", series.name);
    row += 24.0;
  }
  return svg + "</svg>\n";
}

}  // namespace asbuilt::bench
