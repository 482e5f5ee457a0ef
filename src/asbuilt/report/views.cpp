// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/report/views.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "asbuilt/core/parallel.h"

namespace asbuilt::report {
namespace {

constexpr int kFine = 3;  // samples a pixel, each way
constexpr int kLegendWidth = 210, kMargin = 28, kTitle = 44;
constexpr Rgb kPaper{255, 255, 255}, kInk{38, 43, 48};

/// Vertices on the picture: x right and y down in fine pixels, z towards the viewer.
struct Projection {
  std::vector<Eigen::Vector3f> vertices;
  Eigen::Matrix3f rotation;  // of directions
};

Projection project(const Scene& scene, const View& view, int width, int height) {
  const Eigen::Vector3d z = view.towards_viewer.normalized();
  const Eigen::Vector3d x = view.up.cross(z).normalized(), y = z.cross(x);
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), y.transpose(), z.transpose();
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : scene.mesh.vertices) box.extend(rotation * vertex);
  const double scale = std::min((width - 2.0 * kMargin * kFine) / std::max(box.sizes().x(), 1e-9),
                                (height - 2.0 * kMargin * kFine) / std::max(box.sizes().y(), 1e-9));
  Projection projection;
  projection.rotation = rotation.cast<float>();
  for (const Eigen::Vector3d& vertex : scene.mesh.vertices) {
    const Eigen::Vector3d p = scale * (rotation * vertex - box.center());
    projection.vertices.emplace_back(static_cast<float>(0.5 * width + p.x()), static_cast<float>(0.5 * height - p.y()),
                                     static_cast<float>(p.z()));
  }
  return projection;
}

/// Fine pixels with their depth.
class Canvas {
 public:
  Canvas(int width, int height)
      : width_(width),
        height_(height),
        depth_(count(), -std::numeric_limits<float>::infinity()),
        colour_(count(), kPaper) {}

  template <class Shade>
  void triangle(const std::array<Eigen::Vector3f, 3>& p, const Shade& shade) {
    const auto cross = [](const Eigen::Vector3f& a, const Eigen::Vector3f& b, float x, float y) {
      return (b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x());
    };
    const float area = cross(p[0], p[1], p[2].x(), p[2].y());
    if (area == 0.0F) return;
    const auto [low_x, high_x] = std::minmax({p[0].x(), p[1].x(), p[2].x()});
    const auto [low_y, high_y] = std::minmax({p[0].y(), p[1].y(), p[2].y()});
    for (int y = std::max(0, static_cast<int>(low_y)); y <= std::min(height_ - 1, static_cast<int>(high_y)); ++y) {
      for (int x = std::max(0, static_cast<int>(low_x)); x <= std::min(width_ - 1, static_cast<int>(high_x)); ++x) {
        const float px = static_cast<float>(x) + 0.5F, py = static_cast<float>(y) + 0.5F;
        const float a = cross(p[1], p[2], px, py) / area, b = cross(p[2], p[0], px, py) / area, c = 1.0F - a - b;
        if (a < 0.0F || b < 0.0F || c < -1e-6F) continue;
        const float z = a * p[0].z() + b * p[1].z() + c * p[2].z();
        const std::size_t i = index(x, y);
        if (z <= depth_[i]) continue;
        depth_[i] = z;
        colour_[i] = shade(std::array{a, b, c});
      }
    }
  }

  /// Darkens a line where nothing lies before it.
  void edge(const Eigen::Vector3f& from, const Eigen::Vector3f& to) {
    const float length = (to - from).head<2>().norm();
    const int steps = std::max(1, static_cast<int>(std::ceil(length)));
    for (int i = 0; i <= steps; ++i) {
      const Eigen::Vector3f p = from + static_cast<float>(i) / static_cast<float>(steps) * (to - from);
      for (const auto& [dx, dy] : {std::pair(0, 0), std::pair(1, 0), std::pair(0, 1), std::pair(1, 1)}) {
        const int x = static_cast<int>(p.x() - 0.5F) + dx, y = static_cast<int>(p.y() - 0.5F) + dy;
        if (x < 0 || y < 0 || x >= width_ || y >= height_) continue;
        constexpr float kBefore = 4.0F;  // fine pixels: the faces at the edge itself
        if (p.z() + kBefore < depth_[index(x, y)]) continue;
        colour_[index(x, y)] = kEdge;
      }
    }
  }

  [[nodiscard]] Rgb mean(int x, int y) const {
    std::array<int, 3> sum{};
    for (int dy = 0; dy < kFine; ++dy) {
      for (int dx = 0; dx < kFine; ++dx) {
        const Rgb& colour = colour_[index(kFine * x + dx, kFine * y + dy)];
        for (std::size_t c = 0; c < 3; ++c) sum[c] += colour[c];
      }
    }
    Rgb result{};
    for (std::size_t c = 0; c < 3; ++c) result[c] = static_cast<std::uint8_t>(sum[c] / (kFine * kFine));
    return result;
  }

 private:
  static constexpr Rgb kEdge{70, 76, 82};
  [[nodiscard]] std::size_t count() const {
    return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  }
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }

  int width_, height_;
  std::vector<float> depth_;
  std::vector<Rgb> colour_;
};

/// A deviation within a triangle: that of the scanned corners, or none where a corner that was not scanned is nearest.
double blended(const std::array<float, 3>& weights, const std::array<float, 3>& values) {
  const auto nearest = static_cast<std::size_t>(std::ranges::max_element(weights) - weights.begin());
  if (std::isnan(values[nearest])) return std::numeric_limits<double>::quiet_NaN();
  double sum = 0.0, total = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    if (std::isnan(values[k])) continue;
    sum += static_cast<double>(weights[k]) * static_cast<double>(values[k]);
    total += static_cast<double>(weights[k]);
  }
  return sum / total;
}

Rgb shaded(Rgb colour, double brightness) {
  for (std::uint8_t& c : colour) c = static_cast<std::uint8_t>(std::clamp(brightness * c, 0.0, 255.0));
  return colour;
}

/// Colours of the map, looked up rather than computed for each of millions of pixels.
class Palette {
 public:
  Palette(const ColourMap& map, bool steps) : range_(map.range_mm()) {
    for (int i = 0; i < kSize; ++i) {
      const double value = range_ * (2.0 * (i + 0.5) / kSize - 1.0);
      colours_[static_cast<std::size_t>(i)] = steps ? map.stepped_colour(value) : map.colour(value);
    }
  }
  [[nodiscard]] Rgb operator()(double value) const {
    if (std::isnan(value)) return ColourMap::kNotScanned;
    const double place = (value / range_ + 1.0) * 0.5 * kSize;
    return colours_[static_cast<std::size_t>(std::clamp(place, 0.0, kSize - 1.0))];
  }

 private:
  static constexpr int kSize = 4096;
  double range_;
  std::array<Rgb, kSize> colours_{};
};

void draw_surface(Canvas& canvas, const Scene& scene, const Projection& projection, const Palette& palette) {
  const Eigen::Vector3f light = Eigen::Vector3f(-0.35F, 0.5F, 0.8F).normalized();
  for (const auto& t : scene.mesh.triangles) {
    const std::array points{projection.vertices[t[0]], projection.vertices[t[1]], projection.vertices[t[2]]};
    std::array<float, 3> values{}, brightness{};
    for (std::size_t k = 0; k < 3; ++k) {
      values[k] = scene.spots[t[k]].deviation_mm;
      Eigen::Vector3f normal = projection.rotation * scene.mesh.normals[t[k]];
      if (normal.z() < 0.0F) normal = -normal;  // the back of a sheet
      brightness[k] = 0.74F + 0.26F * std::max(0.0F, normal.dot(light));
    }
    canvas.triangle(points, [&](const std::array<float, 3>& w) {
      const float light_here = w[0] * brightness[0] + w[1] * brightness[1] + w[2] * brightness[2];
      return shaded(palette(blended(w, values)), static_cast<double>(light_here));
    });
  }
}

/// Edges of one triangle only: sharp edges, since no vertex is shared across them, and borders.
void draw_edges(Canvas& canvas, const Scene& scene, const Projection& projection) {
  std::vector<std::uint64_t> sides;
  for (const auto& t : scene.mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
      sides.push_back((static_cast<std::uint64_t>(low) << 32) | high);
    }
  }
  std::ranges::sort(sides);
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const bool repeated = (i > 0 && sides[i - 1] == sides[i]) || (i + 1 < sides.size() && sides[i + 1] == sides[i]);
    if (!repeated) canvas.edge(projection.vertices[sides[i] >> 32], projection.vertices[sides[i] & 0xffffffffU]);
  }
}

std::string signed_number(double value, double range) {
  const int digits = std::clamp(1 - static_cast<int>(std::floor(std::log10(range))), 0, 6);
  const std::string text = fmt::format("{:.{}f}", std::abs(value), digits);
  const bool is_zero = text.find_first_of("123456789") == std::string::npos;
  return (is_zero ? "" : value < 0.0 ? "\u2212" : "+") + text;
}

void draw_legend(Image& image, const ColourMap& colours, bool steps) {
  const int bar_x = image.width() - kLegendWidth + 18, bar_width = 26;
  const int top = kTitle + 44, bottom = image.height() - 104;
  const double range = colours.range_mm();
  const auto y_of = [&](double value) { return top + (1.0 - value / range) * 0.5 * (bottom - top); };
  image.text(bar_x, top - 22, 11.0, kInk, "deviation, mm");
  for (int y = top; y < bottom; ++y) {
    const double value = range * (1.0 - 2.0 * (y + 0.5 - top) / (bottom - top));
    image.fill_rectangle(bar_x, y, bar_width, 1, steps ? colours.stepped_colour(value) : colours.colour(value));
  }
  std::vector<double> ticks{-range, -0.5 * range, 0.0, 0.5 * range, range};
  const auto& tolerance = colours.tolerance();
  if (tolerance) {
    for (const double end : {tolerance->low_mm, tolerance->high_mm}) {
      if (std::abs(end) >= range) continue;
      std::erase_if(ticks, [&](double tick) { return tick != end && std::abs(tick - end) < 0.16 * range; });
      if (std::ranges::find(ticks, end) == ticks.end()) ticks.push_back(end);
    }
  }
  for (const double tick : ticks) {
    const double y = y_of(tick);
    image.line({bar_x + bar_width + 1.0, y}, {bar_x + bar_width + 6.0, y}, 1.2, kInk);
    image.text(bar_x + bar_width + 12.0, y + 5.0, 10.5, kInk, signed_number(tick, range));
  }
  if (tolerance) {  // a bracket over the band
    const double low = y_of(std::max(tolerance->low_mm, -range)), high = y_of(std::min(tolerance->high_mm, range));
    const double x = bar_x - 7.0;
    image.line({x, low}, {x, high}, 1.6, kInk);
    image.line({x, low}, {x + 5.0, low}, 1.6, kInk);
    image.line({x, high}, {x + 5.0, high}, 1.6, kInk);
  }
  int y = bottom + 26;
  if (tolerance) {
    image.line({bar_x - 1.0, y + 1.0}, {bar_x - 1.0, y + 14.0}, 1.6, kInk);
    image.line({bar_x - 1.0, y + 1.0}, {bar_x + 4.0, y + 1.0}, 1.6, kInk);
    image.line({bar_x - 1.0, y + 14.0}, {bar_x + 4.0, y + 14.0}, 1.6, kInk);
    image.text(bar_x + 24, y + 12, 10.5, kInk, "tolerance");
    y += 28;
  }
  image.fill_rectangle(bar_x, y, 15, 15, ColourMap::kNotScanned);
  image.text(bar_x + 24, y + 12, 10.5, kInk, "not scanned");
}

}  // namespace

const std::vector<View>& standard_views() {
  using Eigen::Vector3d;
  static const std::vector<View> views{
      {"corner", "corner", Vector3d(1.0, -1.2, 0.8), Vector3d::UnitZ()},
      {"corner_below", "opposite corner", Vector3d(-1.0, 1.2, -0.8), Vector3d::UnitZ()},
      {"plus_x", "from +x", Vector3d::UnitX(), Vector3d::UnitZ()},
      {"minus_x", "from \u2212x", -Vector3d::UnitX(), Vector3d::UnitZ()},
      {"plus_y", "from +y", Vector3d::UnitY(), Vector3d::UnitZ()},
      {"minus_y", "from \u2212y", -Vector3d::UnitY(), Vector3d::UnitZ()},
      {"plus_z", "from +z", Vector3d::UnitZ(), Vector3d::UnitY()},
      {"minus_z", "from \u2212z", -Vector3d::UnitZ(), Vector3d::UnitY()}};
  return views;
}

Image rendered(const Scene& scene, const ColourMap& colours, const View& view, const ViewOptions& options) {
  Image image(options.width, options.height, kPaper);
  const int width = options.width - kLegendWidth, height = options.height - kTitle;
  Canvas canvas(kFine * width, kFine * height);
  const Projection projection = project(scene, view, kFine * width, kFine * height);
  draw_surface(canvas, scene, projection, Palette(colours, options.steps));
  draw_edges(canvas, scene, projection);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.set(x, kTitle + y, canvas.mean(x, y));
  }
  image.text(kMargin, 34, 14.0, kInk, view.title);
  draw_legend(image, colours, options.steps);
  return image;
}

std::vector<std::string> rendered_views(const Scene& scene, const ColourMap& colours, const ViewOptions& options,
                                        const Context& context) {
  const std::vector<View>& views = standard_views();
  std::vector<std::string> files(views.size());
  parallel_for(context, views.size(), 1,
               [&](std::size_t i) { files[i] = rendered(scene, colours, views[i], options).png(); });
  return files;
}

}  // namespace asbuilt::report
