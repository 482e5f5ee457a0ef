// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/prepared_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "asbuilt/model/sampling_choice.h"
#include "unit/model/shapes.h"

namespace asbuilt::model {
namespace {

using ::testing::HasSubstr;

const Context kTwoThreads(2);

Error error_of(const TriangleMesh& mesh, const ModelOptions& options = {}) {
  const auto result = prepare(mesh, options, kTwoThreads);
  return result ? Error{ErrorCode::invalid_argument, "there was no error"} : result.error();
}

TEST(Prepare, TurnsABoxWithABoxInsideIntoTheOuterOne) {
  const PreparedModel model =
      prepare(test::together(test::box({0, 0, 0}, {100, 80, 60}, 4), test::box({20, 20, 20}, {50, 50, 40}, 2)), {},
              kTwoThreads)
          .value();
  EXPECT_NEAR(surface_area(model.skin), 2.0 * (100 * 80 + 80 * 60 + 60 * 100), 1e-6);
  EXPECT_NEAR(test::sixfold_volume(model.skin) / 6.0, 100.0 * 80.0 * 60.0, 1e-6);
  EXPECT_EQ(model.report.inner_dropped, 48U);
  EXPECT_EQ(model.report.open_edges, 0U);
  EXPECT_EQ(model.report.triangles_in, 12U * 16U + 48U);
  EXPECT_NEAR(model.diameter, std::sqrt(100.0 * 100 + 80 * 80 + 60 * 60), 1e-9);
  for (const Eigen::Vector3f& p : model.dense_samples.positions) {
    ASSERT_NEAR(model.surface->nearest(p.cast<double>()).signed_distance, 0.0, 1e-4);
  }
}

TEST(Prepare, GivesEverythingThatTheStagesNeed) {
  const PreparedModel model = prepare(test::sphere({5, 5, 5}, 50.0, 4), {}, kTwoThreads).value();
  ASSERT_TRUE(model.surface && model.field && model.rays);
  EXPECT_EQ(model.face_normals.size(), model.skin.triangles.size());
  EXPECT_TRUE(model.rays->first_hit({5, 5, 500}, {0, 0, -1}).found());
  EXPECT_NEAR(model.surface->nearest({5, 5, 65}).signed_distance, 10.0, 0.1);
  EXPECT_NEAR(model.field->at({5, 5, 57}).distance, 2.0F, 0.1F);
  EXPECT_TRUE(model.field->at({5, 5, 5.0F + 50.0F + 0.09F * static_cast<float>(model.diameter)}).known());
  EXPECT_GE(model.sampling_distance, 0.025 * model.diameter - 1e-9);
  EXPECT_LE(model.sampling_distance, 0.05 * model.diameter + 1e-9);
  EXPECT_GE(model.samples.size(), 400U);
  EXPECT_LE(model.samples.size(), 2500U);
  EXPECT_GT(model.dense_samples.size(), 4 * model.samples.size());
  EXPECT_LE(model.dense_samples.size(), 60000U);
  for (std::size_t i = 0; i < model.samples.size(); ++i) {
    const Eigen::Vector3f outwards = (model.samples.positions[i] - Eigen::Vector3f(5, 5, 5)).normalized();
    ASSERT_GT(model.samples.normals[i].dot(outwards), 0.98F);
  }
}

TEST(Prepare, ObeysTheSamplingRatio) {
  ModelOptions options;
  options.sampling_ratio = 0.1;
  const PreparedModel model = prepare(test::box({0, 0, 0}, {30, 40, 120}, 2), options, kTwoThreads).value();
  EXPECT_NEAR(model.sampling_distance, 13.0, 1e-9);  // 30, 40, 120: a diagonal of 130
}

TEST(Prepare, SamplesASlimPartMoreFinelyThanABulkyOne) {
  const double bulky = choose_sampling_ratio(test::box({0, 0, 0}, {100, 100, 100}));
  const double slim = choose_sampling_ratio(test::box({0, 0, 0}, {100, 100, 5}));
  EXPECT_LT(slim, 0.7 * bulky);
  EXPECT_GE(slim, 0.025);  // the paper's finest, though a quarter of 5 mm would be finer still
  EXPECT_LE(bulky, 0.05);
}

TEST(Prepare, FindsTheExtentsOfATurnedBox) {
  TriangleMesh mesh = test::box({-1, -2, -5}, {1, 2, 5}, 3);
  const Eigen::AngleAxisd turn(0.7, Eigen::Vector3d(1, 2, 3).normalized());
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex = turn * vertex + Eigen::Vector3d(7, 8, 9);
  EXPECT_NEAR((principal_extents(mesh) - Eigen::Vector3d(2, 4, 10)).norm(), 0.0, 1e-9);
}

TEST(Prepare, MeasuresThinWalls) {
  const PreparedModel plate = prepare(test::box({0, 0, 0}, {100, 100, 3}, 4), {}, kTwoThreads).value();
  EXPECT_NEAR(plate.report.thin_wall, 3.0, 0.01);
  EXPECT_LE(plate.field->voxel_mm(), 1.5);
}

TEST(Prepare, GivesTheSameForAnyNumberOfThreads) {
  const TriangleMesh mesh =
      test::together(test::sphere({0, 0, 0}, 50.0, 4), test::box({40, -10, -10}, {90, 10, 10}, 3));
  const PreparedModel one = prepare(mesh, {}, Context(1)).value();
  for (const int threads : {2, 3}) {
    const PreparedModel other = prepare(mesh, {}, Context(threads)).value();
    EXPECT_EQ(other.skin.vertices, one.skin.vertices);
    EXPECT_EQ(other.skin.triangles, one.skin.triangles);
    EXPECT_EQ(other.samples.positions, one.samples.positions);
    EXPECT_EQ(other.samples.normals, one.samples.normals);
    EXPECT_EQ(other.dense_samples.positions, one.dense_samples.positions);
    EXPECT_EQ(other.report.thin_wall, one.report.thin_wall);
  }
}

TEST(Prepare, DoesNotChangeWithTheUnit) {
  // A part 1000 times as large is the same part: nothing in here is an absolute length.
  TriangleMesh small =
      test::together(test::sphere({0, 0, 0}, 0.05, 3), test::box({0.04, -0.01, -0.01}, {0.09, 0.01, 0.01}));
  TriangleMesh large = small;
  for (Eigen::Vector3d& vertex : large.vertices) vertex *= 1024.0;
  const PreparedModel a = prepare(small, {}, kTwoThreads).value(), b = prepare(large, {}, kTwoThreads).value();
  EXPECT_EQ(a.skin.triangles, b.skin.triangles);
  ASSERT_EQ(a.samples.size(), b.samples.size());
  EXPECT_NEAR(b.sampling_distance, 1024.0 * a.sampling_distance, 1e-9);
}

TEST(Prepare, RefusesAMeshWithoutTriangles) {
  EXPECT_EQ(error_of({}).code, ErrorCode::not_possible);
  EXPECT_THAT(error_of({}).message, HasSubstr("no triangles"));
}

TEST(Prepare, RefusesAMeshWithoutArea) {
  TriangleMesh line;
  line.vertices = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}};
  line.triangles = {{0, 1, 2}};
  EXPECT_EQ(error_of(line).code, ErrorCode::not_possible);
  EXPECT_THAT(error_of(line).message, HasSubstr("without area"));
  TriangleMesh point;
  point.vertices = {{3, 3, 3}};
  point.triangles = {{0, 0, 0}};
  EXPECT_EQ(error_of(point).code, ErrorCode::not_possible);
  EXPECT_THAT(error_of(point).message, HasSubstr("extent of 0 mm"));
}

TEST(Prepare, RefusesCoordinatesThatAreNotFiniteAndNamesTheVertex) {
  TriangleMesh mesh = test::box({0, 0, 0}, {1, 1, 1});
  mesh.vertices[5].z() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(error_of(mesh).code, ErrorCode::not_possible);
  EXPECT_THAT(error_of(mesh).message, HasSubstr("vertex 5"));
}

TEST(Prepare, IgnoresVerticesThatNoTriangleUses) {
  TriangleMesh mesh = test::box({0, 0, 0}, {10, 10, 10});
  mesh.vertices.emplace_back(std::nan(""), 1e30, 0);
  EXPECT_NEAR(prepare(mesh, {}, kTwoThreads).value().diameter, std::sqrt(300.0), 1e-9);
}

TEST(Prepare, RefusesIndicesOutOfRange) {
  TriangleMesh mesh = test::box({0, 0, 0}, {1, 1, 1});
  mesh.triangles[2][1] = 1000;
  EXPECT_EQ(error_of(mesh).code, ErrorCode::invalid_argument);
}

TEST(Prepare, TakesASingleTriangle) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}};
  mesh.triangles = {{0, 1, 2}};
  const PreparedModel model = prepare(mesh, {}, kTwoThreads).value();
  EXPECT_EQ(model.skin.triangles.size(), 1U);
  EXPECT_EQ(model.report.open_edges, 3U);
  EXPECT_GT(model.samples.size(), 10U);
}

TEST(Prepare, RefusesOptionsThatMakeNoSense) {
  const TriangleMesh mesh = test::box({0, 0, 0}, {1, 1, 1});
  ModelOptions options;
  options.occlusion_threshold = 1.5;
  EXPECT_THAT(error_of(mesh, options).message, HasSubstr("occlusion_threshold"));
  options = {};
  options.occlusion_rays = 0;
  EXPECT_THAT(error_of(mesh, options).message, HasSubstr("occlusion_rays"));
  options = {};
  options.sampling_ratio = std::nan("");
  EXPECT_THAT(error_of(mesh, options).message, HasSubstr("sampling_ratio"));
}

TEST(Prepare, StopsWhenAsked) {
  std::stop_source source;
  source.request_stop();
  Context context(2);
  context.stop = source.get_token();
  const auto result = prepare(test::sphere({0, 0, 0}, 10.0, 4), {}, context);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::cancelled);
}

}  // namespace
}  // namespace asbuilt::model
