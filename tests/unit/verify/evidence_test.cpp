// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/evidence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "unit/verify/seen.h"

namespace asbuilt::verify {
namespace {

const model::PreparedModel& block() {
  static const model::PreparedModel model = test::prepared(test::stepped_block(), 0.03);
  return model;
}

const Eigen::Vector3d kPlace(0, 0, 600);

PoseEvidence judged(const scan::Scan& scan, const Pose& scan_from_model, const model::PreparedModel& model = block(),
                    std::vector<std::uint8_t> background = {}) {
  if (background.empty()) background.assign(scan.cloud.size(), 0);
  const ScanEvidence evidence(scan, background);
  return evidence_for(scan_from_model.inverse(), model.dense_samples, model, evidence,
                      {0.5, std::max(0.5, 2.5 * scan.spacing_mm)});
}

TriangleMesh part_at(const Pose& scan_from_model) {
  return simulate::transformed(test::stepped_block(), scan_from_model);
}

TEST(Evidence, OfTheTruePoseIsAllForIt) {
  const Pose pose = test::pose_at(kPlace);
  const PoseEvidence evidence = judged(test::seen({part_at(pose), test::wall()}), pose);
  EXPECT_GT(evidence.score(), 0.97);
  EXPECT_LT(evidence.free_space_share(), 0.005);
  EXPECT_LT(evidence.contradicted, 0.01 * evidence.facing);
  EXPECT_LT(evidence.hidden, 0.02 * evidence.facing);
  EXPECT_EQ(evidence.samples, block().dense_samples.size());
}

TEST(Evidence, LooksFurtherAlongWhatIsLookedAtFlatly) {
  const EvidenceOptions options{0.5, 3.0};
  EXPECT_EQ(lateral_at(options, 1.0), 3.0);
  EXPECT_EQ(lateral_at(options, 0.7), 3.0);
  EXPECT_NEAR(lateral_at(options, 0.3), 6.0, 1e-12);
  EXPECT_EQ(lateral_at(options, -0.3), lateral_at(options, 0.3)) << "a sheet has two sides";
  EXPECT_EQ(lateral_at(options, 0.01), lateral_at(options, kGrazing)) << "such samples are not asked";
  EXPECT_EQ(lateral_at(options, 0.0), 3.0) << "unknown";
}

// A sensor of coarser steps one way than the other: by the distance to the nearest, a plate looked at flatly has gaps.
TEST(Evidence, GapsBetweenRaysDenyNothing) {
  const Eigen::Vector3d tilt(1.28, 0, 0);  // 73 degrees
  const Pose pose = test::pose_at(kPlace, tilt);
  static const model::PreparedModel plate = test::prepared(simulate::box({200, 200, 5}), 0.03);
  scan::Scan dense = test::seen({simulate::transformed(simulate::box({200, 200, 5}), pose), test::wall()}, 0.25, 0.002);
  PointCloud rows;  // every second row of rays
  for (const Eigen::Vector3f& point : dense.cloud.positions) {
    const auto row = std::lround((static_cast<double>(point.y() / point.z()) - 2e-5 + 0.25) / 0.002);
    if (row % 2 == 0) rows.positions.push_back(point);
  }
  const scan::ViewpointRequest origin{false, {scan::Viewpoint::Kind::point, Eigen::Vector3d::Zero()}};
  const scan::Scan scan = scan::prepare_scan(rows, std::nullopt, origin, {}, Context(2)).value();
  const ScanEvidence evidence(scan, std::vector<std::uint8_t>(scan.cloud.size(), 0));
  const PoseEvidence found = evidence_for(pose.inverse(), plate.dense_samples, plate, evidence,
                                          {0.5, 2.5 * spacing_at(pose.inverse(), plate, scan)});
  EXPECT_LT(found.contradicted + found.seen_through, 0.015 * found.facing);
  EXPECT_GT(found.score(), 0.97);
}

TEST(Evidence, EverySampleThatOughtToBeSeenIsOfOneKind) {
  const Pose pose = test::pose_at(kPlace), claimed = test::pose_at(kPlace + Eigen::Vector3d(30, 10, 5));
  const PoseEvidence e = judged(test::seen({part_at(pose), test::wall()}), claimed);
  EXPECT_NEAR(e.explained + e.hidden + e.contradicted + e.seen_through + e.missing, e.facing, 1e-9 * e.facing);
  EXPECT_GE(e.explained_anywhere, e.explained_samples);
}

TEST(Evidence, HiddenIsNeutral) {
  const Pose pose = test::pose_at(kPlace);
  // A plate at two thirds of the way that covers everything to the right of the part's middle.
  const Eigen::Vector3d middle = pose * Eigen::Vector3d(bounding_box(block().skin).center());
  const TriangleMesh plate = test::plate_at({400, 400, 5}, {200.0 + middle.x() * 400.0 / middle.z(), 0, 400});
  const PoseEvidence open = judged(test::seen({part_at(pose), test::wall()}), pose);
  const PoseEvidence covered = judged(test::seen({part_at(pose), test::wall(), plate}), pose);
  EXPECT_GT(covered.hidden, 0.3 * covered.facing);
  EXPECT_LT(covered.hidden, 0.7 * covered.facing);
  EXPECT_NEAR(covered.score(), open.score(), 0.03);
  EXPECT_LT(covered.free_space_share(), 0.01);
  EXPECT_LT(covered.visible_share(), 0.8 * open.visible_share()) << "Eq. 11 itself does count it";
}

TEST(Evidence, SeenThroughCountsAgainst) {
  const Pose pose = test::pose_at(kPlace);
  const PoseEvidence evidence = judged(test::seen({test::wall()}), pose);  // the part is not there at all
  EXPECT_GT(evidence.free_space_share(), 0.97);
  EXPECT_LT(evidence.score(), 0.01);
}

TEST(Evidence, NoReturnIsWeakerThanSeenThrough) {
  const Pose pose = test::pose_at(kPlace);
  // Two plates at opposite corners of the image, so that the camera looked at the part's place as well.
  const PoseEvidence nothing = judged(
      test::seen({test::plate_at({60, 60, 5}, {-160, -160, 800}), test::plate_at({60, 60, 5}, {160, 160, 800})}), pose);
  EXPECT_GT(nothing.missing, 0.95 * nothing.facing);
  const PoseEvidence through = judged(test::seen({test::wall()}), pose);
  EXPECT_GT(through.seen_through, 0.95 * through.facing);
  PoseEvidence half_missing, half_seen_through;
  half_missing.explained = half_seen_through.explained = 1.0;
  half_missing.missing = half_seen_through.seen_through = 1.0;
  EXPECT_GT(half_missing.score(), half_seen_through.score());
}

TEST(Evidence, WhereTheCameraDidNotLookIsNeutral) {
  const Pose pose = test::pose_at(kPlace);
  const std::vector<TriangleMesh> things{part_at(pose), test::wall()};
  const PoseEvidence whole = judged(test::seen(things), pose);
  const PoseEvidence close_up = judged(test::seen(things, 0.04, 0.0005), pose);  // cuts off most of the part
  EXPECT_LT(close_up.explained, 0.6 * whole.explained);
  EXPECT_GT(close_up.hidden, 0.4 * close_up.facing);
  EXPECT_LT(close_up.missing, 0.05 * close_up.facing);
  EXPECT_GT(close_up.score(), 0.97);
}

TEST(Evidence, ASurfaceElsewhereContradicts) {
  const Pose pose = test::pose_at(kPlace);
  const Pose nearer = test::pose_at(kPlace - Eigen::Vector3d(0, 0, 1.8));  // between distance and lateral tolerance
  const PoseEvidence evidence = judged(test::seen({part_at(pose), test::wall()}), nearer);
  EXPECT_GT(evidence.contradicted, 0.5 * evidence.facing);
}

TEST(Evidence, BackgroundNeverConfirms) {
  const Pose pose = test::pose_at(kPlace);
  const scan::Scan scan = test::seen({part_at(pose), test::wall()});
  // All but one point: a kd-tree of none is not asked here.
  std::vector<std::uint8_t> background(scan.cloud.size(), 1);
  background.front() = 0;
  const PoseEvidence evidence = judged(scan, pose, block(), background);
  EXPECT_EQ(evidence.explained, 0.0);
  EXPECT_GT(evidence.contradicted, 0.9 * evidence.facing);
}

// A plate seen straight on shows a plane: two translations and one rotation are free.
TEST(WeakestDirection, IsZeroOnAPlane) {
  const TriangleMesh mesh = simulate::box({100, 80, 20});
  const model::PreparedModel model = test::prepared(mesh, 0.04);
  const Pose pose(Eigen::Translation3d(0, 0, 5000));
  scan::Scan scan = test::seen({simulate::transformed(mesh, pose)}, 0.015, 0.0003);
  const PoseEvidence evidence = judged(scan, pose, model);
  ASSERT_GT(evidence.explained_samples, 100U);
  EXPECT_LT(evidence.weakest_direction(), 1e-9);
}

// The side of a cylinder, ends out of sight: it can slide along its axis.
TEST(WeakestDirection, IsZeroOnACylinder) {
  const TriangleMesh mesh = simulate::cylinder(40.0, 150.0, 96);
  const model::PreparedModel model = test::prepared(mesh, 0.04);
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_axis_angle({0.5 * 3.14159265358979323846, 0, 0});
  pose.translation() = Eigen::Vector3d(0, 0, 5000);
  const scan::Scan scan = test::seen({simulate::transformed(mesh, pose)}, 0.02, 0.0004);
  const PoseEvidence evidence = judged(scan, pose, model);
  ASSERT_GT(evidence.explained_samples, 100U);
  EXPECT_LT(evidence.weakest_direction(), 1e-9);
}

// A slab sunk into a wall: its sides are not there, though the wall lies close to all of them.
TEST(WeakestDirection, AFaceInWhosePlaceAnotherSurfaceLiesHoldsNothing) {
  const model::PreparedModel slab = test::prepared(simulate::box({300, 300, 8}));
  const scan::Scan scan = test::seen({test::plate_at({2000, 2000, 10}, {0, 0, 805})}, 0.5);
  const ScanEvidence seen(scan, std::vector<std::uint8_t>(scan.cloud.size(), 0));
  const Pose model_from_scan(Eigen::Translation3d(-120, -90, -804));
  const PoseEvidence evidence = evidence_for(model_from_scan, slab.dense_samples, slab, seen, {5.0, 10.0});
  EXPECT_GT(evidence.score(), 0.99);
  EXPECT_LT(evidence.weakest_direction(), 1e-4);
}

TEST(WeakestDirection, IsFirmWhereThreeSidesShow) {
  const TriangleMesh mesh = simulate::box({100, 80, 60});
  const Pose pose = test::pose_at(kPlace, {0.7, 0.6, 0.2});
  const scan::Scan scan = test::seen({simulate::transformed(mesh, pose)});
  EXPECT_GT(judged(scan, pose, test::prepared(mesh, 0.04)).weakest_direction(), 0.005);
}

TEST(WeakestDirection, OfNothingIsZero) { EXPECT_EQ(PoseEvidence{}.weakest_direction(), 0.0); }

// Of all points and of those on flat places, by the two judges.
std::pair<double, double> agreements(const scan::Scan& scan, const Pose& model_from_scan) {
  const ScanEvidence evidence(scan, std::vector<std::uint8_t>(scan.cloud.size(), 0));
  const NormalOptions options{0.5, 0.5};
  return {normal_agreement(model_from_scan, scan, block(), options),
          flat_normal_agreement(model_from_scan, scan.cloud.positions, evidence, block(), options).value_or(-1.0)};
}

// A box of the same shape at 0.8 of the size lies deeper under the surface than any distance asked here.
TEST(ShareWithin, CountsThePointsInsideTheSolid) {
  const model::PreparedModel brick = test::prepared(simulate::box({100, 80, 60}));
  const std::vector<Eigen::Vector3f>& on_surface = brick.dense_samples.positions;
  const Pose place = test::pose_at(kPlace);
  const auto in_scan = [&](float scale) {
    std::vector<Eigen::Vector3f> points;
    for (const Eigen::Vector3f& p : on_surface) points.push_back((place * (scale * p).cast<double>()).cast<float>());
    return points;
  };
  std::vector<Eigen::Vector3f> points = in_scan(1.0F);
  EXPECT_EQ(share_within(place.inverse(), points, brick, 1.0), 0.0);
  for (const Eigen::Vector3f& p : in_scan(1.5F)) points.push_back(p);  // around it
  EXPECT_EQ(share_within(place.inverse(), points, brick, 1.0), 0.0);
  for (const Eigen::Vector3f& p : in_scan(0.8F)) points.push_back(p);
  EXPECT_NEAR(share_within(place.inverse(), points, brick, 1.0), 0.5, 1e-9);
}

// A brick before something, as seen without a viewpoint, and as claimed at two places: where it stands, and a thickness
// nearer to the sensor, so that its back lies where its front is and the sensor would have stood on the other side.
std::pair<double, double> seen_from_behind_at(const Eigen::Vector3d& size, const Eigen::Vector3d& place,
                                              const TriangleMesh& behind) {
  scan::Scan scan = test::seen({test::plate_at(size, place), behind}, 0.8, 0.004);
  scan.viewpoint = {};
  scan.normals_oriented = false;
  const ScanEvidence seen(scan, std::vector<std::uint8_t>(scan.cloud.size(), 0));
  const model::PreparedModel brick = test::prepared(simulate::box(size));
  const auto share_at = [&](const Eigen::Vector3d& claimed) {
    const Pose model_from_scan(Eigen::Translation3d(-claimed));
    return share_seen_from_behind(model_from_scan, scan.cloud.positions, brick, seen, {1.0, 2.5 * scan.spacing_mm});
  };
  return {share_at(place), share_at(place - Eigen::Vector3d(0, 0, size.z()))};
}

TEST(ShareSeenFromBehind, TellsTheFrontOfAFaceByWhatStandsBehindIt) {
  const TriangleMesh panel = test::plate_at({300, 200, 10}, {600, 0, 1000});
  const auto [right, from_behind] = seen_from_behind_at({200, 200, 60}, {600, 0, 850}, panel);
  EXPECT_LT(right, 0.01);
  // Of the front, 500 <= x <= 700, the panel hides what its shadow leaves: that begins behind the far edge of the side.
  // To parallel rays, that is; to a sensor close behind the panel, which falls between its points, less, but the panel
  // never loses its say.
  const double shadow_begins = 500.0 * 995.0 / 880.0;
  const double of_parallel_rays = (shadow_begins - 500.0) / 200.0;
  EXPECT_LT(from_behind, of_parallel_rays + 0.03);
  EXPECT_GT(from_behind, 0.3 * of_parallel_rays);
}

TEST(ShareSeenFromBehind, IsNoneIfTheSensorMayHaveStoodBeforeWhatIsBehind) {
  const auto [right, from_behind] =
      seen_from_behind_at({100, 100, 60}, {150, 0, 500}, test::wall());  // 3.4 diameters away
  EXPECT_LT(right, 0.01);
  EXPECT_EQ(from_behind, 0.0);
}

TEST(NormalAgreement, IsFullAtTheTruePoseAndNoneWhenFlipped) {
  const Pose pose = test::pose_at(kPlace);
  scan::Scan scan = test::seen({part_at(pose)});
  EXPECT_GT(agreements(scan, pose.inverse()).first, 0.95);
  EXPECT_GT(agreements(scan, pose.inverse()).second, 0.97);
  for (Eigen::Vector3f& normal : scan.cloud.normals) normal = -normal;
  EXPECT_LT(agreements(scan, pose.inverse()).first, 0.05);
  EXPECT_LT(agreements(scan, pose.inverse()).second, 0.03);
  scan.normals_oriented = false;  // then a sign means nothing
  EXPECT_GT(agreements(scan, pose.inverse()).first, 0.95);
  EXPECT_GT(agreements(scan, pose.inverse()).second, 0.97);
}

TEST(NormalAgreement, WithoutPointsOnTheModelIsZeroOrUnknown) {
  const scan::Scan scan = test::seen({part_at(test::pose_at(kPlace))});
  const auto [of_all, of_flat] = agreements(scan, test::pose_at({900, 0, 0}));
  EXPECT_EQ(of_all, 0.0);
  EXPECT_EQ(of_flat, -1.0);
}

}  // namespace
}  // namespace asbuilt::verify
