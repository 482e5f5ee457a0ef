// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/simulate/parts.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "asbuilt/core/result.h"
#include "asbuilt/simulate/implicit_mesh.h"
#include "asbuilt/simulate/mesh_edit.h"

namespace asbuilt::simulate {
namespace {

constexpr double kPi = std::numbers::pi;

using Outline = std::vector<Eigen::Vector2d>;

double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

bool is_ear(const Outline& outline, const std::vector<int>& ring, std::size_t place) {
  const std::size_t n = ring.size();
  const auto at = [&](std::size_t k) { return outline[static_cast<std::size_t>(ring[k % n])]; };
  const Eigen::Vector2d a = at(place + n - 1), b = at(place), c = at(place + 1);
  if (turn(a, b, c) <= 0.0) return false;
  for (std::size_t k = place + 2; k < place + n - 1; ++k) {
    const Eigen::Vector2d p = at(k);
    if (turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0) return false;
  }
  return true;
}

// Ear clipping; enough for outlines of a hundred corners.
std::vector<Eigen::Vector3i> triangulated(const Outline& outline) {
  std::vector<int> ring(outline.size());
  std::iota(ring.begin(), ring.end(), 0);
  std::vector<Eigen::Vector3i> triangles;
  std::size_t place = 0;
  for (std::size_t failures = 0; ring.size() > 3;) {
    const std::size_t n = ring.size();
    place %= n;
    if (!is_ear(outline, ring, place)) {
      ASBUILT_EXPECT(++failures <= n, "a simple counter-clockwise outline");
      ++place;
      continue;
    }
    failures = 0;
    triangles.emplace_back(ring[(place + n - 1) % n], ring[place], ring[(place + 1) % n]);
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(place));
    ++place;  // not the same corner again, so that the ears are spread around
  }
  triangles.emplace_back(ring[0], ring[1], ring[2]);
  return triangles;
}

Outline circle(double radius, int segments) {
  Outline outline;
  for (int i = 0; i < segments; ++i) {
    const double angle = 2.0 * kPi * i / segments;
    outline.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  return outline;
}

double drawn(Random& random, double low, double high) { return random.uniform(low, high); }

TriangleMesh shape_of_kind(Random& random, std::size_t kind) {
  switch (kind) {
    case 0:
      return box({1.0, drawn(random, 0.3, 1.0), drawn(random, 0.2, 1.0)});
    case 1:
      return cylinder(drawn(random, 0.15, 0.5), 1.0);
    case 2:
      return l_profile(drawn(random, 0.4, 0.8), drawn(random, 0.3, 0.6), drawn(random, 0.06, 0.12), 1.0);
    case 3:
      return box({1.0, drawn(random, 0.5, 0.9), drawn(random, 0.03, 0.07)});  // a plate
    case 4:
      return stepped_block(1.0);
    case 5:
      return flange(0.5, drawn(random, 0.08, 0.16), 4 + static_cast<int>(random.below(5)), 0.035);
    case 6:
      return pipe_elbow(0.6, drawn(random, 0.12, 0.25), 0.04, drawn(random, 60.0, 120.0));
    case 7:
      return i_beam(drawn(random, 0.25, 0.4), drawn(random, 0.3, 0.5), 0.06, 1.0);
    case 8:
      return gear(0.5, drawn(random, 0.1, 0.3), 12 + static_cast<int>(random.below(12)));
    default:
      return sphere(0.5);
  }
}

constexpr std::size_t kShapeKinds = 10;

}  // namespace

TriangleMesh extruded(const std::vector<Eigen::Vector2d>& outline, double height_mm) {
  TriangleMesh mesh;
  const int n = static_cast<int>(outline.size());
  for (const double z : {-0.5 * height_mm, 0.5 * height_mm}) {
    for (const Eigen::Vector2d& p : outline) mesh.vertices.emplace_back(p.x(), p.y(), z);
  }
  for (const Eigen::Vector3i& t : triangulated(outline)) {
    mesh.triangles.emplace_back(t[0], t[2], t[1]);
    mesh.triangles.emplace_back(t[0] + n, t[1] + n, t[2] + n);
  }
  for (int i = 0; i < n; ++i) {
    const int next = (i + 1) % n;
    mesh.triangles.emplace_back(i, next, next + n);
    mesh.triangles.emplace_back(i, next + n, i + n);
  }
  return mesh;
}

TriangleMesh box(const Eigen::Vector3d& size_mm) {
  const double x = 0.5 * size_mm.x(), y = 0.5 * size_mm.y();
  return extruded({{-x, -y}, {x, -y}, {x, y}, {-x, y}}, size_mm.z());
}

TriangleMesh cylinder(double radius_mm, double height_mm, int segments) {
  return extruded(circle(radius_mm, segments), height_mm);
}

TriangleMesh sphere(double radius_mm, int levels) {
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    mesh.vertices.emplace_back(Eigen::Vector3d::Unit(axis));
    mesh.vertices.emplace_back(-Eigen::Vector3d::Unit(axis));
  }
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  double longest = std::numbers::sqrt2;
  for (int level = 0; level < levels; ++level) {
    longest *= 0.5;
    mesh = subdivided(mesh, [&](const Eigen::Vector3d&) { return 1.05 * longest; });
  }
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex = radius_mm * vertex.normalized();
  return mesh;
}

TriangleMesh l_profile(double width_mm, double depth_mm, double thickness_mm, double length_mm) {
  const double w = width_mm, d = depth_mm, t = thickness_mm;
  return extruded({{0, 0}, {w, 0}, {w, t}, {t, t}, {t, d}, {0, d}}, length_mm);
}

TriangleMesh i_beam(double width_mm, double depth_mm, double thickness_mm, double length_mm) {
  const double w = 0.5 * width_mm, d = 0.5 * depth_mm, t = thickness_mm, h = 0.5 * thickness_mm;
  return extruded({{-w, -d},
                   {w, -d},
                   {w, -d + t},
                   {h, -d + t},
                   {h, d - t},
                   {w, d - t},
                   {w, d},
                   {-w, d},
                   {-w, d - t},
                   {-h, d - t},
                   {-h, -d + t},
                   {-w, -d + t}},
                  length_mm);
}

TriangleMesh gear(double radius_mm, double thickness_mm, int teeth) {
  Outline outline;
  for (int tooth = 0; tooth < teeth; ++tooth) {
    for (const auto& [turn_share, radius_share] : {std::pair{0.0, 0.86}, {0.42, 0.86}, {0.55, 1.0}, {0.87, 1.0}}) {
      const double angle = 2.0 * kPi * (tooth + turn_share) / teeth;
      outline.emplace_back(radius_share * radius_mm * std::cos(angle), radius_share * radius_mm * std::sin(angle));
    }
  }
  return extruded(outline, thickness_mm);
}

TriangleMesh stepped_block(double length_mm) {
  const double u = length_mm / 12.0;
  const Outline outline{{0, 0},         {12 * u, 0},    {12 * u, 2 * u}, {7 * u, 2 * u},
                        {7 * u, 4 * u}, {3 * u, 4 * u}, {3 * u, 7 * u},  {0, 7 * u}};
  TriangleMesh mesh = extruded(outline, 5.0 * u);
  // One end is cut off obliquely: an upright prism would be its own mirror image.
  for (Eigen::Vector3d& v : mesh.vertices) {
    if (v.z() > 0.0) v.z() += 0.15 * v.x() - 0.1 * v.y();
  }
  return mesh;
}

TriangleMesh flange(double radius_mm, double thickness_mm, int bolt_holes, double cell_mm) {
  const double r = radius_mm, t = thickness_mm;
  const auto tube = [](const Eigen::Vector3d& p, double radius, double low, double high) {
    return std::max({std::hypot(p.x(), p.y()) - radius, low - p.z(), p.z() - high});
  };
  const Solid solid = [=](const Eigen::Vector3d& p) {
    double value = std::min(tube(p, r, 0.0, t), tube(p, 0.55 * r, 0.0, 0.5 * r));
    value = std::max(value, 0.35 * r - std::hypot(p.x(), p.y()));
    for (int i = 0; i < bolt_holes; ++i) {
      const double angle = 2.0 * kPi * i / bolt_holes;
      const Eigen::Vector3d centre(0.78 * r * std::cos(angle), 0.78 * r * std::sin(angle), 0.0);
      value = std::max(value, 0.1 * r - (p - centre).head<2>().norm());
    }
    return value;
  };
  return surface_of(solid, {Eigen::Vector3d(-r, -r, 0.0), Eigen::Vector3d(r, r, std::max(t, 0.5 * r))}, cell_mm);
}

TriangleMesh pipe_elbow(double bend_radius_mm, double pipe_radius_mm, double wall_mm, double angle_deg, int segments) {
  TriangleMesh mesh;
  const int rings = std::max(4, segments / 2);
  for (const double radius : {pipe_radius_mm, pipe_radius_mm - wall_mm}) {
    for (int ring = 0; ring <= rings; ++ring) {
      const double bend = angle_deg / 180.0 * kPi * ring / rings;
      for (const Eigen::Vector2d& p : circle(radius, segments)) {
        const double reach = bend_radius_mm + p.x();
        mesh.vertices.emplace_back(reach * std::cos(bend), reach * std::sin(bend), p.y());
      }
    }
  }
  const int inner = (rings + 1) * segments;
  const auto add_quad = [&](int a, int b, int c, int d) {
    mesh.triangles.emplace_back(a, b, c);
    mesh.triangles.emplace_back(a, c, d);
  };
  for (int i = 0; i < segments; ++i) {
    const int next = (i + 1) % segments, last = rings * segments;
    for (int row = 0; row < last; row += segments) {
      add_quad(row + i, row + segments + i, row + segments + next, row + next);
      add_quad(inner + row + i, inner + row + next, inner + row + segments + next, inner + row + segments + i);
    }
    add_quad(i, next, inner + next, inner + i);
    add_quad(last + i, inner + last + i, inner + last + next, last + next);
  }
  return mesh;
}

TriangleMesh random_shape(Random& random, double size_mm) {
  const TriangleMesh shape = shape_of_kind(random, random.below(kShapeKinds));
  const Eigen::AlignedBox3d bounds = bounding_box(shape);
  Pose centred = Pose::Identity();
  centred.translation() = -bounds.center();
  return scaled(transformed(shape, centred), Eigen::Vector3d::Constant(size_mm / bounds.diagonal().norm()));
}

}  // namespace asbuilt::simulate
