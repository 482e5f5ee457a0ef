// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/find_part.h"

#include <gtest/gtest.h>

#include "asbuilt/scan/scan.h"
#include "asbuilt/simulate/simulate.h"
#include "asbuilt/verify/verdict.h"
#include "unit/detect/oriented_points.h"

namespace asbuilt::pipeline {
namespace {

using verify::Status;

// A block among other things, and what it takes to look for it.
struct Scene {
  Scene() {
    simulate::SimulateOptions options;
    options.scans = 1;
    options.points = 30000;
    options.clutter_objects = 8;
    options.clutter_low = 0.85;
    options.clutter_high = 0.95;
    options.seed = 7;
    const simulate::Simulation simulation = simulate::simulate(test::stepped_block(), options, context).value();
    const simulate::SimulatedScan& simulated = simulation.scans.front();
    model_from_scan = *simulated.model_from_scan;
    scan = scan::prepare_scan({simulated.points_in_scan, {}}, Eigen::Vector3d(0, 0, 0), {}, {}, context).value();
  }
  [[nodiscard]] FoundPart found(const Options& options) const {
    const TimedStage untimed = [](std::string_view, const std::function<void()>& work) { work(); };
    return find_part(scan, model, *book, {}, options, untimed, context).value();
  }
  [[nodiscard]] bool is_right(const FoundPart& part) const {
    const verify::Detection& detection = part.placements.front();
    return detection.status == Status::accepted &&
           verify::displacement_modulo_mm(detection.best.model_from_scan, model_from_scan, model) <
               0.02 * model.diameter;
  }

  Context context{2};
  model::PreparedModel model = test::small_model(0.04);
  std::shared_ptr<const detect::Codebook> book = detect::build_codebook(model, {}, context).value();
  Pose model_from_scan = Pose::Identity();
  scan::Scan scan;
};

const Scene& scene() {
  static const Scene the_scene;
  return the_scene;
}

TEST(FindPart, FindsThePart) { EXPECT_TRUE(scene().is_right(scene().found({}))); }

// One reference point need not lie on the part, and proposes little: what the first looks lack the last one has.
TEST(FindPart, LooksOnceMoreWhereItFoundNothing) {
  Options few;
  few.detect.first_reference_points = 0;
  few.detect.reference_points = 1;
  few.detect.max_hypotheses = 1;
  few.detect.last_reference_points = 0;
  const FoundPart without = scene().found(few);
  ASSERT_EQ(without.placements.front().status, Status::rejected);
  EXPECT_EQ(without.looks, 1);

  few.detect.last_reference_points = 2000;
  const FoundPart with = scene().found(few);
  EXPECT_TRUE(scene().is_right(with));
  EXPECT_EQ(with.looks, 2);
  EXPECT_GT(with.votes_cast, without.votes_cast);

  few.detect.most_million_votes = 1e-6;  // the first look has cast more
  EXPECT_EQ(scene().found(few).looks, 1);
}

TEST(FindPart, InPaperModeLooksOnce) {
  Options options;
  options.detect = options.detect.as_published();
  EXPECT_EQ(scene().found(options).looks, 1);
}

TEST(HypothesisSearch, EndsWithTheStepInWhichTheVotesAreSpent) {
  const detect::SampledScan sampled =
      detect::sampled_scan(scene().scan, scene().book->sampling_distance, scene().book->diameter, scene().context);
  detect::HypothesisSearch spent(scene().scan, sampled, *scene().book, {}), five_hundred = spent;
  ASSERT_GT(spent.most_reference_points(), 500U);
  ASSERT_TRUE(spent.vote(1000000, scene().context, 1.0));
  ASSERT_TRUE(five_hundred.vote(500, scene().context));
  EXPECT_EQ(spent.votes_cast(), five_hundred.votes_cast());
}

}  // namespace
}  // namespace asbuilt::pipeline
