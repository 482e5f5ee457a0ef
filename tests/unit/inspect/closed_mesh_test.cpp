// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/inspect/closed_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "asbuilt/inspect/deviation.h"
#include "unit/model/shapes.h"

namespace asbuilt::inspect {
namespace {

constexpr double kBoxEdge = 100.0;
constexpr std::array<double, 6> kOffsets{0.3, -0.2, 0.5,
                                         0.1, -0.4, 0.25};  // of the sides -x, +x, -y, +y, -z, +z, outwards

TriangleMesh box_mesh() { return test::joined(test::box({0, 0, 0}, {kBoxEdge, kBoxEdge, kBoxEdge})); }

/// Points on the chosen sides of the cube, each moved outwards by its offset.
PointCloud sides(const std::vector<int>& chosen) {
  PointCloud cloud;
  for (const int side : chosen) {
    const int axis = side / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
    const double offset = kOffsets[static_cast<std::size_t>(side)];
    for (double a = 0.5; a < kBoxEdge; a += 1.0) {
      for (double b = 0.5; b < kBoxEdge; b += 1.0) {
        Eigen::Vector3d p;
        p[axis] = side % 2 == 1 ? kBoxEdge + offset : -offset;
        p[u] = a;
        p[v] = b;
        cloud.positions.push_back(p.cast<float>());
        cloud.normals.push_back((side % 2 == 1 ? 1.0F : -1.0F) * Eigen::Vector3f::Unit(axis));
      }
    }
  }
  return cloud;
}

Result<ClosedMesh> closed(const TriangleMesh& cad, const PointCloud& cloud) {
  const Context context(2);
  const model::PreparedModel model = model::prepare(cad, {}, context).value();
  const DeviationReport report = inspect(cloud, model, {}, context).value();
  return closed_mesh(model, *report.finder, {.edge_length_mm = 4.0}, context);
}

/// Sides of triangles that no other triangle runs the other way.
std::size_t unmatched_sides(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> balance;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      balance[std::minmax(a, b)] += a < b ? 1 : -1;
    }
  }
  return static_cast<std::size_t>(std::ranges::count_if(balance, [](const auto& edge) { return edge.second != 0; }));
}

double volume(const TriangleMesh& mesh) {
  double sum = 0.0;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const auto at = [&](int k) { return mesh.vertices[static_cast<std::size_t>(t[k])]; };
    sum += at(0).dot(at(1).cross(at(2))) / 6.0;
  }
  return sum;
}

TEST(ClosedMesh, OfAPartMeasuredOnAllSidesIsThePartWithItsSharpEdges) {
  const ClosedMesh whole = closed(box_mesh(), sides({0, 1, 2, 3, 4, 5})).value();
  EXPECT_EQ(unmatched_sides(whole.mesh), 0U);
  EXPECT_EQ(whole.holes_closed, 0U);
  EXPECT_EQ(std::ranges::count(whole.filled, 1), 0);
  const double expected = (kBoxEdge + kOffsets[0] + kOffsets[1]) * (kBoxEdge + kOffsets[2] + kOffsets[3]) *
                          (kBoxEdge + kOffsets[4] + kOffsets[5]);
  EXPECT_NEAR(volume(whole.mesh), expected, 1e-4 * expected);
  // The corner of the faces -x, -y, -z, which CAD has at the origin.
  const Eigen::Vector3d corner(-kOffsets[0], -kOffsets[2], -kOffsets[4]);
  const auto nearest = std::ranges::min(whole.mesh.vertices, {}, [&](const auto& v) { return (v - corner).norm(); });
  EXPECT_LT((nearest - corner).norm(), 0.01);
}

TEST(ClosedMesh, MarksWhatWasNotMeasuredAndReturnsToTheCadThere) {
  const ClosedMesh half = closed(box_mesh(), sides({5})).value();
  EXPECT_EQ(unmatched_sides(half.mesh), 0U);
  for (std::size_t i = 0; i < half.mesh.vertices.size(); ++i) {
    const Eigen::Vector3d& v = half.mesh.vertices[i];
    EXPECT_EQ(half.filled[i] != 0, std::isnan(half.deviation_mm[i]));
    const bool inside_top = v.z() > kBoxEdge - 1.0 && (v - Eigen::Vector3d(50, 50, v.z())).cwiseAbs().maxCoeff() < 45.0;
    if (inside_top) {
      EXPECT_EQ(half.filled[i], 0);
      EXPECT_NEAR(v.z(), kBoxEdge + kOffsets[5], 1e-3);
    } else if (v.z() < kBoxEdge - 10.0) {
      EXPECT_EQ(half.filled[i], 1);
    }
    // Six return lengths below the rim exp(-6) of its displacement is left.
    if (v.z() < kBoxEdge - 6.0 * 0.05 * std::sqrt(3.0) * kBoxEdge) {
      EXPECT_LT((v - v.cwiseMax(0.0).cwiseMin(kBoxEdge)).norm(), 0.003);
    }
  }
}

TEST(ClosedMesh, ClosesAHoleOfTheModelAndSaysSo) {
  TriangleMesh open = box_mesh();
  std::erase_if(open.triangles, [&](const Eigen::Vector3i& t) {
    return std::ranges::all_of(t, [&](int v) { return open.vertices[static_cast<std::size_t>(v)].z() < 1.0; });
  });
  ASSERT_EQ(open.triangles.size(), 10U);
  const ClosedMesh whole = closed(open, sides({0, 1, 2, 3, 5})).value();
  EXPECT_EQ(unmatched_sides(whole.mesh), 0U);
  EXPECT_EQ(whole.holes_closed, 1U);
  EXPECT_NEAR(volume(whole.mesh), std::pow(kBoxEdge, 3), 0.02 * std::pow(kBoxEdge, 3));
}

TEST(ClosedMesh, OfNothingMeasuredIsRefused) {
  const auto nothing = closed(box_mesh(), {});
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().code, ErrorCode::not_possible);
}

TEST(ClosedMesh, IsTheSameForAnyNumberOfThreads) {
  const Context one(1), two(2);
  const model::PreparedModel model = model::prepare(box_mesh(), {}, two).value();
  const DeviationReport report = inspect(sides({1, 5}), model, {}, two).value();
  const ClosedMesh a = closed_mesh(model, *report.finder, {.edge_length_mm = 6.0}, one).value();
  const ClosedMesh b = closed_mesh(model, *report.finder, {.edge_length_mm = 6.0}, two).value();
  EXPECT_EQ(a.mesh.vertices, b.mesh.vertices);
  EXPECT_EQ(a.mesh.triangles, b.mesh.triangles);
}

}  // namespace
}  // namespace asbuilt::inspect
