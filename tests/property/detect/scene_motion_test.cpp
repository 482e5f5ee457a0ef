// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <tuple>

#include "asbuilt/detect/detect.h"
#include "asbuilt/simulate/simulate.h"
#include "support/matchers.h"
#include "unit/detect/oriented_points.h"

namespace asbuilt::detect {
namespace {

struct Part {
  Context context{2};
  model::PreparedModel model = test::small_model(0.04);
  std::shared_ptr<const Codebook> book = build_codebook(model, {}, context).value();

  /// Largest displacement of a vertex between a pose and the truth, as a share of the diameter.
  [[nodiscard]] double error(const Pose& model_from_scan, const Pose& truth) const {
    const Pose between = model_from_scan * truth.inverse();
    double largest = 0.0;
    for (const Eigen::Vector3d& vertex : model.skin.vertices) {
      largest = std::max(largest, (between * vertex - vertex).norm());
    }
    return largest / model.diameter;
  }
};

const Part& part() {
  static const Part the_part;
  return the_part;
}

// Exactly the same samples, moved: every reference point says the same of the part's place.
TEST(LocalVotingProperty, MovesWithTheScene) {
  Random random(1, "motion", 0);
  Scene scene;
  for (std::size_t i = 0; i < part().model.samples.size(); i += 3) {
    scene.samples.positions.push_back(part().model.samples.positions[i] + test::random_vector(random, 0.5));
    scene.samples.normals.push_back(part().model.samples.normals[i]);
  }
  LocalVoting voting(*part().book, scene, {});
  std::vector<std::vector<Peak>> expected;
  for (std::uint32_t r = 0; r < scene.samples.size(); ++r) expected.push_back(voting.vote(r, 1.0F));
  const auto pose_of = [](const Peak& peak, const Scene& of, std::size_t r) {
    return model_from_scan_of(part().book->frames[peak.model_sample],
                              local_frame(of.samples.positions[r], of.samples.normals[r]),
                              static_cast<double>(peak.alpha));
  };
  for (int trial = 0; trial < 5; ++trial) {
    const Pose motion = test::random_pose(random);
    Scene moved = scene;
    for (std::size_t i = 0; i < scene.samples.size(); ++i) {
      const auto point = test::moved(motion, {scene.samples.positions[i], scene.samples.normals[i]});
      moved.samples.positions[i] = point.position;
      moved.samples.normals[i] = point.normal;
    }
    LocalVoting moved_voting(*part().book, moved, {});
    std::size_t same = 0, asked = 0;
    for (std::uint32_t r = 0; r < scene.samples.size(); ++r) {
      const auto peaks = moved_voting.vote(r, 1.0F);
      if (peaks.empty() || expected[r].empty()) continue;
      ++asked;
      // Alpha is counted from another direction, so its bins fall elsewhere: half a bin is 6 degrees.
      same += part().error(pose_of(peaks.front(), moved, r) * motion, pose_of(expected[r].front(), scene, r)) < 0.12;
    }
    ASSERT_GT(asked, scene.samples.size() / 2);
    EXPECT_GE(static_cast<double>(same), 0.85 * static_cast<double>(asked)) << "trial " << trial;
  }
}

TEST(FindHypotheses, FollowsAScanThatIsMoved) {
  Random random(2, "motion", 0);
  for (int trial = 0; trial < 2; ++trial) {
    const Pose scan_from_model = test::random_pose(random);
    const scan::Scan scan =
        test::scan_of(part().model.dense_samples, scan_from_model, part().model.sampling_distance / 3.0);
    const auto hypotheses = find_hypotheses(scan, *part().book, {}, part().context).value();
    ASSERT_FALSE(hypotheses.empty());
    EXPECT_LT(part().error(hypotheses.front().model_from_scan, scan_from_model.inverse()), 0.05) << "trial " << trial;
    EXPECT_TRUE(std::ranges::is_sorted(hypotheses, std::ranges::greater{}, &Hypothesis::votes));
    EXPECT_TRUE(is_rigid(hypotheses.front().model_from_scan.matrix(), 1e-9));
  }
}

TEST(FindHypotheses, NeedsNoSignOfTheNormals) {
  Random random(3, "motion", 0);
  const Pose scan_from_model = test::random_pose(random);
  scan::Scan scan = test::scan_of(part().model.dense_samples, scan_from_model, part().model.sampling_distance / 3.0);
  for (Eigen::Vector3f& normal : scan.cloud.normals)
    normal = random.uniform() < 0.5 ? normal : Eigen::Vector3f(-normal);
  scan.normals_oriented = false;
  const auto hypotheses = find_hypotheses(scan, *part().book, {}, part().context).value();
  const auto near_truth = [&](const Hypothesis& hypothesis) {
    return part().error(hypothesis.model_from_scan, scan_from_model.inverse()) < 0.1;
  };
  const auto first = std::ranges::find_if(hypotheses, near_truth);
  EXPECT_LT(first - hypotheses.begin(), 5);
}

simulate::Simulation cluttered_scans(int count) {
  simulate::SimulateOptions options;
  options.scans = count;
  options.points = 15000;
  options.clutter_objects = 4;
  options.clutter_low = 0.0;
  options.clutter_high = 1.0;
  options.as_built.dents = 0;
  options.as_built.warp_ratio = 0.0;
  options.seed = 5;
  return simulate::simulate(test::stepped_block(), options, Context(2)).value();
}

scan::Scan prepared(const simulate::SimulatedScan& simulated, const Context& context) {
  return scan::prepare_scan({simulated.points_in_scan, {}}, Eigen::Vector3d(0, 0, 0), {}, {}, context).value();
}

// How many scans have a hypothesis near the truth.
std::ptrdiff_t scans_with_the_truth(const simulate::Simulation& simulation, const DetectOptions& options) {
  const auto book = build_codebook(part().model, options, part().context).value();
  return std::ranges::count_if(simulation.scans, [&](const simulate::SimulatedScan& simulated) {
    const scan::Scan scan = prepared(simulated, part().context);
    const auto hypotheses = find_hypotheses(scan, *book, options, part().context).value();
    EXPECT_LE(hypotheses.size(), static_cast<std::size_t>(options.max_hypotheses));
    return std::ranges::any_of(hypotheses, [&](const Hypothesis& hypothesis) {
      return part().error(hypothesis.model_from_scan, *simulated.model_from_scan) < 0.1;
    });
  });
}

TEST(FindHypotheses, FindsThePartAmongClutter) {
  const simulate::Simulation simulation = cluttered_scans(2);
  EXPECT_EQ(scans_with_the_truth(simulation, {}), 2);
  // The published weights miss the part in the second scan, where a fifth is hidden (docs/detect.md).
  EXPECT_GE(scans_with_the_truth(simulation, DetectOptions{}.as_published()), 1);
}

TEST(FindHypotheses, GivesTheSameBytesForAnyNumberOfThreads) {
  const simulate::Simulation simulation = cluttered_scans(1);
  const auto run = [&](int threads) {
    const Context context(threads);
    const scan::Scan scan = prepared(simulation.scans.front(), context);
    return find_hypotheses(scan, *part().book, {}, context).value();
  };
  const auto expected = run(1);
  ASSERT_GT(expected.size(), 10U);
  for (const int threads : {2, 3}) {
    const auto hypotheses = run(threads);
    ASSERT_EQ(hypotheses.size(), expected.size());
    for (std::size_t i = 0; i < hypotheses.size(); ++i) {
      EXPECT_EQ(hypotheses[i].votes, expected[i].votes);
      EXPECT_EQ(hypotheses[i].model_from_scan.matrix(), expected[i].model_from_scan.matrix());
    }
  }
}

TEST(HypothesisSearch, GivesTheSameInStepsAsAtOnce) {
  const simulate::Simulation simulation = cluttered_scans(1);
  const scan::Scan scan = prepared(simulation.scans.front(), part().context);
  const SampledScan sampled = sampled_scan(scan, part().book->sampling_distance, part().book->diameter, part().context);
  HypothesisSearch at_once(scan, sampled, *part().book, {}), in_steps(scan, sampled, *part().book, {});
  ASSERT_TRUE(at_once.vote(300, part().context));
  for (const int wanted : {1, 40, 40, 199, 300}) ASSERT_TRUE(in_steps.vote(wanted, part().context));
  EXPECT_EQ(in_steps.votes_cast(), at_once.votes_cast());
  EXPECT_GT(at_once.votes_cast(), 0U);
  const auto expected = at_once.hypotheses(100, part().context), found = in_steps.hypotheses(100, part().context);
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i].votes, expected[i].votes);
    EXPECT_EQ(found[i].model_from_scan.matrix(), expected[i].model_from_scan.matrix());
  }
}

TEST(DetectionScene, LeavesTheFloorOutAndKeepsThePart) {
  const simulate::Simulation simulation = cluttered_scans(2);
  for (const simulate::SimulatedScan& simulated : simulation.scans) {
    const scan::Scan scan = prepared(simulated, part().context);
    std::map<std::tuple<float, float, float>, std::uint8_t> label_of;
    for (std::size_t i = 0; i < simulated.points_in_scan.size(); ++i) {
      const Eigen::Vector3f& p = simulated.points_in_scan[i];
      label_of[{p.x(), p.y(), p.z()}] = simulated.labels[i];
    }
    const auto count = [&](bool all, std::uint8_t label) {
      DetectOptions options;
      options.leave_out_planes = !all;
      const Scene scene = detection_scene(scan, *part().book, options, part().context);
      return std::ranges::count_if(scene.samples.positions, [&](const Eigen::Vector3f& p) {
        return label_of.at({p.x(), p.y(), p.z()}) == label;
      });
    };
    using simulate::Label;
    EXPECT_GE(count(false, Label::kPart), count(true, Label::kPart) * 95 / 100) << simulated.name;
    // What stays of the floor are small pieces between things, and where the part's foot meets it.
    EXPECT_LE(count(false, Label::kSurroundings), count(true, Label::kSurroundings) * 60 / 100) << simulated.name;
  }
}

TEST(FindHypotheses, FindsNothingOnAFloorAlone) {
  scan::Scan floor;
  for (int i = 0; i < 100; ++i) {
    for (int j = 0; j < 100; ++j) {
      floor.cloud.positions.emplace_back(4.0F * static_cast<float>(i), 4.0F * static_cast<float>(j), 500.0F);
    }
  }
  floor.cloud.normals.assign(floor.cloud.size(), Eigen::Vector3f(0, 0, -1));
  floor.surface_variation.assign(floor.cloud.size(), 0.0F);
  floor.normals_oriented = true;
  floor.spacing_mm = 4.0;
  EXPECT_TRUE(find_hypotheses(floor, *part().book, {}, part().context).value().empty());
}

TEST(FindHypotheses, RefusesBadOptionsAndStopsWhenAsked) {
  const scan::Scan scan = test::scan_of(part().model.dense_samples, Pose::Identity(), 2.0);
  DetectOptions options;
  options.alpha_bins = 0;
  EXPECT_THAT(find_hypotheses(scan, *part().book, options, part().context),
              test::FailsWith(ErrorCode::invalid_argument));
  std::stop_source source;
  source.request_stop();
  Context stopped(1);
  stopped.stop = source.get_token();
  EXPECT_THAT(find_hypotheses(scan, *part().book, {}, stopped), test::FailsWith(ErrorCode::cancelled));
}

}  // namespace
}  // namespace asbuilt::detect
