// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/report/image.h"

#include <algorithm>
#include <cmath>

#include "asbuilt/report/strokes.h"

namespace asbuilt::report {
namespace {

constexpr double kCapHeight = 6.0;  // of the stroke font's grid
constexpr double kGap = 1.6;        // between letters

/// Calls draw(strokes, x) for each letter; gives the width of the whole, both in units of the font's grid.
template <class Draw>
double for_each_letter(std::string_view utf8, const Draw& draw) {
  double x = 0.0;
  for (std::size_t i = 0; i < utf8.size();) {
    const Letter letter = letter_at(utf8, i);
    draw(letter, x);
    x += letter.width + kGap;
    i += letter.bytes;
  }
  return std::max(0.0, x - kGap);
}

}  // namespace

Image::Image(int width, int height, Rgb background)
    : width_(width),
      height_(height),
      pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), background) {}

void Image::blend(int x, int y, Rgb colour, double opacity) {
  if (x < 0 || y < 0 || x >= width_ || y >= height_) return;
  Rgb& pixel = pixels_[index(x, y)];
  for (std::size_t c = 0; c < 3; ++c) {
    const double value =
        std::lerp(static_cast<double>(pixel[c]), static_cast<double>(colour[c]), std::clamp(opacity, 0.0, 1.0));
    pixel[c] = static_cast<std::uint8_t>(std::lround(value));
  }
}

void Image::fill_rectangle(int x, int y, int width, int height, Rgb colour) {
  for (int row = std::max(0, y); row < std::min(height_, y + height); ++row) {
    for (int column = std::max(0, x); column < std::min(width_, x + width); ++column) set(column, row, colour);
  }
}

void Image::line(Eigen::Vector2d from, Eigen::Vector2d to, double thickness, Rgb colour) {
  const double half = 0.5 * thickness, reach = half + 1.0;
  const Eigen::Vector2d low = from.cwiseMin(to).array() - reach, high = from.cwiseMax(to).array() + reach;
  const Eigen::Vector2d along = to - from;
  const double squared = along.squaredNorm();
  for (int y = std::max(0, static_cast<int>(low.y())); y <= std::min(height_ - 1, static_cast<int>(high.y())); ++y) {
    for (int x = std::max(0, static_cast<int>(low.x())); x <= std::min(width_ - 1, static_cast<int>(high.x())); ++x) {
      const Eigen::Vector2d centre(x + 0.5, y + 0.5);
      const double share = squared > 0.0 ? std::clamp((centre - from).dot(along) / squared, 0.0, 1.0) : 0.0;
      const double distance = (centre - from - share * along).norm();
      if (distance < half + 0.5) blend(x, y, colour, half + 0.5 - distance);
    }
  }
}

double Image::text(double x, double y, double height, Rgb colour, std::string_view utf8) {
  const double scale = height / kCapHeight;
  const double thickness = std::max(1.15, 0.14 * height);
  const double width = for_each_letter(utf8, [&](const Letter& letter, double left) {
    const auto pixel = [&](const StrokePoint& p) { return Eigen::Vector2d(x + scale * (left + p.x), y - scale * p.y); };
    for (const auto& stroke : letter.strokes) {
      if (stroke.size() == 1) line(pixel(stroke[0]), pixel(stroke[0]), thickness, colour);
      for (std::size_t i = 1; i < stroke.size(); ++i) line(pixel(stroke[i - 1]), pixel(stroke[i]), thickness, colour);
    }
  });
  return x + scale * width;
}

double Image::text_width(double height, std::string_view utf8) {
  return height / kCapHeight * for_each_letter(utf8, [](const Letter&, double) {});
}

}  // namespace asbuilt::report
