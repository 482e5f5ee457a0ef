// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/outer_skin.h"

#include <gtest/gtest.h>

#include "asbuilt/model/mesh_edges.h"
#include "unit/model/shapes.h"

namespace asbuilt::model {
namespace {

OuterSkin skin_of(const TriangleMesh& mesh, bool keep_inner = false) {
  const Context context(2);
  return outer_skin(mesh, face_visibility(mesh, RayScene(mesh), {}, context), keep_inner);
}

TriangleMesh split_skin_of(const TriangleMesh& mesh) {
  const SeenMesh seen = split_where_hidden(mesh, RayScene(mesh), {}, Context(2));
  return outer_skin(seen.mesh, seen.visibility, false).mesh;
}

/// Area of the triangles whose corners are all such.
template <class Condition>
double area_where(const TriangleMesh& mesh, const Condition& is_such) {
  double area = 0.0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto corner = [&](int k) { return mesh.vertices[static_cast<std::size_t>(mesh.triangles[i][k])]; };
    if (is_such(corner(0)) && is_such(corner(1)) && is_such(corner(2))) {
      area += 0.5 * doubled_area_vector(mesh, i).norm();
    }
  }
  return area;
}

TriangleMesh unit_box(int cuts = 1) { return test::joined(test::box({0, 0, 0}, {10, 10, 10}, cuts)); }

TEST(FaceVisibility, OfAConvexBodyIsAllOutsideAndNothingInside) {
  const TriangleMesh mesh = test::sphere({0, 0, 0}, 10.0, 3);
  for (const FaceVisibility& face : face_visibility(mesh, RayScene(mesh), {}, Context(2))) {
    EXPECT_TRUE(face.is_visible);
    EXPECT_EQ(face.front, 1.0F);
    EXPECT_EQ(face.back, 0.0F);
  }
}

TEST(FaceVisibility, OfTheBottomOfAWellIsTheShareOfTheLightThatReachesIt) {
  // Form factor from a small face to a parallel square above its centre, four times that of a square above a corner:
  // 4 / pi * a * atan(a) with a = X / sqrt(1 + X^2), X = half the width / depth (any handbook of radiative transfer).
  const double width = 4.0, depth = 3.0;
  TriangleMesh well = test::joined(test::box({-2, -2, 0}, {2, 2, depth}));
  std::vector<Eigen::Vector3i> open;
  for (std::size_t i = 0; i < well.triangles.size(); ++i) {
    if (doubled_area_vector(well, i).normalized().z() < 0.9) open.push_back(well.triangles[i]);
  }
  well.triangles = open;
  // One tiny face at the centre of the bottom, just above it, facing up.
  const int base = static_cast<int>(well.vertices.size());
  for (const Eigen::Vector3d& p :
       {Eigen::Vector3d(-0.01, -0.01, 0.001), Eigen::Vector3d(0.01, -0.01, 0.001), Eigen::Vector3d(0, 0.01, 0.001)}) {
    well.vertices.push_back(p);
  }
  well.triangles.emplace_back(base, base + 1, base + 2);
  VisibilityOptions options;
  options.rays = 4096;
  options.occlusion_threshold = 0.01;  // so that it does not stop early
  const double x = width / 2.0 / depth, a = x / std::sqrt(1.0 + x * x);
  const double expected = 4.0 / std::numbers::pi * a * std::atan(a);
  const FaceVisibility seen = face_visibility(well, RayScene(well), options, Context(2)).back();
  EXPECT_NEAR(static_cast<double>(seen.front), expected, 0.02);  // 4096 even rays: better than 1 / sqrt(4096)
  EXPECT_EQ(seen.back, 0.0F);
}

TEST(OuterSkin, DropsABoxInsideABox) {
  const TriangleMesh outer = unit_box(3);
  const TriangleMesh both = test::together(test::box({2, 2, 2}, {5, 6, 7}, 2), outer);
  const OuterSkin skin = skin_of(both);
  EXPECT_EQ(skin.inner_dropped, 48U);
  EXPECT_EQ(skin.mesh.triangles.size(), outer.triangles.size());
  EXPECT_NEAR(surface_area(skin.mesh), 600.0, 1e-9);
  EXPECT_NEAR(skin.inner_area, 2.0 * (3 * 4 + 4 * 5 + 5 * 3), 1e-9);
}

TEST(OuterSkin, KeepsTheInnerBoxOnRequest) {
  const TriangleMesh both = test::together(test::box({2, 2, 2}, {5, 6, 7}), unit_box());
  EXPECT_EQ(skin_of(both, true).mesh.triangles.size(), both.triangles.size());
}

TEST(OuterSkin, RestoresFlippedWindings) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Random random(seed, "flip", 0);
    const TriangleMesh original = test::sphere({1, 2, 3}, 10.0, 2);
    TriangleMesh mesh = original;
    std::size_t flips = 0;
    for (Eigen::Vector3i& triangle : mesh.triangles) {
      if (random.uniform() < 0.1 * static_cast<double>(seed + 1)) {  // up to all of them
        test::flip(triangle);
        ++flips;
      }
    }
    const OuterSkin skin = skin_of(mesh);
    EXPECT_EQ(skin.flipped, flips);
    EXPECT_NEAR(test::sixfold_volume(skin.mesh), test::sixfold_volume(original), 1e-6) << "seed " << seed;
    for (std::size_t i = 0; i < skin.mesh.triangles.size(); ++i) {
      const Eigen::Vector3d& corner = skin.mesh.vertices[static_cast<std::size_t>(skin.mesh.triangles[i][0])];
      ASSERT_GT(doubled_area_vector(skin.mesh, i).dot(corner - Eigen::Vector3d(1, 2, 3)), 0.0);
    }
  }
}

TEST(OuterSkin, TurnsATriangleSoupOutwardsFaceByFace) {
  TriangleMesh soup;  // no face knows its neighbours here
  const TriangleMesh sphere = test::sphere({0, 0, 0}, 5.0, 2);
  for (std::size_t i = 0; i < sphere.triangles.size(); ++i) {
    const int base = static_cast<int>(soup.vertices.size());
    for (int k = 0; k < 3; ++k)
      soup.vertices.push_back(sphere.vertices[static_cast<std::size_t>(sphere.triangles[i][k])]);
    soup.triangles.emplace_back(base, base + 1, base + 2);
    if (i % 3 == 0) test::flip(soup.triangles.back());
  }
  EXPECT_NEAR(test::sixfold_volume(skin_of(soup).mesh), test::sixfold_volume(sphere), 1e-6);
}

TEST(OuterSkin, OpensNothingByDroppingTheBottomOfADeepBore) {
  // A block with a square blind hole, 2 wide and 24 deep: its bottom is hidden by the threshold's measure.
  TriangleMesh block;
  const auto add_box_side = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                                const Eigen::Vector3d& d) {
    const int base = static_cast<int>(block.vertices.size());
    block.vertices.insert(block.vertices.end(), {a, b, c, d});
    block.triangles.emplace_back(base, base + 1, base + 2);
    block.triangles.emplace_back(base, base + 2, base + 3);
  };
  const double outer = 6.0, inner = 1.0, height = 28.0, bottom = 4.0;
  const auto corner = [](double half, int quarter, double z) {
    const double x = quarter == 0 || quarter == 3 ? -half : half, y = quarter < 2 ? -half : half;
    return Eigen::Vector3d(x, y, z);
  };
  for (int q = 0; q < 4; ++q) {
    const int r = (q + 1) % 4;
    add_box_side(corner(outer, q, 0), corner(outer, r, 0), corner(outer, r, height), corner(outer, q, height));
    add_box_side(corner(inner, r, bottom), corner(inner, q, bottom), corner(inner, q, height),
                 corner(inner, r, height));
    add_box_side(corner(outer, q, height), corner(outer, r, height), corner(inner, r, height),
                 corner(inner, q, height));
  }
  add_box_side(corner(outer, 3, 0), corner(outer, 2, 0), corner(outer, 1, 0), corner(outer, 0, 0));
  add_box_side(corner(inner, 0, bottom), corner(inner, 1, bottom), corner(inner, 2, bottom), corner(inner, 3, bottom));
  const TriangleMesh mesh = test::joined(block);
  ASSERT_EQ(count_open_edges(mesh), 0U);
  const std::vector<FaceVisibility> seen = face_visibility(mesh, RayScene(mesh), {}, Context(2));
  EXPECT_TRUE(!seen.back().is_visible || seen.back().is_dim);  // or this test would test nothing
  const OuterSkin skin = outer_skin(mesh, seen, false);
  EXPECT_EQ(skin.inner_dropped, 0U);
  EXPECT_NEAR(test::sixfold_volume(skin.mesh) / 6.0, 12.0 * 12.0 * 28.0 - 2.0 * 2.0 * 24.0, 1e-9);
}

TEST(OuterSkin, KeepsTheWindingOfASheetThatIsSeenFromBothSides) {
  TriangleMesh sheet;
  for (int i = 0; i < 4; ++i) sheet.vertices.emplace_back(i, 0, 0), sheet.vertices.emplace_back(i, 1, 0);
  for (int i = 0; i < 3; ++i) {
    sheet.triangles.emplace_back(2 * i, 2 * i + 2, 2 * i + 3);
    sheet.triangles.emplace_back(2 * i, 2 * i + 3, 2 * i + 1);
  }
  test::flip(sheet.triangles[2]);  // one against five
  const OuterSkin skin = skin_of(sheet);
  EXPECT_EQ(skin.flipped, 1U);
  EXPECT_EQ(skin.inner_dropped, 0U);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_GT(doubled_area_vector(skin.mesh, i).z(), 0.0);
}

TEST(OuterSkin, KeepsTheWindingOfAnOpenBowl) {
  for (const bool inside_out : {false, true}) {
    TriangleMesh bowl = test::sphere({0, 0, 0}, 10.0, 3);
    std::erase_if(bowl.triangles, [&](const Eigen::Vector3i& t) {
      double height = 0.0;
      for (int k = 0; k < 3; ++k) height += bowl.vertices[static_cast<std::size_t>(t[k])].z();
      return height > 0.0;
    });
    if (inside_out) std::ranges::for_each(bowl.triangles, test::flip);
    EXPECT_EQ(skin_of(bowl).flipped, 0U);
  }
}

TEST(OuterSkin, KeepsAClosedPartWithAHoleInItsBottomWholeAndOutwards) {
  TriangleMesh part = test::sphere({0, 0, 0}, 10.0, 4);
  std::erase_if(part.triangles,
                [&](const Eigen::Vector3i& t) { return part.vertices[static_cast<std::size_t>(t[0])].z() < -9.5; });
  const std::size_t count = part.triangles.size();
  std::ranges::for_each(part.triangles, test::flip);  // a file that is inside out
  const OuterSkin skin = skin_of(part);
  EXPECT_EQ(skin.mesh.triangles.size(), count);
  EXPECT_EQ(skin.flipped, count);
  EXPECT_GT(test::sixfold_volume(skin.mesh), 0.0);
}

TEST(OuterSkin, KeepsALargeUnsplitFaceOfWhichOnlyARimIsVisible) {
  // A plate of two triangles with a closed box on it that leaves a narrow rim free.
  const TriangleMesh mesh = test::together(test::box({0, 0, 0}, {100, 100, 5}), test::box({3, 3, 5}, {97, 97, 60}));
  const OuterSkin skin = skin_of(mesh);
  std::size_t top_faces = 0;
  for (std::size_t i = 0; i < skin.mesh.triangles.size(); ++i) {
    const Eigen::Vector3i& t = skin.mesh.triangles[i];
    bool is_top = true;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d& p = skin.mesh.vertices[static_cast<std::size_t>(t[k])];
      is_top = is_top && p.z() == 5.0 && (p.x() == 0.0 || p.x() == 100.0);
    }
    top_faces += is_top ? 1 : 0;
  }
  EXPECT_EQ(top_faces, 2U);
  EXPECT_EQ(skin.inner_dropped, 2U);  // the covered side of the box on top
}

TEST(OuterSkin, DropsWhatABoxCoversOfALargeFaceAndKeepsTheRim) {
  const TriangleMesh mesh = test::together(test::box({0, 0, 0}, {100, 100, 5}), test::box({3, 3, 5}, {97, 97, 60}));
  const RayScene rays(mesh);
  const SeenMesh seen = split_where_hidden(mesh, rays, {}, Context(2));
  EXPECT_NEAR(surface_area(seen.mesh), surface_area(mesh), 1e-6);
  const OuterSkin skin = outer_skin(seen.mesh, seen.visibility, false);
  double on_top = 0.0;
  for (std::size_t i = 0; i < skin.mesh.triangles.size(); ++i) {
    const Eigen::Vector3i& t = skin.mesh.triangles[i];
    const auto z = [&](int k) { return skin.mesh.vertices[static_cast<std::size_t>(t[k])].z(); };
    if (z(0) == 5.0 && z(1) == 5.0 && z(2) == 5.0) on_top += 0.5 * doubled_area_vector(skin.mesh, i).norm();
  }
  const double rim = 100.0 * 100.0 - 94.0 * 94.0, longest_edge = 0.015 * diameter(mesh);
  EXPECT_GE(on_top, rim - 1e-6);
  EXPECT_LE(on_top, rim + 4.0 * 94.0 * 2.0 * longest_edge);  // pieces that reach under the box's edge
  // Nothing else is missing: five sides of the plate, five of the box.
  EXPECT_NEAR(surface_area(skin.mesh) - on_top, 100.0 * 100.0 + 4.0 * 500.0 + 94.0 * 94.0 + 4.0 * 94.0 * 55.0, 1e-6);
}

TEST(OuterSkin, KeepsTheDepthOfASlotOfOneBody) {
  // A slot 1 wide and 60 deep in a U: nobody sees far down, yet without its walls the skin would be open.
  const TriangleMesh left = test::box({0, 0, 0}, {10, 30, 60}), right = test::box({11, 0, 0}, {21, 30, 60});
  const TriangleMesh u = test::joined(test::together(test::together(left, right), test::box({10, 0, 0}, {11, 30, 1})));
  EXPECT_NEAR(surface_area(split_skin_of(u)), surface_area(u), 1e-6);
}

TEST(OuterSkin, DropsWhatABodyCoversOfItsOwnFaces) {
  // Plate and box have an edge in common, so that they are one body.
  const TriangleMesh mesh =
      test::joined(test::together(test::box({0, 0, 0}, {100, 100, 5}), test::box({0, 0, 5}, {100, 90, 60})));
  const double at_z5 = area_where(split_skin_of(mesh), [](const Eigen::Vector3d& p) { return p.z() == 5.0; });
  EXPECT_GE(at_z5, 100.0 * 10.0 - 1e-6);
  EXPECT_LE(at_z5, 100.0 * (10.0 + 2.0 * 0.015 * diameter(mesh)));
}

TEST(OuterSkin, TakesForTheDepthOfABoreOnlyWhatNoOtherBodyCovers) {
  // A strip of three large triangles: in plain sight, dim, and dark.
  TriangleMesh strip;
  strip.vertices = {{0, 0, 0}, {0, 10, 0}, {10, 0, 0}, {10, 10, 0}, {20, 0, 0}};
  strip.triangles = {{0, 2, 1}, {1, 2, 3}, {2, 4, 3}};
  std::vector<FaceVisibility> seen(3);
  seen[0] = {.front = 0.9F, .is_visible = true};
  seen[1] = {.front = 0.01F, .is_visible = true, .is_dim = true};
  seen[2] = {.hidden = 1.0F};
  EXPECT_EQ(outer_skin(strip, seen, false).mesh.triangles.size(), 3U);
  seen[2].covered = 1.0F;
  EXPECT_EQ(outer_skin(strip, seen, false).mesh.triangles.size(), 2U);
}

TEST(FaceVisibility, OfTheFloorOfASlitThatOnlyGrazingRaysLeave) {
  // Midway between two plates of 100 x 100 that are 1 apart, a small face sees out by less than 0.02 of a radian.
  TriangleMesh mesh = test::together(test::box({-50, -50, -1}, {50, 50, 0}), test::box({-50, -50, 1}, {50, 50, 2}));
  const std::vector<FaceVisibility> seen = face_visibility(mesh, RayScene(mesh), {}, Context(2));
  for (const FaceVisibility& face : seen) EXPECT_TRUE(face.is_visible);
  // Of the inner faces the rims are seen, and their middle too, but only by rays even over the hemisphere: of those
  // 2 % leave there (sin 0.02), of cosine-weighted ones 0.04 % (its square).
  VisibilityOptions strict;
  strict.occlusion_threshold = 0.0;
  TriangleMesh small = mesh;
  const int base = static_cast<int>(small.vertices.size());
  for (const Eigen::Vector3d& p :
       {Eigen::Vector3d(-0.1, -0.1, 0.001), Eigen::Vector3d(0.1, -0.1, 0.001), Eigen::Vector3d(0, 0.1, 0.001)}) {
    small.vertices.push_back(p);
  }
  small.triangles.emplace_back(base, base + 1, base + 2);
  EXPECT_TRUE(face_visibility(small, RayScene(small), {}, Context(2)).back().is_visible);
  EXPECT_FALSE(face_visibility(small, RayScene(small), strict, Context(2)).back().is_visible);
}

}  // namespace
}  // namespace asbuilt::model
