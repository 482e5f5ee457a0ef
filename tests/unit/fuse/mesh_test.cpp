// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/fuse/mesh.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/random.h"

namespace asbuilt::fuse {
namespace {

using ::testing::HasSubstr;

void add(Reconstruction& to, const Eigen::Vector3d& point, const Eigen::Vector3d& normal, double noise,
         Random& random) {
  to.cloud.positions.push_back((point + noise * random.normal() * normal).cast<float>());
  // Normals of a scan are some degrees off.
  const Eigen::Vector3d wrong(random.normal(), random.normal(), random.normal());
  to.cloud.normals.push_back((normal + (noise > 0.0 ? 0.05 : 0.0) * wrong).normalized().cast<float>());
}

// Evenly spread samples (golden spiral) about 1 mm apart, as far down as `lowest` of the radius.
Reconstruction sphere(double radius, double noise, double lowest = -1.0) {
  Reconstruction result;
  Random random(1, "sphere", 0);
  const int count = static_cast<int>(4.0 * std::numbers::pi * radius * radius);
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / count, turn = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
    if (z < lowest) break;
    const double r = std::sqrt(1.0 - z * z);
    const Eigen::Vector3d normal(r * std::cos(turn), r * std::sin(turn), z);
    add(result, radius * normal, normal, noise, random);
  }
  return result;
}

// A rectangle of jittered samples 1 mm apart.
void add_rectangle(Reconstruction& to, const Eigen::Vector3d& corner, const Eigen::Vector3d& u,
                   const Eigen::Vector3d& v, double noise, std::uint64_t seed) {
  Random random(seed, "rectangle", 0);
  const int rows = static_cast<int>(v.norm()), columns = static_cast<int>(u.norm());
  const Eigen::Vector3d normal = u.cross(v).normalized();
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const double a = (i + 0.5 + 0.25 * random.uniform(-1, 1)) / columns;
      const double b = (j + 0.5 + 0.25 * random.uniform(-1, 1)) / rows;
      add(to, corner + a * u + b * v, normal, noise, random);
    }
  }
}

Reconstruction box(const Eigen::Vector3d& size, double noise) {
  Reconstruction result;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d u = size[(axis + 1) % 3] * Eigen::Vector3d::Unit((axis + 1) % 3);
    const Eigen::Vector3d v = size[(axis + 2) % 3] * Eigen::Vector3d::Unit((axis + 2) % 3);
    const auto seed = static_cast<std::uint64_t>(2 * axis);
    add_rectangle(result, {0, 0, 0}, v, u, noise, seed);
    add_rectangle(result, size[axis] * Eigen::Vector3d::Unit(axis), u, v, noise, seed + 1);
  }
  return result;
}

double distance_to_box(const Eigen::Vector3d& point, const Eigen::Vector3d& size) {
  const Eigen::Array3d beyond = (point - 0.5 * size).array().abs() - 0.5 * size.array();
  const double inside = std::min(beyond.maxCoeff(), 0.0);
  return std::abs(beyond.max(0.0).matrix().norm() + inside);
}

struct EdgeCounts {
  int open = 0, shared_by_more = 0, against_orientation = 0;
};

EdgeCounts edge_counts(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, std::pair<int, int>> uses;  // upward, downward
  for (const Eigen::Vector3i& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      auto& use = uses[std::minmax(a, b)];
      ++(a < b ? use.first : use.second);
    }
  }
  EdgeCounts counts;
  for (const auto& [edge, use] : uses) {
    if (use.first + use.second == 1) ++counts.open;
    if (use.first + use.second > 2) ++counts.shared_by_more;
    if (use.first > 1 || use.second > 1) ++counts.against_orientation;
  }
  return counts;
}

double enclosed_volume(const TriangleMesh& mesh) {
  double volume = 0.0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    volume += mesh.vertices[static_cast<std::size_t>(mesh.triangles[t][0])].dot(doubled_area_vector(mesh, t)) / 6.0;
  }
  return volume;
}

// Of the corners and the middles of all triangles.
double furthest_from_samples(const TriangleMesh& mesh, const Reconstruction& reconstruction) {
  const KdTree tree(reconstruction.cloud.positions);
  double furthest = 0.0;
  const auto consider = [&](const Eigen::Vector3d& point) {
    const float squared = tree.nearest(point.cast<float>()).squared_distance;
    furthest = std::max(furthest, std::sqrt(static_cast<double>(squared)));
  };
  for (const Eigen::Vector3i& t : mesh.triangles) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const int v : t) {
      consider(mesh.vertices[static_cast<std::size_t>(v)]);
      middle += mesh.vertices[static_cast<std::size_t>(v)] / 3.0;
    }
    consider(middle);
  }
  return furthest;
}

void expect_sound(const TriangleMesh& mesh) {
  const EdgeCounts edges = edge_counts(mesh);
  EXPECT_EQ(edges.shared_by_more, 0) << "an edge has more than two triangles";
  EXPECT_EQ(edges.against_orientation, 0) << "neighbours wind in opposite directions";
}

TEST(SurfaceMesh, AClosedSphereStaysClosedAndKeepsItsSize) {
  for (const double noise : {0.0, 0.1}) {
    const double radius = 20.0;
    const TriangleMesh mesh = surface_mesh(sphere(radius, noise), {}, Context(2)).value();
    expect_sound(mesh);
    EXPECT_EQ(edge_counts(mesh).open, 0);
    EXPECT_NEAR(surface_area(mesh) / (4.0 * std::numbers::pi * radius * radius), 1.0, 0.01);
    EXPECT_NEAR(enclosed_volume(mesh) / (4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3)), 1.0, 0.005) << "outward";
    double squares = 0.0, largest = 0.0;
    for (const Eigen::Vector3d& vertex : mesh.vertices) {
      squares += std::pow(vertex.norm() - radius, 2);
      largest = std::max(largest, std::abs(vertex.norm() - radius));
    }
    EXPECT_LT(std::sqrt(squares / static_cast<double>(mesh.vertices.size())), 0.01 + 0.5 * noise);
    EXPECT_LT(largest, 0.03 + 2.0 * noise);
  }
}

TEST(SurfaceMesh, ABoxKeepsItsEdges) {
  const Eigen::Vector3d size(30.0, 24.0, 18.0);
  for (const double noise : {0.0, 0.05}) {
    const TriangleMesh mesh = surface_mesh(box(size, noise), {}, Context(2)).value();
    expect_sound(mesh);
    EXPECT_EQ(edge_counts(mesh).open, 0);
    const double area = 2.0 * (30.0 * 24.0 + 24.0 * 18.0 + 18.0 * 30.0);
    EXPECT_NEAR(surface_area(mesh) / area, 1.0, 0.01);
    EXPECT_NEAR(enclosed_volume(mesh) / size.prod(), 1.0, 0.01);
    double squares = 0.0, nearest_to_corner = 1e9;
    for (const Eigen::Vector3d& vertex : mesh.vertices) {
      squares += std::pow(distance_to_box(vertex, size), 2);
      nearest_to_corner = std::min(nearest_to_corner, vertex.norm());
    }
    EXPECT_LT(std::sqrt(squares / static_cast<double>(mesh.vertices.size())), 0.05 + noise);
    EXPECT_LT(nearest_to_corner, 0.25 + 3.0 * noise) << "the corner is not cut off";
  }
}

TEST(SurfaceMesh, TheTwoSidesOfAThinPlateStayApart) {
  const Eigen::Vector3d size(40.0, 40.0, 3.0);
  Reconstruction plate;
  add_rectangle(plate, {0, 0, 3}, {40, 0, 0}, {0, 40, 0}, 0.05, 1);
  add_rectangle(plate, {0, 0, 0}, {0, 40, 0}, {40, 0, 0}, 0.05, 2);
  const TriangleMesh mesh = surface_mesh(plate, {}, Context(2)).value();
  expect_sound(mesh);
  EXPECT_NEAR(surface_area(mesh) / (2.0 * 40.0 * 40.0), 1.0, 0.08) << "both sides, and no wall at the rim";
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    double lowest = 1e9, highest = -1e9;
    for (const int v : mesh.triangles[t]) {
      lowest = std::min(lowest, mesh.vertices[static_cast<std::size_t>(v)].z());
      highest = std::max(highest, mesh.vertices[static_cast<std::size_t>(v)].z());
    }
    ASSERT_LT(highest - lowest, 0.5) << "nothing joins the sides";
    ASSERT_LT(std::min(std::abs(lowest), std::abs(lowest - 3.0)), 0.3);
    const double up = doubled_area_vector(mesh, t).z();
    ASSERT_GE(lowest > 1.5 ? up : -up, 0.0) << "each side faces outwards";
  }
}

TEST(SurfaceMesh, AHalfSphereStaysOpen) {
  const double radius = 20.0;
  const Reconstruction half = sphere(radius, 0.05, 0.0);
  const TriangleMesh mesh = surface_mesh(half, {}, Context(2)).value();
  expect_sound(mesh);
  EXPECT_GT(edge_counts(mesh).open, 100);
  double lowest = 1e9;
  for (const Eigen::Vector3d& vertex : mesh.vertices) lowest = std::min(lowest, vertex.z());
  EXPECT_GT(lowest, -2.5);
  EXPECT_LT(furthest_from_samples(mesh, half), 2.5);
  EXPECT_GT(surface_area(mesh), 0.97 * 2.0 * std::numbers::pi * radius * radius);
}

TEST(SurfaceMesh, ScatteredSamplesMakeOneClosedSurfaceWithoutPinholes) {
  // Independent random places: gaps of up to two spacings, which a lattice does not have.
  Reconstruction scattered;
  Random random(5, "scattered", 0);
  for (int i = 0; i < 5027; ++i) {
    const Eigen::Vector3d normal = Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
    add(scattered, 20.0 * normal, normal, 0.05, random);
  }
  const TriangleMesh mesh = surface_mesh(scattered, {}, Context(2)).value();
  expect_sound(mesh);
  EXPECT_LT(edge_counts(mesh).open, 30);
  EXPECT_NEAR(surface_area(mesh) / (4.0 * std::numbers::pi * 400.0), 1.0, 0.015);
  EXPECT_LT(furthest_from_samples(mesh, scattered), 3.0);
}

TEST(SurfaceMesh, AHoleInTheCloudIsAHoleInTheMesh) {
  Reconstruction plane;
  add_rectangle(plane, {0, 0, 0}, {40, 0, 0}, {0, 40, 0}, 0.05, 1);
  const auto is_in_hole = [](const Eigen::Vector3f& p) { return std::hypot(p.x() - 20.0F, p.y() - 20.0F) < 6.0F; };
  Reconstruction open;
  for (std::size_t i = 0; i < plane.cloud.size(); ++i) {
    if (is_in_hole(plane.cloud.positions[i])) continue;
    open.cloud.positions.push_back(plane.cloud.positions[i]);
    open.cloud.normals.push_back(plane.cloud.normals[i]);
  }
  const TriangleMesh mesh = surface_mesh(open, {}, Context(2)).value();
  expect_sound(mesh);
  for (const Eigen::Vector3d& vertex : mesh.vertices) {
    EXPECT_GT(std::hypot(vertex.x() - 20.0, vertex.y() - 20.0), 6.0 - 2.5);
  }
  EXPECT_NEAR(surface_area(mesh), 1600.0 - std::numbers::pi * 36.0, 0.08 * 1600.0);
}

TEST(SurfaceMesh, CoarseAndFineRegionsAreBothCovered) {
  Reconstruction mixed;
  add_rectangle(mixed, {0, 0, 0}, {40, 0, 0}, {0, 40, 0}, 0.0, 1);
  Reconstruction coarse;
  add_rectangle(coarse, {20, 0, 0}, {20, 0, 0}, {0, 20, 0}, 0.0, 2);  // 2 mm apart once it is stretched
  for (std::size_t i = 0; i < coarse.cloud.size(); ++i) {
    const Eigen::Vector3f& p = coarse.cloud.positions[i];
    mixed.cloud.positions.emplace_back(2.0F * p.x(), 2.0F * p.y(), 0.0F);
    mixed.cloud.normals.push_back(coarse.cloud.normals[i]);
  }
  const TriangleMesh mesh = surface_mesh(mixed, {}, Context(2)).value();
  expect_sound(mesh);
  EXPECT_NEAR(surface_area(mesh) / 3200.0, 1.0, 0.08);
  EXPECT_LT(edge_counts(mesh).open, 400) << "one rim of 240 mm, no gap in the middle";
}

TEST(SurfaceMesh, NoiseAboveTheSpacingIsAveraged) {
  Reconstruction dense;
  for (std::uint64_t layer = 0; layer < 16; ++layer) {  // a plain union of 16 scans: 0.25 mm spacing, 0.4 mm noise
    add_rectangle(dense, {0, 0, 0}, {40, 0, 0}, {0, 40, 0}, 0.4, layer);
  }
  const TriangleMesh mesh = surface_mesh(dense, {}, Context(2)).value();
  expect_sound(mesh);
  double squares = 0.0;
  for (const Eigen::Vector3d& vertex : mesh.vertices) squares += vertex.z() * vertex.z();
  EXPECT_LT(std::sqrt(squares / static_cast<double>(mesh.vertices.size())), 0.1);
  EXPECT_NEAR(surface_area(mesh) / 1600.0, 1.0, 0.12);
}

TEST(SurfaceMesh, StrayPointsMakeNoSurface) {
  Reconstruction cloud = sphere(15.0, 0.0);
  Random random(3, "stray", 0);
  for (int i = 0; i < 5; ++i) {
    const Eigen::Vector3d far(40.0 + 10.0 * i, random.uniform(-20, 20), random.uniform(-20, 20));
    add(cloud, far, Eigen::Vector3d::UnitX(), 0.0, random);
  }
  const TriangleMesh mesh = surface_mesh(cloud, {}, Context(1)).value();
  for (const Eigen::Vector3d& vertex : mesh.vertices) EXPECT_LT(vertex.norm(), 16.0);
}

TEST(SurfaceMesh, AStatedCellSetsTheFineness) {
  const Reconstruction cloud = sphere(20.0, 0.05);
  MeshOptions coarse;
  coarse.cell_mm = 3.0;
  const TriangleMesh mesh = surface_mesh(cloud, coarse, Context(2)).value();
  expect_sound(mesh);
  EXPECT_EQ(edge_counts(mesh).open, 0);
  EXPECT_NEAR(surface_area(mesh) / (4.0 * std::numbers::pi * 400.0), 1.0, 0.015);
  // A surface crosses about one and a half edges of the grid for each square of it, and each gives two triangles.
  EXPECT_NEAR(static_cast<double>(mesh.triangles.size()) * 9.0 / (4.0 * std::numbers::pi * 400.0), 3.0, 0.5);
}

TEST(SurfaceMesh, NormalsThatPointAnyWayStillGiveSoundEdges) {
  Reconstruction wild;
  Random random(9, "wild", 0);
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Vector3d place(random.uniform(0, 10), random.uniform(0, 10), random.uniform(0, 10));
    add(wild, place, Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized(), 0.0, random);
  }
  MeshOptions options;
  options.min_component_triangles = 0;
  const auto mesh = surface_mesh(wild, options, Context(2));
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  expect_sound(*mesh);
}

TEST(SurfaceMesh, ThreadsNeverMatter) {
  const Reconstruction cloud = box({20.0, 16.0, 5.0}, 0.05);
  const TriangleMesh expected = surface_mesh(cloud, {}, Context(1)).value();
  for (const int threads : {2, 3}) {
    const TriangleMesh mesh = surface_mesh(cloud, {}, Context(threads)).value();
    EXPECT_EQ(mesh.vertices, expected.vertices);
    EXPECT_EQ(mesh.triangles, expected.triangles);
  }
}

TEST(SurfaceMesh, ImpossibleInputsGiveAnError) {
  const auto error = [](const Reconstruction& cloud, const MeshOptions& options) {
    const auto mesh = surface_mesh(cloud, options, Context(1));
    return mesh ? Error{ErrorCode::cancelled, "there is a mesh"} : mesh.error();
  };
  EXPECT_EQ(error({}, {}).code, ErrorCode::not_possible);
  EXPECT_THAT(error({}, {}).message, HasSubstr("the cloud has 0"));
  Reconstruction few = sphere(1.0, 0.0);
  EXPECT_THAT(error(few, {}).message, HasSubstr("at least 20 points"));

  Reconstruction same;
  same.cloud.positions.assign(100, Eigen::Vector3f(1, 2, 3));
  same.cloud.normals.assign(100, Eigen::Vector3f::UnitZ());
  EXPECT_EQ(error(same, {}).code, ErrorCode::not_possible);

  Reconstruction bad = sphere(10.0, 0.0);
  bad.cloud.positions[7].x() = std::nanf("");
  EXPECT_THAT(error(bad, {}).message, HasSubstr("point 7"));
  bad = sphere(10.0, 0.0);
  bad.cloud.normals.clear();
  EXPECT_EQ(error(bad, {}).code, ErrorCode::invalid_argument);

  const Reconstruction good = sphere(10.0, 0.0);
  MeshOptions options;
  options.cell_mm = 1e-4;
  EXPECT_EQ(error(good, options).code, ErrorCode::invalid_argument);
  options.cell_mm = -1.0;
  EXPECT_EQ(error(good, options).code, ErrorCode::invalid_argument);
  options = {};
  options.max_hole_spacings = 5.0;
  EXPECT_EQ(error(good, options).code, ErrorCode::invalid_argument);
}

TEST(SurfaceMesh, ACancelledRunSaysSo) {
  std::stop_source stop;
  stop.request_stop();
  Context context(1);
  context.stop = stop.get_token();
  EXPECT_EQ(surface_mesh(sphere(10.0, 0.0), {}, context).error().code, ErrorCode::cancelled);
}

}  // namespace
}  // namespace asbuilt::fuse
