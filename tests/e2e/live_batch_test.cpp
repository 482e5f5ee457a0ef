// SPDX-License-Identifier: Apache-2.0
// Incremental against batch: what a session shows once it is idle, against `reconstruct` on the same files, for scans
// that came in another order. ASBUILT_LIVE_SCANS: scans of each part (4; bench/live/run takes 10).
#include <gmock/gmock.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <set>
#include <utility>

#include "asbuilt/live/session.h"
#include "asbuilt/simulate/parts.h"
#include "live_scenes.h"

namespace asbuilt::live {
namespace {

struct Part {
  const char* name;
  TriangleMesh (*mesh)();
  std::uint64_t seed;
};

class IncrementalAgainstBatch : public test::LiveScenes, public testing::WithParamInterface<Part> {
 protected:
  /// RMS over the part's vertices of how far two poses put them apart, in sigma; larger than after any common motion.
  [[nodiscard]] static double apart(const Pose& a, const Pose& b, const TriangleMesh& part, double sigma_mm) {
    const Pose scan_from_model = b.inverse();
    double sum = 0.0;
    for (const Eigen::Vector3d& vertex : part.vertices) sum += (a * (scan_from_model * vertex) - vertex).squaredNorm();
    return std::sqrt(sum / static_cast<double>(part.vertices.size())) / sigma_mm;
  }

  /// The worst of all scans that both have a pose for.
  [[nodiscard]] static double worst_apart(const LiveState& state, const io::RunRecord& batch,
                                          const TriangleMesh& part) {
    double worst = 0.0;
    for (std::size_t i = 0; i < batch.scans.size(); ++i) {
      const auto& shown = state.scans[i].record.model_from_scan;
      if (!shown || !batch.scans[i].model_from_scan) continue;
      worst = std::max(worst, apart(*shown, *batch.scans[i].model_from_scan, part, batch.scans[i].noise_sigma));
    }
    return worst;
  }
};

TEST_P(IncrementalAgainstBatch, HasTheSameScansAndEdgesAndPosesWithinATwentiethOfSigma) {
  const Part& parameter = GetParam();
  const char* wanted = std::getenv("ASBUILT_LIVE_SCANS");
  const int scans = wanted != nullptr ? std::atoi(wanted) : 4;
  const TriangleMesh part = parameter.mesh();
  simulate_scenes(scans, parameter.seed, 0.1, 20000, part);
  std::ranges::shuffle(names_, std::mt19937(static_cast<unsigned>(parameter.seed)));

  auto session = LiveSession::open(model(), {}, output(), false, Context(2)).value();
  for (std::size_t i = 0; i < names_.size(); ++i) {
    ASSERT_TRUE(session->add(put(names_[i])).has_value());
    if (i + 1 != names_.size() / 2) continue;
    ASSERT_TRUE(session->refine_jointly({}).value());  // somebody paused for a while
  }
  const auto before = session->state();
  ASSERT_TRUE(session->refine_jointly({}).value());
  const auto state = session->state();
  const io::RunRecord batch = reconstruct(base_ / "reference");

  ASSERT_EQ(state->scans.size(), batch.scans.size());
  int accepted = 0;
  for (std::size_t i = 0; i < batch.scans.size(); ++i) {
    const io::ScanRecord& shown = state->scans[i].record;
    EXPECT_EQ(shown.name, batch.scans[i].name);
    EXPECT_EQ(shown.status, batch.scans[i].status) << shown.name;
    EXPECT_EQ(shown.model_from_scan.has_value(), batch.scans[i].model_from_scan.has_value()) << shown.name;
    accepted += batch.scans[i].status == io::ScanStatus::accepted ? 1 : 0;
  }
  std::set<std::pair<int, int>> shown_edges, batch_edges;
  for (const LinkState& link : state->links) {
    if (link.used) shown_edges.insert({link.a, link.b});
  }
  for (const io::OverlapRecord& overlap : batch.graph->overlaps) {
    if (overlap.linked) batch_edges.insert({std::min(overlap.a, overlap.b), std::max(overlap.a, overlap.b)});
  }
  EXPECT_EQ(shown_edges, batch_edges);
  EXPECT_GE(accepted, 2) << "else nothing is compared";
  EXPECT_FALSE(batch_edges.empty()) << "else nothing is compared";
  const double idle = worst_apart(*state, batch, part);
  EXPECT_LE(idle, 0.05);
  EXPECT_GT(state->covered_share, 0.1);
  std::printf(
      "%-14s %d of %d scans accepted, %zu edges; poses apart from the batch run's, the worst scan: %.4f sigma "
      "when idle, %.2f sigma before\n",
      parameter.name, accepted, scans, batch_edges.size(), idle, worst_apart(*before, batch, part));
}

INSTANTIATE_TEST_SUITE_P(Parts, IncrementalAgainstBatch,
                         testing::Values(Part{"valve body", test::casing, 61},
                                         Part{"stepped block", test::stepped_block, 62},
                                         Part{"gear", [] { return simulate::gear(60.0, 20.0, 12); }, 63}),
                         [](const auto& part) {
                           std::string name = part.param.name;
                           std::ranges::replace(name, ' ', '_');
                           return name;
                         });

}  // namespace
}  // namespace asbuilt::live
