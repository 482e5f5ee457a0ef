// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "asbuilt/refine/symmetry_choice.h"
#include "asbuilt/refine/view_difference.h"
#include "property/refine/bumpy_body.h"

namespace asbuilt::refine {
namespace {

using Radius = std::function<double(const Eigen::Vector3d&)>;  // over the direction, mm

constexpr double kSigma = 0.05, kDiameter = 110.0;  // mm

// Four lobes about z, another shape above than below: turns by 90 degrees about z map it onto itself, nothing else
// does.
double lobed(const Eigen::Vector3d& d) {
  const double across = d.x() * d.x() + d.y() * d.y();
  const double four = std::cos(4.0 * std::atan2(d.y(), d.x())) * across * across;
  return 50.0 * (1.0 + 0.12 * four + 0.1 * d.z());
}

// A round dent around a direction, with soft edges.
double dent(const Eigen::Vector3d& d, const Eigen::Vector3d& at, double depth, double width) {
  const double angle = std::acos(std::clamp(d.dot(at.normalized()), -1.0, 1.0));
  return -depth * std::exp(-angle * angle / (width * width));
}

// A view from `sensor` on the body, with noise along the line of sight and rough normals (the refinement fits its own).
View view_of(const Radius& radius, const Eigen::Vector3d& sensor, std::uint64_t seed, const Pose& model_from_scan) {
  Random random(seed, "view of a body", 0);
  View view;
  view.noise_sigma_mm = kSigma;
  view.model_from_scan = model_from_scan;
  const Pose scan_from_model = model_from_scan.inverse(Eigen::Isometry);
  // An even spiral over the sphere, turned for each view: scans are even, drawn points have holes.
  const Eigen::Matrix3d turned = test::random_pose(random, 3.0, 0.0).linear();
  constexpr int kDirections = 20000;
  for (int k = 0; k < kDirections; ++k) {
    const double z = 1.0 - (2.0 * k + 1.0) / kDirections, turn = k * std::numbers::pi * (3.0 - std::sqrt(5.0));
    const double across = std::sqrt(1.0 - z * z);
    const Eigen::Vector3d d = turned * Eigen::Vector3d(across * std::cos(turn), across * std::sin(turn), z);
    const double step = 1e-4;
    Eigen::Vector3d normal;
    for (int i = 0; i < 3; ++i) {
      const auto level = [&](double by) {
        const Eigen::Vector3d x = radius(d) * d + by * Eigen::Vector3d::Unit(i);
        return x.norm() - radius(x.normalized());
      };
      normal[i] = level(step) - level(-step);
    }
    normal.normalize();
    if (normal.dot(sensor) < 0.25) continue;
    const Eigen::Vector3d point = radius(d) * d + kSigma * random.normal() * sensor;
    view.segment_in_scan.positions.push_back((scan_from_model * point).cast<float>());
    view.segment_in_scan.normals.push_back((scan_from_model.linear() * normal).cast<float>());
  }
  return view;
}

Eigen::Vector3d from_above(int number, int count) {
  const double turn = 2.0 * std::numbers::pi * number / count;
  return Eigen::Vector3d(std::cos(turn), std::sin(turn), 1.2).normalized();
}

std::vector<Pose> poses_of(const std::vector<View>& views) {
  std::vector<Pose> poses;
  for (const View& view : views) poses.push_back(view.model_from_scan);
  return poses;
}

std::vector<Link> all_pairs(int views) {
  std::vector<Link> links;
  for (int a = 0; a < views; ++a) {
    for (int b = a + 1; b < views; ++b) links.push_back({a, b});
  }
  return links;
}

std::optional<Individuals> individuals_among(const std::vector<View>& views) {
  const Context context(2);
  const ComparedViews compared(views, kDiameter, context);
  return two_individuals(compared, poses_of(views), all_pairs(static_cast<int>(views.size())), context).value();
}

// Two castings whose dents, 1 % of the diameter deep, lie elsewhere.
double first_casting(const Eigen::Vector3d& d) {
  return lobed(d) + dent(d, {1.0, 0.3, 1.0}, 1.1, 0.35) + dent(d, {-1.0, -0.6, 0.8}, 1.1, 0.3);
}
double second_casting(const Eigen::Vector3d& d) {
  return lobed(d) + dent(d, {-0.2, 1.0, 1.0}, 1.1, 0.35) + dent(d, {0.1, -0.4, 1.0}, 1.1, 0.3);
}

TEST(TwoIndividuals, AreToldApart) {
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    std::vector<View> views;
    for (int v = 0; v < 7; ++v) {
      // The second casting is in views 1, 4 and 6; every pose is up to half a sigma off.
      const bool is_second = v == 1 || v == 4 || v == 6;
      Random random(seed, "pose", static_cast<std::uint64_t>(v));
      views.push_back(view_of(is_second ? second_casting : first_casting, from_above(v, 7),
                              10 * seed + static_cast<std::uint64_t>(v), test::random_pose(random, 3.0, 200.0)));
      Vector6d off;
      off << test::random_direction(random) * 2e-4, test::random_direction(random) * 0.02;
      views.back().model_from_scan = pose_from_twist(off) * views.back().model_from_scan;
    }
    const auto found = individuals_among(views);
    ASSERT_TRUE(found.has_value()) << "seed " << seed;
    EXPECT_THAT(found->first, testing::ElementsAre(0, 2, 3, 5));
    EXPECT_THAT(found->second, testing::ElementsAre(1, 4, 6));
    EXPECT_GT(found->height_mm, 3.0 * kSigma);
    EXPECT_LT(found->height_mm, 1.1);  // no deeper than the dents
    EXPECT_LT(found->share_within, 0.02);
  }
}

TEST(TwoIndividuals, AreNotSeenInOne) {
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    std::vector<View> views;
    for (int v = 0; v < 7; ++v) {
      Random random(seed, "pose", static_cast<std::uint64_t>(v));
      views.push_back(view_of(first_casting, from_above(v, 7), 10 * seed + static_cast<std::uint64_t>(v),
                              test::random_pose(random, 3.0, 200.0)));
      Vector6d off;  // a refinement that ended one sigma off
      off << test::random_direction(random) * 4e-4, test::random_direction(random) * 0.04;
      views.back().model_from_scan = pose_from_twist(off) * views.back().model_from_scan;
    }
    EXPECT_FALSE(individuals_among(views).has_value()) << "seed " << seed;
  }
}

TEST(TwoIndividuals, NeedTwoViewsEach) {
  std::vector<View> views;
  for (int v = 0; v < 5; ++v) {
    views.push_back(view_of(v == 2 ? second_casting : first_casting, from_above(v, 5), static_cast<std::uint64_t>(v),
                            Pose::Identity()));
  }
  EXPECT_FALSE(individuals_among(views).has_value());
}

std::vector<Pose> quarter_turns() {
  std::vector<Pose> elements;
  for (int i = 0; i < 4; ++i) {
    elements.emplace_back(Eigen::AngleAxisd(0.5 * std::numbers::pi * i, Eigen::Vector3d::UnitZ()));
  }
  return elements;
}

struct Chosen {
  SymmetryChoice choice;
  std::vector<int> turns;  // after the choice, the quarter turn by which each view is off
};

// Each view's true pose, turned by turns[v] quarters, as detection would give it.
Chosen chosen(const Radius& radius, const std::vector<int>& turns) {
  const std::vector<Pose> elements = quarter_turns();
  const Context context(2);
  std::vector<View> views;
  for (std::size_t v = 0; v < turns.size(); ++v) {
    const auto number = static_cast<int>(v), count = static_cast<int>(turns.size());
    views.push_back(view_of(radius, from_above(number, count), v, Pose::Identity()));
    views.back().model_from_scan = elements[static_cast<std::size_t>(turns[v])];
  }
  const ComparedViews compared(views, kDiameter, context);
  Chosen result{choose_elements(compared, poses_of(views), {}, elements, context).value(), {}};
  for (std::size_t v = 0; v < turns.size(); ++v) result.turns.push_back((turns[v] + result.choice.element[v]) % 4);
  return result;
}

TEST(ChooseElements, PutsEachViewWhereADentSaysItBelongs) {
  // On top, where all views see it, off the axis.
  const auto dented = [](const Eigen::Vector3d& d) { return lobed(d) + dent(d, {0.5, 0.2, 1.0}, 1.1, 0.25); };
  for (const std::vector<int>& turns : {std::vector<int>{0, 1, 3, 2, 0}, {2, 2, 1, 0, 3}, {0, 0, 0, 0, 0}}) {
    const Chosen result = chosen(dented, turns);
    EXPECT_THAT(result.choice.decided, testing::Each(1));
    EXPECT_THAT(result.turns, testing::Each(result.turns.front()));
    EXPECT_EQ(result.choice.element[static_cast<std::size_t>(result.choice.reference)], 0);
  }
}

TEST(ChooseElements, DecidesNothingWhereNothingBreaksTheSymmetry) {
  const Chosen result = chosen(lobed, {0, 1, 3, 2});
  EXPECT_EQ(std::ranges::count(result.choice.decided, 1), 1);  // the reference itself
}

}  // namespace
}  // namespace asbuilt::refine
