// SPDX-License-Identifier: Apache-2.0
// Symmetric parts are known modulo their symmetry; those that a detail keeps from it are known, or not said to be.
#include <gtest/gtest.h>

#include "asbuilt/detect/detect.h"
#include "asbuilt/simulate/simulate.h"
#include "asbuilt/verify/verdict.h"
#include "asbuilt/verify/verify.h"
#include "unit/verify/seen.h"

namespace asbuilt::verify {
namespace {

struct Tally {
  int scans = 0, right = 0, wrong = 0;
};

Tally judged(const TriangleMesh& mesh, unsigned seed) {
  const Context context(2);
  const model::PreparedModel model = test::prepared(mesh);
  const auto book = detect::build_codebook(model, {}, context).value();
  simulate::SimulateOptions options;
  options.scans = 4;
  options.points = 30000;
  options.clutter_objects = 4;
  options.clutter_low = 0.0;
  options.clutter_high = 1.0;
  options.hidden_high = 0.3;
  options.seed = seed;
  Tally tally;
  const simulate::Simulation simulation = simulate::simulate(mesh, options, context).value();
  for (const auto& simulated : simulation.scans) {
    const scan::Scan scan = scan::prepare_scan({simulated.points_in_scan, {}}, std::nullopt, {}, {}, context).value();
    const auto hypotheses = detect::find_hypotheses(scan, *book, {}, context).value();
    const Detection detection = verify(scan, model, hypotheses, {}, context).value();
    ++tally.scans;
    if (detection.status != Status::accepted) continue;
    const double off = displacement_modulo_mm(*simulated.model_from_scan, detection.best.model_from_scan, model);
    ++(off <= 0.02 * model.diameter ? tally.right : tally.wrong);
  }
  return tally;
}

TEST(SymmetricParts, AreAcceptedAndRightModuloTheirGroup) {
  for (const TriangleMesh& mesh : {test::flange(), simulate::gear(50, 15, 12)}) {
    const Tally tally = judged(mesh, 31);
    EXPECT_EQ(tally.wrong, 0);
    EXPECT_GE(tally.right, tally.scans - 1);
  }
}

TEST(NearlySymmetricParts, AreRightWhereverTheyAreAccepted) {
  for (const double odd_radius : {0.0, 20.0}) {
    const Tally tally = judged(test::flange_with_odd_hole(odd_radius), 32);
    EXPECT_EQ(tally.wrong, 0) << odd_radius;
    EXPECT_GE(tally.right, tally.scans / 2) << odd_radius;
  }
}

}  // namespace
}  // namespace asbuilt::verify
