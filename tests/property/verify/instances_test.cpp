// SPDX-License-Identifier: Apache-2.0
// Several placements of the part in one scan.
#include "asbuilt/verify/instances.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "asbuilt/verify/verdict.h"
#include "unit/verify/seen.h"

namespace asbuilt::verify {
namespace {

struct Part {
  explicit Part(const TriangleMesh& the_mesh) : mesh(the_mesh) {}

  TriangleMesh mesh;
  Context context{2};
  model::PreparedModel model = test::prepared(mesh);
  std::shared_ptr<const detect::Codebook> book = detect::build_codebook(model, {}, context).value();

  [[nodiscard]] std::vector<detect::Hypothesis> hypotheses(const scan::Scan& scan) const {
    return detect::find_hypotheses(scan, *book, {}, context).value();
  }
  [[nodiscard]] std::vector<Detection> placements(const scan::Scan& scan) const {
    return verify_instances(scan, model, hypotheses(scan), {}, context).value();
  }
  [[nodiscard]] TriangleMesh at(const Pose& scan_from_model) const {
    return simulate::transformed(mesh, scan_from_model);
  }
  [[nodiscard]] double error(const Detection& detection, const Pose& scan_from_model) const {
    return displacement_mm(detection.best.model_from_scan, scan_from_model.inverse(), model) / model.diameter;
  }
};

const Part& casing() {
  static const Part part(test::casing());
  return part;
}

/// Which of several bodies a point of a noiseless scan lies on.
std::size_t body_of(const Eigen::Vector3f& point, const std::vector<Pose>& scan_from_model,
                    const model::PreparedModel& model) {
  std::size_t nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < scan_from_model.size(); ++k) {
    const Eigen::Vector3d in_model = scan_from_model[k].inverse() * point.cast<double>();
    const double distance = std::abs(model.surface->nearest(in_model).signed_distance);
    if (distance < least) nearest = k, least = distance;
  }
  return nearest;
}

TEST(Instances, EachOfTwoPartsIsAPlacementWithItsOwnPoints) {
  const double d = casing().model.diameter;
  // Side by side, and so close that each reaches into the margin of the other.
  for (const double apart : {1.1, 0.75}) {
    const std::vector<Pose> poses{test::pose_at({-0.5 * apart * d, 0, 3.0 * d}),
                                  test::pose_at({0.5 * apart * d, 0, 3.0 * d}, {1.0, 2.0, 0.3})};
    const scan::Scan scan = test::seen({casing().at(poses[0]), casing().at(poses[1])}, 0.4, 0.004);
    const std::vector<Detection> placements = casing().placements(scan);
    ASSERT_EQ(placements.size(), 2U) << apart << " diameters apart";
    std::vector<int> claims(scan.cloud.size(), 0);
    for (const Detection& placement : placements) {
      EXPECT_EQ(placement.status, Status::accepted) << placement.explanation;
      const std::size_t body = casing().error(placement, poses[0]) < casing().error(placement, poses[1]) ? 0 : 1;
      EXPECT_LT(casing().error(placement, poses[body]), 0.02) << apart << " diameters apart";
      double own = 0, all = 0;
      for (std::uint32_t i = 0; i < scan.cloud.size(); ++i) {
        all += body_of(scan.cloud.positions[i], poses, casing().model) == body ? 1 : 0;
      }
      for (const std::uint32_t i : placement.segment) {
        ++claims[i];
        own += body_of(scan.cloud.positions[i], poses, casing().model) == body ? 1 : 0;
      }
      EXPECT_GT(own / all, 0.97) << apart << " diameters apart";
      EXPECT_GT(own / static_cast<double>(placement.segment.size()), 0.995) << apart << " diameters apart";
      EXPECT_TRUE(std::ranges::is_sorted(placement.margin_points));
    }
    EXPECT_LE(*std::ranges::max_element(claims), 1) << "a point belongs to two placements";
    EXPECT_GT(
        (placements[0].best.model_from_scan.translation() - placements[1].best.model_from_scan.translation()).norm(),
        1e-6);
  }
}

TEST(Instances, OfASinglePartThereIsOneJustAsWhenOneIsWanted) {
  const scan::Scan scan = test::seen({casing().at(test::pose_at({0, 0, 3.0 * casing().model.diameter}))});
  const auto hypotheses = casing().hypotheses(scan);
  const Detection one = verify(scan, casing().model, hypotheses, {}, casing().context).value();
  const std::vector<Detection> all = casing().placements(scan);
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all[0].status, Status::accepted);
  EXPECT_EQ(all[0].best.model_from_scan.matrix(), one.best.model_from_scan.matrix());
  EXPECT_EQ(all[0].segment, one.segment);
  EXPECT_EQ(all[0].explanation, one.explanation);
}

TEST(Instances, WhereThePartIsNotThereIsOneRejection) {
  const TriangleMesh other = simulate::scaled(test::casing(), Eigen::Vector3d::Constant(0.75));
  const Pose pose = test::pose_at({0, 0, 3.0 * casing().model.diameter});
  const std::vector<Detection> placements = casing().placements(test::seen({simulate::transformed(other, pose)}));
  ASSERT_EQ(placements.size(), 1U);
  EXPECT_EQ(placements[0].status, Status::rejected);
  EXPECT_TRUE(placements[0].segment.empty());
}

/// A rail with two groups of bosses that are alike; its ends tell them apart.
TriangleMesh rail() {
  const auto block = [](const Eigen::Vector3d& size, const Eigen::Vector3d& where) {
    return simulate::transformed(simulate::box(size), Pose(Eigen::Translation3d(where)));
  };
  std::vector<TriangleMesh> blocks{block({400, 40, 20}, {0, 0, 0}), block({20, 40, 60}, {-190, 0, 40})};
  for (const double group : {-90.0, 90.0}) {
    blocks.push_back(block({30, 20, 70}, {group - 25, -8, 45}));
    blocks.push_back(block({15, 30, 50}, {group + 20, 4, 35}));
    blocks.push_back(block({10, 10, 80}, {group + 45, 12, 50}));
  }
  return simulate::merged(blocks);
}

TEST(Instances, TwoPosesThatExplainTheSamePointsAreNotTwoPlacements) {
  const Part part(rail());
  // Seen from above, aslant. Screens in front, too large to be taken for the rail, hide all of it but one
  // group of bosses.
  Pose pose(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(2.7, Eigen::Vector3d::UnitX()));
  pose.translation() = Eigen::Vector3d(0, 0, 900) - pose * Eigen::Vector3d(-90, 0, 20);
  const TriangleMesh left = test::plate_at({1000, 1000, 2}, {-545, 0, 600}),
                     right = test::plate_at({1000, 1000, 2}, {545, 0, 600});
  const scan::Scan scan = test::seen({part.at(pose), left, right}, 0.45, 0.002);
  const Detection one = verify(scan, part.model, part.hypotheses(scan), {}, part.context).value();
  ASSERT_EQ(one.reason, Reason::second_instance) << one.explanation;
  const std::vector<Detection> all = part.placements(scan);
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all[0].status, Status::ambiguous) << all[0].explanation;
  EXPECT_EQ(all[0].reason, Reason::second_instance);
  EXPECT_THAT(all[0].explanation, testing::HasSubstr("same points"));
  EXPECT_EQ(all[0].candidates.size(), one.candidates.size());
}

TEST(Instances, AreTheSameForAnyNumberOfThreads) {
  const double d = casing().model.diameter;
  const scan::Scan scan = test::seen({casing().at(test::pose_at({-0.5 * d, 0, 3.0 * d})),
                                      casing().at(test::pose_at({0.5 * d, 0, 3.0 * d}, {1.0, 2.0, 0.3}))},
                                     0.4, 0.005);
  const auto hypotheses = casing().hypotheses(scan);
  const auto expected = verify_instances(scan, casing().model, hypotheses, {}, Context(1)).value();
  for (const int threads : {2, 3}) {
    const auto placements = verify_instances(scan, casing().model, hypotheses, {}, Context(threads)).value();
    ASSERT_EQ(placements.size(), expected.size());
    for (std::size_t i = 0; i < placements.size(); ++i) {
      EXPECT_EQ(placements[i].best.model_from_scan.matrix(), expected[i].best.model_from_scan.matrix());
      EXPECT_EQ(placements[i].segment, expected[i].segment);
      EXPECT_EQ(placements[i].margin_points, expected[i].margin_points);
    }
  }
}

}  // namespace
}  // namespace asbuilt::verify
