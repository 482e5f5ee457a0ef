// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/rim_points.h"

#include <gmock/gmock.h>

#include <cmath>

#include "asbuilt/core/random.h"
#include "asbuilt/refine/normal_equations.h"
#include "asbuilt/refine/refine.h"
#include "asbuilt/refine/sampled_view.h"

namespace asbuilt::refine {
namespace {

// A face: a point of it, two axes in it (their cross product looks outwards), and its half lengths along them.
struct Face {
  Eigen::Vector3d centre, u, v;
  double half_u = 0.0, half_v = 0.0;
};

// Samples on a square grid of 1 mm, turned and shifted as drawn, up to the very ends of the face.
void sample(const Face& face, double turn, double noise, Random& random, PointCloud& cloud) {
  const double shift_x = random.uniform(), shift_y = random.uniform();
  const int most = static_cast<int>(std::ceil(std::hypot(face.half_u, face.half_v))) + 1;
  const Eigen::Vector3d normal = face.u.cross(face.v);
  for (int i = -most; i <= most; ++i) {
    for (int j = -most; j <= most; ++j) {
      const double x = i + shift_x, y = j + shift_y;
      const double a = std::cos(turn) * x - std::sin(turn) * y, b = std::sin(turn) * x + std::cos(turn) * y;
      if (std::abs(a) > face.half_u || std::abs(b) > face.half_v) continue;
      cloud.positions.push_back(
          (face.centre + a * face.u + b * face.v + noise * random.normal() * normal).cast<float>());
      cloud.normals.push_back(normal.cast<float>());
    }
  }
}

RimPoints ends_of(const PointCloud& cloud, double noise) {
  const KdTree tree(cloud.positions);
  const std::vector<Place> places = places_of(cloud, tree, 1.0, Context(1));
  std::vector<std::uint32_t> rim;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (places[i] == Place::rim) rim.push_back(static_cast<std::uint32_t>(i));
  }
  return rim_points(cloud, tree, rim, 1.0, noise, Context(2));
}

TEST(RimPoints, TellWhereAFaceEndsWhateverTheGrid) {
  const Face face{Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), 30.0, 20.0};
  for (const double turn : {0.0, 0.25, std::atan(0.5), 0.25 * 3.14159265358979323846}) {
    double beyond = 0.0, squares = 0.0, across = 0.0;
    std::size_t count = 0;
    for (std::uint64_t draw = 0; draw < 40; ++draw) {
      Random random(1, "face", draw);
      PointCloud cloud;
      sample(face, turn, 0.2, random, cloud);
      const RimPoints rims = ends_of(cloud, 0.2);
      for (std::size_t i = 0; i < rims.ends.size(); ++i) {
        const Eigen::Vector3f& outward = rims.ends.normals[i];
        across += static_cast<double>(outward.cwiseAbs().maxCoeff());
        const Eigen::Vector3f& end = rims.ends.positions[i];
        const bool along_x = std::abs(outward.x()) > std::abs(outward.y());
        const double off = along_x ? std::copysign(1.0, outward.x()) * end.x() - face.half_u
                                   : std::copysign(1.0, outward.y()) * end.y() - face.half_v;
        beyond += off;
        squares += off * off;
        ++count;
      }
    }
    ASSERT_GT(count, 40U * 60U) << "grid turned by " << turn;
    const auto n = static_cast<double>(count);
    EXPECT_GT(across / n, 0.98) << "across the rim, but for a few beside corners";
    EXPECT_LT(std::abs(beyond / n), 0.1) << "spacings, grid turned by " << turn;
    EXPECT_LT(std::sqrt(squares / n), 0.45) << "spacings, grid turned by " << turn;
  }
}

TEST(RimPoints, LeaveOutARimThatIsNotStraight) {
  PointCloud disc;
  for (int x = -5; x <= 5; ++x) {
    for (int y = -5; y <= 5; ++y) {
      if (std::hypot(x, y) > 3.5) continue;
      disc.positions.emplace_back(static_cast<float>(x), static_cast<float>(y), 0.0F);
      disc.normals.push_back(Eigen::Vector3f::UnitZ());
    }
  }
  EXPECT_EQ(ends_of(disc, 0.1).ends.size(), 0U);
}

// Two views of a block, 60 x 40 x 30 mm: both see its top and one side, the first its right end, the second its left
// end. Faces that both see leave the second free to slide along the block, and the block free to be shorter or longer.
std::vector<View> two_ends_of_a_block(std::uint64_t seed, double slide) {
  const auto x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(), z = Eigen::Vector3d::UnitZ();
  const Face top{15.0 * z, x, y, 30.0, 20.0}, side{20.0 * y, z, x, 15.0, 30.0};
  const Face right{30.0 * x, y, z, 20.0, 15.0}, left{-30.0 * x, z, y, 15.0, 20.0};
  constexpr double kNoise = 0.1;
  std::vector<View> views(2);
  for (std::size_t v = 0; v < 2; ++v) {
    Random random(seed, "block", v);
    for (const Face& face : {top, side, v == 0 ? right : left}) {
      sample(face, random.uniform(0.0, 1.5), kNoise, random, views[v].segment_in_scan);
    }
    views[v].noise_sigma_mm = kNoise;
    views[v].model_from_scan = Pose::Identity();
    views[v].beside_occluder.assign(views[v].segment_in_scan.size(), 0);
  }
  views[1].model_from_scan.translation() = Eigen::Vector3d(slide, 0.05, -0.05);
  return views;
}

TEST(RimPoints, HoldASlideAlongTheFacesThatTwoViewsShare) {
  RefineOptions with, without;
  with.rim_matches = true;
  without.rim_matches = false;
  double squares = 0.0, squares_without = 0.0;
  constexpr int kDraws = 6;
  for (std::uint64_t seed = 0; seed < kDraws; ++seed) {
    const std::vector<View> views = two_ends_of_a_block(seed, seed % 2 == 0 ? 0.8 : -0.8);
    const std::vector<Link> links{{0, 1}};
    const auto slide_of = [&](const RefineOptions& options) {
      const Refinement result = refine::refine(views, links, options, Context(2)).value();
      const Pose apart = result.model_from_scan[0].inverse() * result.model_from_scan[1];
      EXPECT_NEAR(apart.translation().y(), 0.0, 0.05);
      EXPECT_NEAR(apart.translation().z(), 0.0, 0.05);
      EXPECT_EQ(result.unheld.empty(), options.rim_matches);
      return apart.translation().x();
    };
    squares += std::pow(slide_of(with), 2);
    squares_without += std::pow(slide_of(without), 2);
  }
  EXPECT_LT(std::sqrt(squares / kDraws), 0.25) << "of a spacing";
  EXPECT_GT(std::sqrt(squares_without / kDraws), 0.5);
}

// Something in front hides the left 2 mm of all that the first view sees of the block, and the second one's right 2 mm.
// What is left of their faces ends there, but not because the block does.
std::vector<View> two_covered_ends(bool known) {
  std::vector<View> views = two_ends_of_a_block(3, 0.8);
  for (std::size_t v = 0; v < 2; ++v) {
    const float side = v == 0 ? 1.0F : -1.0F;
    PointCloud left;
    for (std::size_t i = 0; i < views[v].segment_in_scan.size(); ++i) {
      if (side * views[v].segment_in_scan.positions[i].x() < -28.0F) continue;
      left.positions.push_back(views[v].segment_in_scan.positions[i]);
      left.normals.push_back(views[v].segment_in_scan.normals[i]);
    }
    views[v].segment_in_scan = left;
    views[v].beside_occluder.clear();
    for (const Eigen::Vector3f& point : left.positions) {
      views[v].beside_occluder.push_back(known && side * point.x() < -26.0F ? 1 : 0);
    }
  }
  return views;
}

TEST(RimPoints, AreNoEndsBesideAnOccluder) {
  RefineOptions options;
  const std::vector<Link> links{{0, 1}};
  const auto slide_of = [&](const std::vector<View>& views) {
    const Refinement result = refine::refine(views, links, options, Context(2)).value();
    return (result.model_from_scan[0].inverse() * result.model_from_scan[1]).translation().x();
  };
  EXPECT_NEAR(slide_of(two_covered_ends(false)), 2.0, 0.4) << "taken for ends of a shorter block";
  EXPECT_NEAR(slide_of(two_covered_ends(true)), 0.8, 0.1) << "nothing moves it";
  std::vector<View> not_known = two_covered_ends(false);
  for (View& view : not_known) view.beside_occluder.clear();
  EXPECT_NEAR(slide_of(not_known), 0.8, 0.1);
}

// Faces hold all but a slide along x: of a link that holds everything, only that is left.
TEST(RimPoints, HaveASayOnlyWhereFacesDoNotHold) {
  EdgeSums faces;
  faces.weight = faces.weighted_square_position = 1.0;
  faces.information.diagonal() << 1.0, 1.0, 1.0, 0.001, 1.0, 1.0;
  LinkBlock ends;
  ends.information = 2.0 * Matrix6d::Identity();
  ends.gradient = Vector6d::Ones();
  const LinkBlock part = part_not_held_by(faces, ends, Scaling{}, 0.01);
  Matrix6d information = Matrix6d::Zero();
  information(3, 3) = 2.0;
  EXPECT_TRUE(part.information.isApprox(information, 1e-12));
  EXPECT_TRUE(part.gradient.isApprox(Vector6d::Unit(3), 1e-12));
}

TEST(RimPoints, AreNotLookedForInPaperMode) { EXPECT_FALSE(RefineOptions{}.as_published().rim_matches); }

}  // namespace
}  // namespace asbuilt::refine
