// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "asbuilt/report/colours.h"

namespace asbuilt::report {

/// A picture, row by row from the top, and what little drawing a legend needs. Smooth edges; what lies outside is cut
/// off.
class Image {
 public:
  Image(int width, int height, Rgb background);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] Rgb at(int x, int y) const { return pixels_[index(x, y)]; }
  void set(int x, int y, Rgb colour) { pixels_[index(x, y)] = colour; }
  void blend(int x, int y, Rgb colour, double opacity);

  void fill_rectangle(int x, int y, int width, int height, Rgb colour);
  void line(Eigen::Vector2d from, Eigen::Vector2d to, double thickness, Rgb colour);

  /// Text with its baseline at `y`, capital letters `height` pixels high, in strokes: ASCII, and minus, plus-minus,
  /// degree and multiplication signs in UTF-8. Gives where it ends.
  double text(double x, double y, double height, Rgb colour, std::string_view utf8);
  [[nodiscard]] static double text_width(double height, std::string_view utf8);

  /// The file's content: 8-bit RGB, not interlaced.
  [[nodiscard]] std::string png() const;

 private:
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }

  int width_, height_;
  std::vector<Rgb> pixels_;
};

}  // namespace asbuilt::report
