// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/surface_mesh.h"

#include <gtest/gtest.h>

#include <map>

#include "unit/model/shapes.h"

namespace asbuilt::model {
namespace {

TriangleMesh plain(const SurfaceMesh& mesh) {
  TriangleMesh result;
  result.vertices = mesh.vertices;
  for (const auto& t : mesh.triangles) {
    result.triangles.emplace_back(static_cast<int>(t[0]), static_cast<int>(t[1]), static_cast<int>(t[2]));
  }
  return result;
}

double longest_edge(const SurfaceMesh& mesh) {
  double longest = 0.0;
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      longest = std::max(longest, (mesh.vertices[t[k]] - mesh.vertices[t[(k + 1) % 3]]).norm());
    }
  }
  return longest;
}

/// Edges, by the places of their ends, that do not lie between exactly two triangles.
std::size_t gaps(const SurfaceMesh& mesh) {
  using Place = std::array<double, 3>;
  std::map<std::pair<Place, Place>, int> uses;
  const auto place = [&](std::uint32_t v) {
    return Place{mesh.vertices[v].x(), mesh.vertices[v].y(), mesh.vertices[v].z()};
  };
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++uses[std::minmax(place(t[k]), place(t[(k + 1) % 3]))];
  }
  return static_cast<std::size_t>(std::ranges::count_if(uses, [](const auto& use) { return use.second != 2; }));
}

TEST(SurfaceMesh, OfACubeSharesNoVertexAcrossItsEdges) {
  const auto cube = test::joined(test::box({0, 0, 0}, {10, 10, 10}));
  const SurfaceMesh mesh = surface_mesh(cube, {});
  EXPECT_EQ(mesh.vertices.size(), 24U);  // four a side
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Eigen::Vector3d normal = doubled_area_vector(plain(mesh), i).normalized();
    for (const std::uint32_t v : mesh.triangles[i]) EXPECT_NEAR(mesh.normals[v].cast<double>().dot(normal), 1.0, 1e-6);
  }
}

TEST(SurfaceMesh, OfASphereSharesItsVerticesAndPointsOutwards) {
  const auto sphere = test::sphere({1, 2, 3}, 10.0, 4);
  const SurfaceMesh mesh = surface_mesh(sphere, {});
  EXPECT_EQ(mesh.vertices.size(), sphere.vertices.size());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d outwards = (mesh.vertices[i] - Eigen::Vector3d(1, 2, 3)).normalized();
    EXPECT_GT(mesh.normals[i].cast<double>().dot(outwards), 0.999);
  }
}

TEST(SurfaceMesh, IsSplitToTheLengthWithoutGapsAndKeepsItsArea) {
  TriangleMesh part = test::joined(test::box({0, 0, 0}, {100, 7, 3}));
  for (int i = 0; i < 12; ++i) part.cad_faces.push_back(i / 2);
  const SurfaceMesh mesh = surface_mesh(part, {.edge_length_mm = 2.0});
  EXPECT_LE(longest_edge(mesh), 2.0);
  EXPECT_EQ(gaps(mesh), 0U);
  EXPECT_NEAR(surface_area(plain(mesh)), surface_area(part), 1e-6);
  ASSERT_EQ(mesh.faces.size(), mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
    EXPECT_EQ(mesh.faces[i], mesh.skin_triangles[i] / 2);
    const Eigen::Vector3d whole = doubled_area_vector(part, mesh.skin_triangles[i]).normalized();
    EXPECT_NEAR(doubled_area_vector(plain(mesh), i).normalized().dot(whole), 1.0, 1e-9);
  }
}

TEST(SurfaceMesh, StaysWithinItsBudget) {
  const auto cube = test::joined(test::box({0, 0, 0}, {10, 10, 10}));
  const SurfaceMesh split = surface_mesh(cube, {.edge_length_mm = 0.05, .max_triangles = 5000});
  EXPECT_LE(split.triangles.size(), 5000U);
  EXPECT_GT(split.triangles.size(), 1200U);
  EXPECT_EQ(gaps(split), 0U);
  const auto fine = test::sphere({0, 0, 0}, 10.0, 6);
  const SurfaceMesh thinned = surface_mesh(fine, {.edge_length_mm = 0.05, .max_triangles = 5000});
  EXPECT_LE(thinned.triangles.size(), 5000U);
  EXPECT_NEAR(surface_area(plain(thinned)), surface_area(fine), 0.03 * surface_area(fine));
}

TEST(SurfaceMesh, OfNothingIsNothing) { EXPECT_TRUE(surface_mesh({}, {.edge_length_mm = 1.0}).triangles.empty()); }

}  // namespace
}  // namespace asbuilt::model
