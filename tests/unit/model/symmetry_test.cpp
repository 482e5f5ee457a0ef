// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/symmetry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "asbuilt/core/random.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/model/symmetry_search.h"
#include "asbuilt/simulate/implicit_mesh.h"
#include "asbuilt/simulate/mesh_edit.h"
#include "support/matchers.h"
#include "support/parts.h"

namespace asbuilt::model {
namespace {

using Kind = SymmetryGroup::Kind;
constexpr double kPi = std::numbers::pi;

// In a place where no axis of the part is one of the frame.
const Pose kAskew = Eigen::Translation3d(40.0, -25.0, 110.0) *
                    Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -1).normalized()) * Pose::Identity();

PreparedModel prepared(const TriangleMesh& mesh) {
  return prepare(simulate::transformed(mesh, kAskew), {}, Context(2)).value();
}

SymmetryGroup group_of(const TriangleMesh& mesh) { return prepared(mesh).symmetry; }

// Turns about the part's own axes and centre, brought to where the part is.
Pose turn(const Eigen::Vector3d& axis, double angle, const Eigen::Vector3d& point = Eigen::Vector3d::Zero()) {
  return kAskew * rotation_about(axis, point, angle) * kAskew.inverse();
}

// Every expected motion is among the elements, and there are no others. A fine mesh is off by far less than this.
void expect_elements(const SymmetryGroup& group, const std::vector<Pose>& expected, double mm) {
  EXPECT_EQ(group.elements.size(), expected.size()) << group.describe();
  EXPECT_EQ(group.elements.front().matrix(), Eigen::Matrix4d::Identity());
  for (const Pose& motion : expected) {
    EXPECT_THAT(group.elements, testing::Contains(test::PoseNear(motion, mm, 0.3))) << group.describe();
  }
}

std::vector<Pose> cyclic(int order, const Eigen::Vector3d& axis) {
  std::vector<Pose> turns;
  for (int i = 0; i < order; ++i) turns.push_back(turn(axis, 2.0 * kPi * i / order));
  return turns;
}

std::vector<Pose> dihedral(int order, const Eigen::Vector3d& axis, const Eigen::Vector3d& across) {
  std::vector<Pose> turns = cyclic(order, axis);
  for (int i = 0; i < order; ++i) {
    turns.push_back(turn(rotation_from_axis_angle(kPi * i / order * axis) * across, kPi));
  }
  return turns;
}

const Eigen::Vector3d kX = Eigen::Vector3d::UnitX(), kY = Eigen::Vector3d::UnitY(), kZ = Eigen::Vector3d::UnitZ();

TEST(Symmetry, OfABoxIsFourRotations) {
  const SymmetryGroup group = group_of(simulate::box({100, 60, 40}));
  EXPECT_EQ(group.kind, Kind::discrete);
  EXPECT_EQ(group.order, 2);
  expect_elements(group, dihedral(2, kX, kY), 0.2);
}

TEST(Symmetry, OfASquarePlateIsEightRotations) {
  const SymmetryGroup group = group_of(simulate::box({100, 100, 20}));
  EXPECT_EQ(group.order, 4);
  expect_elements(group, dihedral(4, kZ, kX), 0.2);
}

TEST(Symmetry, OfACubeIsTwentyFourRotations) {
  const SymmetryGroup group = group_of(simulate::box({50, 50, 50}));
  EXPECT_EQ(group.kind, Kind::discrete);
  EXPECT_EQ(group.order, 4);
  std::vector<Pose> rotations;
  for (const Pose& about_z : cyclic(4, kZ)) {
    for (const Pose& side :
         {turn(kX, 0), turn(kX, kPi / 2), turn(kX, kPi), turn(kX, -kPi / 2), turn(kY, kPi / 2), turn(kY, -kPi / 2)}) {
      rotations.push_back(side * about_z);
    }
  }
  expect_elements(group, rotations, 0.2);
}

TEST(Symmetry, ElementsOfADiscreteGroupAreClosedUnderComposition) {
  const SymmetryGroup group = group_of(simulate::box({50, 50, 50}));
  for (const Pose& a : group.elements) {
    for (const Pose& b : group.elements) {
      EXPECT_THAT(group.elements, testing::Contains(test::PoseNear(Pose(a * b), 1e-6, 1e-6)));
    }
  }
}

TEST(Symmetry, OfACylinderIsAnyTurnAndEitherEnd) {
  const SymmetryGroup group = group_of(simulate::cylinder(30, 80));
  EXPECT_EQ(group.kind, Kind::revolution);
  EXPECT_GT(std::abs(group.axis.dot(kAskew.linear() * kZ)), 0.9999);
  EXPECT_LT((group.centre - kAskew * Eigen::Vector3d::Zero()).norm(), 0.2);
  EXPECT_EQ(group.elements.size(), 2U);
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-50, -50, 60), Eigen::Vector3d(120, 50, 160));
  for (const Pose& motion : {turn(kZ, 0.3), turn(kZ, 2.0), turn(kX, kPi), Pose(turn(kX, kPi) * turn(kZ, 1.2))}) {
    EXPECT_LT(displacement_modulo_mm(motion, group, box), 0.5);
  }
  EXPECT_GT(displacement_modulo_mm(turn(kX, kPi / 2), group, box), 20.0);
}

TEST(Symmetry, OfAConeIsAnyTurnButNotTheOtherEnd) {
  TriangleMesh cone = simulate::cylinder(40, 90, 64);
  for (Eigen::Vector3d& vertex : cone.vertices) {
    if (vertex.z() > 0.0) vertex.head<2>() *= 0.5;
  }
  const SymmetryGroup group = group_of(cone);
  EXPECT_EQ(group.kind, Kind::revolution);
  EXPECT_EQ(group.elements.size(), 1U);
  EXPECT_GT(std::abs(group.axis.dot(kAskew.linear() * kZ)), 0.9999);
}

TEST(Symmetry, OfASphereIsAnyRotation) {
  const SymmetryGroup group = group_of(simulate::sphere(40));
  EXPECT_EQ(group.kind, Kind::sphere);
  EXPECT_LT((group.centre - kAskew * Eigen::Vector3d::Zero()).norm(), 0.05);
}

TEST(Symmetry, OfGearsHasOneElementATooth) {
  for (const int teeth : {7, 40}) {
    const SymmetryGroup group = group_of(simulate::gear(50, 15, teeth));
    EXPECT_EQ(group.kind, Kind::discrete) << teeth;
    EXPECT_EQ(group.order, teeth);
    EXPECT_EQ(group.elements.size(), 2U * static_cast<std::size_t>(teeth)) << group.describe();
    EXPECT_GT(std::abs(group.axis.dot(kAskew.linear() * kZ)), 0.9999) << teeth;
  }
}

TEST(Symmetry, OfAFlangeIsThatOfItsBoltHoles) {
  const SymmetryGroup group = group_of(test::flange());
  EXPECT_EQ(group.order, 6);
  expect_elements(group, cyclic(6, kZ), 1.0);
}

TEST(Symmetry, OfAnIBeamIsFourRotations) {
  expect_elements(group_of(simulate::i_beam(60, 80, 8, 200)), dihedral(2, kZ, kX), 0.3);
}

TEST(Symmetry, OfUnequalLegsOrStepsOrOfACastingIsNone) {
  for (const TriangleMesh& mesh : {simulate::l_profile(60, 40, 8, 150), test::stepped_block(), test::casing()}) {
    const SymmetryGroup group = group_of(mesh);
    EXPECT_EQ(group.kind, Kind::none) << group.describe();
    EXPECT_EQ(group.describe(), "none");
    EXPECT_EQ(group.elements.size(), 1U);
  }
}

TEST(Symmetry, OfAnLProfileWithEqualLegsIsAHalfTurnAboutItsBisector) {
  const SymmetryGroup group = group_of(simulate::l_profile(60, 60, 8, 150));
  EXPECT_EQ(group.order, 2);
  EXPECT_EQ(group.elements.size(), 2U);
  const Eigen::Vector3d bisector = kAskew.linear() * Eigen::Vector3d(1, 1, 0).normalized();
  EXPECT_GT(std::abs(group.axis.dot(bisector)), 0.9999);
}

TEST(Symmetry, OfANotchedPlateIsThatOfItsNotches) {
  expect_elements(group_of(test::notched_plate(12.0)), dihedral(4, kZ, kX), 0.3);
  const SymmetryGroup odd = group_of(test::notched_plate(26.0));
  expect_elements(odd, cyclic(2, kX), 0.3);
  EXPECT_THAT(odd.near,
              testing::Contains(testing::Field(&NearSymmetry::motion, test::PoseNear(turn(kZ, kPi), 1.5, 1.0))));
}

TEST(Symmetry, ThatOneHoleBreaksIsANearSymmetry) {
  for (const double odd_radius : {0.0, 20.0}) {
    const PreparedModel model = prepared(test::flange_with_odd_hole(odd_radius));
    const SymmetryGroup& group = model.symmetry;
    EXPECT_EQ(group.kind, Kind::none) << odd_radius << ": " << group.describe();
    for (int i = 1; i < 6; ++i) {
      const Pose expected = turn(kZ, kPi * i / 3.0);
      const auto found = std::ranges::find_if(group.near, [&](const NearSymmetry& near) {
        return largest_displacement_mm(near.motion * expected.inverse(), model.box) < 0.01 * model.diameter;
      });
      ASSERT_NE(found, group.near.end()) << odd_radius << ": " << group.describe_near();
      EXPECT_GT(found->share, 0.9);
      EXPECT_LT(found->share, 1.0);
    }
  }
  EXPECT_EQ(group_of(test::flange_with_odd_hole(14.0)).order, 6) << "the same plate with six equal holes";
}

TEST(Symmetry, ThatASlotBreaksLeavesAHalfTurnAndANearAxis) {
  const simulate::Solid screw = [](const Eigen::Vector3d& p) {
    const double head = std::max({p.head<2>().norm() - 25.0, -p.z(), p.z() - 16.0});
    const double shaft = std::max({p.head<2>().norm() - 12.0, -60.0 - p.z(), p.z()});
    const double slot = std::max(std::abs(p.x()) - 3.0, 9.0 - p.z());
    return std::max(std::min(head, shaft), -slot);
  };
  const SymmetryGroup group =
      group_of(simulate::surface_of(screw, {Eigen::Vector3d(-25, -25, -60), Eigen::Vector3d(25, 25, 16)}, 1.5));
  EXPECT_EQ(group.kind, Kind::discrete);
  expect_elements(group, cyclic(2, kZ), 0.5);
  ASSERT_EQ(group.near_axes.size(), 1U) << group.describe_near();
  EXPECT_GT(std::abs(group.near_axes[0].axis.dot(kAskew.linear() * kZ)), 0.999);
  EXPECT_GT(group.near_axes[0].share, 0.8);
}

TEST(Symmetry, IsTheSameForAnyNumberOfThreads) {
  const PreparedModel model = prepared(test::flange_with_odd_hole(20.0));
  const SymmetryGroup expected = find_symmetry(model, Context(1));
  for (const int threads : {2, 5}) {
    const SymmetryGroup group = find_symmetry(model, Context(threads));
    ASSERT_EQ(group.near.size(), expected.near.size());
    for (std::size_t i = 0; i < group.near.size(); ++i) {
      EXPECT_EQ(group.near[i].motion.matrix(), expected.near[i].motion.matrix());
      EXPECT_EQ(group.near[i].share, expected.near[i].share);
    }
    EXPECT_EQ(group.describe(), expected.describe());
  }
}

Pose random_pose(Random& random) {
  Eigen::Vector3d axis_angle;
  for (int i = 0; i < 3; ++i) axis_angle[i] = random.uniform(-2.0, 2.0);
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_axis_angle(axis_angle);
  for (int i = 0; i < 3; ++i) pose.translation()[i] = random.uniform(-300.0, 300.0);
  return pose;
}

std::vector<SymmetryGroup> known_groups() {
  SymmetryGroup four_fold, cylinder, sphere;
  four_fold.kind = Kind::discrete;
  four_fold.order = 4;
  four_fold.centre = {5, 6, 7};
  four_fold.elements.clear();
  for (int i = 0; i < 4; ++i) four_fold.elements.push_back(rotation_about(kZ, four_fold.centre, kPi / 2 * i));
  cylinder.kind = Kind::revolution;
  cylinder.axis = Eigen::Vector3d(1, 2, 2) / 3.0;
  cylinder.centre = {5, 6, 7};
  cylinder.elements.push_back(rotation_about(cylinder.axis.unitOrthogonal(), cylinder.centre, kPi));
  sphere.kind = Kind::sphere;
  sphere.centre = {5, 6, 7};
  return {four_fold, cylinder, sphere};
}

// An element drawn from each of the groups above.
Pose random_element(const SymmetryGroup& group, Random& random) {
  if (group.kind == Kind::sphere) {
    Pose element = random_pose(random);
    element.translation() = group.centre - element.linear() * group.centre;
    return element;
  }
  const Pose element = group.elements[random.below(group.elements.size())];
  if (group.kind == Kind::discrete) return element;
  return rotation_about(group.axis, group.centre, random.uniform(-3.0, 3.0)) * element;
}

TEST(SymmetryGroup, MakesPosesThatDifferByAnElementOne) {
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-40, -30, -20), Eigen::Vector3d(50, 42, 34));
  Random random(1, "symmetry", 0);
  for (const SymmetryGroup& group : known_groups()) {
    for (int i = 0; i < 50; ++i) {
      const Pose element = random_element(group, random), pose = random_pose(random);
      EXPECT_LT(displacement_modulo_mm(element, group, box), 1e-9) << group.describe();
      EXPECT_THAT(group.canonical(element * pose), test::PoseNear(group.canonical(pose), 1e-6, 1e-6))
          << group.describe();
      EXPECT_LT(displacement_modulo_mm(group.canonical(pose) * pose.inverse(), group, box), 1e-9);
    }
  }
}

TEST(SymmetryGroup, DisplacesByNoMoreThanAnyOfItsElementsLeaves) {
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-40, -30, -20), Eigen::Vector3d(50, 42, 34));
  Random random(2, "symmetry", 0);
  for (const SymmetryGroup& group : known_groups()) {
    for (int i = 0; i < 20; ++i) {
      const Pose motion = random_pose(random);
      const double least = displacement_modulo_mm(motion, group, box);
      for (int k = 0; k < 50; ++k) {
        // Least squares over the corners is not quite the least maximum.
        EXPECT_GT(1.2 * largest_displacement_mm(random_element(group, random).inverse() * motion, box), least);
      }
    }
  }
}

TEST(SymmetryGroup, CanonicalPoseTurnsNoMoreThanAnyOther) {
  Random random(3, "symmetry", 0);
  for (const SymmetryGroup& group : known_groups()) {
    for (int i = 0; i < 20; ++i) {
      const Pose pose = random_pose(random);
      const double least = rotation_angle(group.canonical(pose).linear());
      for (int k = 0; k < 30; ++k) {
        EXPECT_GE(rotation_angle((random_element(group, random) * pose).linear()), least - 1e-6);
      }
    }
  }
}

TEST(SymmetryGroup, SaysInWordsWhatItIs) {
  SymmetryGroup group;
  EXPECT_EQ(group.describe(), "none");
  EXPECT_EQ(group.describe_near(), "");
  for (const SymmetryGroup& known : known_groups()) EXPECT_NE(known.describe(), "none");
  EXPECT_EQ(known_groups()[0].describe(), "4-fold about (0, 0, 1)");
  EXPECT_EQ(known_groups()[1].describe(), "any rotation about (0.33, 0.67, 0.67), and turned end for end");
}

}  // namespace
}  // namespace asbuilt::model
