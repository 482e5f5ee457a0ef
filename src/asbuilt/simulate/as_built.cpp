// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/simulate/as_built.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>

#include "asbuilt/core/pose.h"
#include "asbuilt/core/random.h"
#include "asbuilt/simulate/mesh_edit.h"

namespace asbuilt::simulate {
namespace {

constexpr double kEdgeRatio = 1.0 / 60.0;  // longest edge / diameter: 60 facets follow a wave of one diameter smoothly
constexpr double kEdgesPerBump = 8.0;      // edges on the radius of a bump

// A displacement that varies slowly: a few waves of between half and one period over the part.
class SmoothWarp {
 public:
  SmoothWarp(const Eigen::Vector3d& centre, double diameter_mm, Random random) : centre_(centre) {
    for (Wave& wave : waves_) {
      for (int k = 0; k < 3; ++k) wave.amplitude[k] = random.normal();
      for (int k = 0; k < 3; ++k) wave.frequency[k] = random.normal();
      const double periods = random.uniform(0.5, 1.0);
      wave.frequency *= 2.0 * std::numbers::pi * periods / diameter_mm / wave.frequency.norm();
      wave.phase = random.uniform(0.0, 2.0 * std::numbers::pi);
    }
  }

  [[nodiscard]] Eigen::Vector3d at(const Eigen::Vector3d& point) const {
    Eigen::Vector3d displacement = Eigen::Vector3d::Zero();
    for (const Wave& wave : waves_) {
      displacement += wave.amplitude * std::sin(wave.frequency.dot(point - centre_) + wave.phase);
    }
    return displacement;
  }

 private:
  struct Wave {
    Eigen::Vector3d amplitude, frequency;
    double phase = 0.0;
  };
  Eigen::Vector3d centre_;
  std::array<Wave, 4> waves_;
};

// Moves `vertices` by the rigid motion that brings them closest to `targets`, each weighted by its area.
void fit(std::vector<Eigen::Vector3d>& vertices, const std::vector<Eigen::Vector3d>& targets,
         const std::vector<double>& areas) {
  const Pose motion = best_rigid_motion(vertices, targets, areas);
  for (Eigen::Vector3d& vertex : vertices) vertex = motion * vertex;
}

double largest_distance(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, (a[i] - b[i]).norm());
  return largest;
}

// Scale first, then the warp, made as large as asked for after the rigid part of it is taken off.
void warp(std::vector<Eigen::Vector3d>& vertices, const std::vector<double>& areas, const AsBuiltOptions& options,
          double diameter_mm, const Eigen::Vector3d& centre, std::uint64_t seed) {
  const std::vector<Eigen::Vector3d> before = vertices;
  if (options.warp_ratio > 0.0) {
    const SmoothWarp field(centre, diameter_mm, Random(seed, "warp", 0));
    // A small displacement, so that what the fit takes off is a rigid motion; then it is scaled up.
    const double small = 1e-4 * diameter_mm;
    for (Eigen::Vector3d& vertex : vertices) vertex += small * field.at(vertex);
    fit(vertices, before, areas);
    const double gain = options.warp_ratio * diameter_mm / largest_distance(vertices, before);
    for (std::size_t i = 0; i < vertices.size(); ++i) vertices[i] = before[i] + gain * (vertices[i] - before[i]);
  }
  for (Eigen::Vector3d& vertex : vertices) vertex = centre + options.scale * (vertex - centre);
}

std::vector<Bump> drawn_bumps(const TriangleMesh& mesh, const AsBuiltOptions& options, double diameter_mm,
                              std::uint64_t seed) {
  std::vector<Bump> bumps;
  for (int i = 0; i < options.dents + options.bosses; ++i) {
    const SurfacePoint place = area_samples(mesh, 1, Random(seed, "bump", static_cast<std::uint64_t>(i))).front();
    const double sign = i < options.dents ? -1.0 : 1.0;
    bumps.push_back({place.position, place.normal, options.bump_radius_ratio * diameter_mm,
                     sign * options.bump_height_ratio * diameter_mm});
  }
  return bumps;
}

TriangleMesh fine_near(const TriangleMesh& mesh, std::span<const Bump> bumps) {
  return subdivided(mesh, [&](const Eigen::Vector3d& middle) {
    double longest = std::numeric_limits<double>::infinity();
    for (const Bump& bump : bumps) {
      const double outside = (middle - bump.centre_in_model).norm() - bump.radius_mm;
      // Grows outwards, so that the fine region ends gently.
      longest = std::min(longest, bump.radius_mm / kEdgesPerBump + 2.0 * std::max(outside, 0.0));
    }
    return longest;
  });
}

TriangleMesh displaced(const TriangleMesh& mesh, std::span<const Bump> bumps) {
  TriangleMesh result = mesh;
  const std::vector<Eigen::Vector3d> normals = vertex_normals(mesh);
  for (const Bump& bump : bumps) {
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
      const double share = (mesh.vertices[i] - bump.centre_in_model).squaredNorm() / std::pow(bump.radius_mm, 2);
      if (share >= 1.0 || normals[i].dot(bump.normal) <= 0.0) continue;  // not through a wall to its other side
      result.vertices[i] += bump.height_mm * std::pow(1.0 - share, 2) * bump.normal;
    }
  }
  return result;
}

}  // namespace

Result<void> AsBuiltOptions::validate() const {
  const auto check = [](std::string_view name, double value, double low, double high) -> Result<void> {
    if (value >= low && value <= high) return {};
    return fail(ErrorCode::invalid_argument,
                fmt::format("{} is {}, but must be between {} and {}", name, value, low, high));
  };
  ASBUILT_CHECK(check("warp_ratio", warp_ratio, 0.0, 0.05));
  ASBUILT_CHECK(check("scale", scale, 0.9, 1.1));
  ASBUILT_CHECK(check("dents", dents, 0, 100));
  ASBUILT_CHECK(check("bosses", bosses, 0, 100));
  ASBUILT_CHECK(check("bump_height_ratio", bump_height_ratio, 0.0, 0.05));
  return check("bump_radius_ratio", bump_radius_ratio, 1e-3, 0.5);
}

TriangleMesh with_bumps(const TriangleMesh& mesh, std::span<const Bump> bumps) {
  return displaced(fine_near(mesh, bumps), bumps);
}

Result<AsBuilt> as_built(const TriangleMesh& cad, const AsBuiltOptions& options, std::uint64_t seed) {
  ASBUILT_CHECK(options.validate());
  if (!(surface_area(cad) > 0.0)) return fail(ErrorCode::not_possible, "the model has no surface area");
  const double diameter_mm = diameter(cad);
  TriangleMesh nominal = welded(cad);
  const bool differs = options.warp_ratio > 0.0 || options.scale != 1.0 || options.dents > 0 || options.bosses > 0;
  if (!differs) return AsBuilt{nominal, {}, 0.0, 0.0};

  nominal = subdivided(nominal, [&](const Eigen::Vector3d&) { return kEdgeRatio * diameter_mm; });
  const std::vector<Bump> bumps = drawn_bumps(nominal, options, diameter_mm, seed);
  nominal = fine_near(nominal, bumps);

  AsBuilt result{displaced(nominal, bumps), bumps, 0.0, 0.0};
  const std::vector<double> areas = vertex_areas(nominal);
  std::vector<Eigen::Vector3d> warped = nominal.vertices;
  warp(warped, areas, options, diameter_mm, bounding_box(cad).center(), seed);
  for (std::size_t i = 0; i < warped.size(); ++i) result.mesh.vertices[i] += warped[i] - nominal.vertices[i];
  fit(result.mesh.vertices, nominal.vertices, areas);

  double squares = 0.0, area = 0.0;
  for (std::size_t i = 0; i < areas.size(); ++i) {
    squares += areas[i] * (result.mesh.vertices[i] - nominal.vertices[i]).squaredNorm();
    area += areas[i];
  }
  result.deviation_rms_mm = std::sqrt(squares / area);
  result.deviation_max_mm = largest_distance(result.mesh.vertices, nominal.vertices);
  return result;
}

}  // namespace asbuilt::simulate
