// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/lost_end.h"

#include <gtest/gtest.h>

#include <vector>

#include "asbuilt/verify/verify.h"
#include "unit/verify/asked.h"

namespace asbuilt::verify {
namespace {

const Eigen::Vector3d kShorter(100, 80, 40);

// Small things in the corners of the picture: what lies between them and the box was looked at.
std::vector<TriangleMesh> with_corners(std::vector<TriangleMesh> others) {
  for (const double x : {-110.0, 110.0}) {
    for (const double y : {-110.0, 110.0}) others.push_back(test::plate_at({6, 6, 6}, {x, y, 500}));
  }
  return others;
}

/// A box in a scan, looked at from its corner, asked as a box of `believed` edges whose corner lies there.
struct BelievedWhole : test::Asked {
  BelievedWhole(const Eigen::Vector3d& built, const Eigen::Vector3d& believed, const std::vector<TriangleMesh>& others)
      : test::Asked(test::prepared(simulate::box(believed)),
                    (test::corner_ahead(500) * Eigen::Translation3d(0.5 * (built - believed))).inverse(),
                    test::with(with_corners(others), simulate::box(built), test::corner_ahead(500)), 0.25) {}
  [[nodiscard]] double lost() const { return lost_end_share(model_from_scan, model, *seen_by, options); }
};

TEST(LostEnd, IsNoneWhereTheWholeBoxCameBack) {
  EXPECT_LT(BelievedWhole(test::kBrick, test::kBrick, {}).lost(), 0.005);
}

// Where the brick goes on and the shorter box does not, nothing comes back: the lower third of two of three faces. From
// straight ahead of the corner every face is looked at alike. What lies within a few measurements of the built edge, a
// quarter of the third, cannot be told from it.
TEST(LostEnd, IsTheShareOfWhatAShorterBoxLeavesOut) {
  const double all =
      test::kBrick.x() * test::kBrick.y() + test::kBrick.y() * test::kBrick.z() + test::kBrick.z() * test::kBrick.x();
  const double left_out = (test::kBrick.x() + test::kBrick.y()) * (test::kBrick.z() - kShorter.z());
  const double lost = BelievedWhole(kShorter, test::kBrick, {}).lost();
  EXPECT_LT(lost, left_out / all);
  EXPECT_GT(lost, 0.5 * left_out / all);
  EXPECT_GT(lost, 2.0 * test::kLimits.max_lost_end_share);
}

TEST(LostEnd, IsNoneWhereSomethingBehindIsSeen) {
  const std::vector<TriangleMesh> wall{test::plate_at({2000, 2000, 10}, {0, 0, 900})};
  const BelievedWhole wrong(kShorter, test::kBrick, wall);
  EXPECT_LT(wrong.lost(), 0.01);
  EXPECT_GT(wrong.evidence.free_space_share(), test::kLimits.max_free_space_share) << "what tells instead";
}

// Where the half of a ball that is in sight goes missing below, the rest tells its size.
TEST(LostEnd, IsNoneOfASurfaceThatTellsHowLongItIs) {
  const TriangleMesh ball = simulate::sphere(40.0, 4);
  const Pose scan_from_model = test::pose_at({0, 0, 500}, {0, 0, 0});
  TriangleMesh cap = ball;
  std::erase_if(cap.triangles, [&](const Eigen::Vector3i& triangle) {
    return ball.vertices[static_cast<std::size_t>(triangle[0])].y() < -15.0;
  });
  const test::Asked asked(test::prepared(ball), scan_from_model.inverse(),
                          test::with(with_corners({}), cap, scan_from_model), 0.25);
  EXPECT_GT(asked.evidence.missing, 0.05 * asked.evidence.facing);
  EXPECT_EQ(lost_end_share(asked.model_from_scan, asked.model, *asked.seen_by, asked.options), 0.0);
}

}  // namespace
}  // namespace asbuilt::verify
