// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/inspect/faces.h"

#include <gtest/gtest.h>

#include "unit/model/shapes.h"

namespace asbuilt::inspect {
namespace {

SurfacePart part(std::size_t spots, std::size_t scanned, double in_tolerance) {
  SurfacePart result;
  result.spots = spots;
  result.spots_scanned = scanned;
  result.statistics.in_tolerance = in_tolerance;
  return result;
}

TEST(Verdict, HasAFixedVocabulary) {
  EXPECT_EQ(name_of(Verdict::pass), "pass");
  EXPECT_EQ(name_of(Verdict::fail), "fail");
  EXPECT_EQ(name_of(Verdict::not_enough_data), "not enough data");
  EXPECT_EQ(name_of(Verdict::not_scanned), "not scanned");
}

TEST(Verdict, OfAFaceFollowsWhatWasScannedOfIt) {
  EXPECT_EQ(verdict_of(part(100, 0, 0.0), {}), Verdict::not_scanned);
  EXPECT_EQ(verdict_of(part(100, 2, 0.0), {}), Verdict::not_enough_data);
  EXPECT_EQ(verdict_of(part(100, 90, 0.95), {}), Verdict::fail);
  EXPECT_EQ(verdict_of(part(100, 10, 0.5), {}), Verdict::fail);  // what was seen is bad enough
  EXPECT_EQ(verdict_of(part(100, 49, 1.0), {}), Verdict::not_enough_data);
  EXPECT_EQ(verdict_of(part(100, 50, 1.0), {}), Verdict::pass);
  EXPECT_EQ(verdict_of(part(1000, 1000, 0.99), {}), Verdict::pass);
}

TEST(Verdict, IsNotLeftToASingleSpotUnlessAllMustBeWithin) {
  EXPECT_EQ(verdict_of(part(20, 20, 0.95), {}), Verdict::pass);
  EXPECT_EQ(verdict_of(part(20, 20, 0.90), {}), Verdict::fail);
  EXPECT_EQ(verdict_of(part(20, 20, 0.95), {.required_share = 1.0}), Verdict::fail);
}

TEST(Verdict, OfThePartFailsWithOneFace) {
  std::vector<SurfacePart> faces(3, part(100, 100, 1.0));
  EXPECT_FALSE(verdict_of_all(faces, {}, 1.0, {}).has_value());
  for (SurfacePart& face : faces) face.verdict = Verdict::pass;
  EXPECT_EQ(verdict_of_all(faces, {}, 1.0, {}), Verdict::pass);
  faces[1].verdict = Verdict::not_scanned;  // does not stand in the way while enough of the part was
  EXPECT_EQ(verdict_of_all(faces, {}, 0.7, {}), Verdict::pass);
  EXPECT_EQ(verdict_of_all(faces, {}, 0.49, {}), Verdict::not_enough_data);
  faces[2].verdict = Verdict::fail;
  EXPECT_EQ(verdict_of_all(faces, {}, 0.49, {}), Verdict::fail);
}

TEST(FaceMap, CutsACubeIntoSixPiecesAndASphereIntoOne) {
  EXPECT_EQ(faces_of(test::joined(test::box({0, 0, 0}, {10, 10, 10}, 3))).names.size(), 6U);
  EXPECT_EQ(faces_of(test::sphere({0, 0, 0}, 5.0, 4)).names.size(), 1U);
}

TEST(FaceMap, TakesThoseOfTheCadWhereThereAreAny) {
  TriangleMesh cube = test::joined(test::box({0, 0, 0}, {10, 10, 10}));
  cube.cad_faces.assign(12, 4);
  cube.cad_faces[3] = 9;
  const FaceMap map = faces_of(cube);
  EXPECT_EQ(map.cad_face, (std::vector<int>{4, 9}));
  EXPECT_EQ(map.names[1], "face 9");
  EXPECT_EQ(map.of_triangle[3], 1U);
  EXPECT_EQ(faces_of(cube, {{}, {}, {}, {}, {"rim", "lid"}}).names,
            (std::vector<std::string>{"face 4 \"rim\" of lid", "face 9"}));
}

}  // namespace
}  // namespace asbuilt::inspect
