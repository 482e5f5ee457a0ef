// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/live/next_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "asbuilt/core/random.h"
#include "asbuilt/simulate/parts.h"
#include "support/parts.h"

namespace asbuilt::live {
namespace {

model::PreparedModel prepared(const TriangleMesh& mesh) { return model::prepare(mesh, {}, Context(2)).value(); }

// ---- Advice against random views, by rays of its own ----

/// What a sensor really sees, told by a grid of rays at the model, first hits only: nothing of the planner in it.
PointCloud measured(const SensorView& view, const SensorLimits& limits, const model::PreparedModel& model) {
  constexpr int kAcross = 70;
  const Eigen::Vector3d forward = view.direction();
  const Eigen::Vector3d right = forward.unitOrthogonal(), up = forward.cross(right);
  const double half = std::tan(limits.half_angle_deg * 3.14159265358979 / 180.0);
  PointCloud points;
  for (int i = 0; i < kAcross; ++i) {
    for (int j = 0; j < kAcross; ++j) {
      const double x = half * (2.0 * (i + 0.5) / kAcross - 1.0), y = half * (2.0 * (j + 0.5) / kAcross - 1.0);
      if (std::hypot(x, y) > half) continue;
      const Eigen::Vector3d ray = (forward + x * right + y * up).normalized();
      const auto hit = model.rays->first_hit(view.position, ray, limits.near_mm, limits.far_mm);
      if (!hit.found()) continue;
      const Eigen::Vector3f normal = model.face_normals[hit.triangle];
      if (-ray.dot(normal.cast<double>()) < 0.35) continue;  // grazing rays bring nothing back
      points.positions.push_back((view.position + hit.distance * ray).cast<float>());
      points.normals.push_back(normal);
    }
  }
  return points;
}

std::vector<char> scanned(const SensorView& view, const SensorLimits& limits, const Surface& surface,
                          const model::PreparedModel& model) {
  const PointCloud points = measured(view, limits, model);
  const auto seen = seen_from(points, Pose::Identity(), 0.0, surface, model, Context(2));
  std::vector<char> covered(seen.size());
  for (std::size_t v = 0; v < seen.size(); ++v) covered[v] = !std::isnan(seen[v]);
  return covered;
}

struct Session {
  const Surface& surface;
  std::vector<char> seen;
  double coverable;

  double add(const std::vector<char>& more) {
    for (std::size_t v = 0; v < seen.size(); ++v) seen[v] = seen[v] || more[v];
    return area_share(surface, [&](std::size_t v) { return seen[v] != 0; }) / coverable;
  }
};

TEST(NextBestView, TakesAtLeastThirtyPercentFewerScansThanRandomViews) {
  const std::vector<std::pair<const char*, TriangleMesh>> parts{{"valve body", test::casing()},
                                                                {"stepped block", test::stepped_block()},
                                                                {"flange", test::flange()},
                                                                {"elbow", simulate::pipe_elbow(80.0, 25.0, 4.0)},
                                                                {"gear", simulate::gear(60.0, 20.0, 12)}};
  constexpr double kWanted = 0.95;
  constexpr int kMost = 80, kTrials = 3;
  for (const auto& [name, mesh] : parts) {
    const auto model = prepared(mesh);
    const Surface surface = surface_of(model);
    const SensorLimits limits = assumed_limits(model.diameter);
    const ViewPlanner planner(surface, model, limits, Context(2));
    // What can be covered at all: everything that any of the positions brings.
    Session all{surface, std::vector<char>(surface.mesh.vertices.size(), 0), 1.0};
    double coverable = 0.0;
    for (std::size_t c = 0; c < planner.candidates().size(); c += 2) {
      coverable = all.add(scanned(planner.candidates()[c], limits, surface, model));
    }

    Session advised{surface, std::vector<char>(surface.mesh.vertices.size(), 0), coverable};
    int with_advice = 0;
    for (double reached = 0.0; reached < kWanted && with_advice < kMost; ++with_advice) {
      const auto views = with_advice == 0 ? planner.best_views({}) : planner.best_views({advised.seen});
      if (views.empty()) break;
      reached = advised.add(scanned(views[0].view, limits, surface, model));
    }
    EXPECT_GE(advised.add(std::vector<char>(surface.mesh.vertices.size(), 0)), kWanted) << name;

    double at_random = 0.0;
    for (int trial = 0; trial < kTrials; ++trial) {
      Random random(static_cast<std::uint64_t>(trial), "random views", 0);
      Session session{surface, std::vector<char>(surface.mesh.vertices.size(), 0), coverable};
      int count = 0;
      for (double reached = 0.0; reached < kWanted && count < kMost; ++count) {
        const Eigen::Vector3d direction =
            Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
        const Eigen::Vector3d target = model.box.center();
        reached = session.add(scanned({target + limits.distance_mm * direction, target}, limits, surface, model));
      }
      at_random += static_cast<double>(count) / kTrials;
    }
    EXPECT_LE(with_advice, 0.7 * at_random)
        << name << ": " << with_advice << " scans with advice, " << at_random << " at random";
    RecordProperty(std::string(name), std::to_string(with_advice) + " / " + std::to_string(at_random));
    std::printf("%-14s %2d scans with advice, %.1f at random, coverable %.1f %%\n", name, with_advice, at_random,
                100.0 * coverable);
    std::fflush(stdout);
  }
}

// The sensor is known from its scans alone, as in a session. What is then promised must come true, and hardly anything
// better may stand open: a promise of a little beside a large hole sends people home too early.
TEST(NextBestView, OfALearntSensorBringsWhatItPromisesAndNearlyTheMostThatThereIs) {
  for (const auto& [name, mesh] : {std::pair<const char*, TriangleMesh>{"valve body", test::casing()},
                                   {"elbow", simulate::pipe_elbow(80.0, 25.0, 4.0)}}) {
    const auto model = prepared(mesh);
    const Surface surface = surface_of(model);
    const double d = model.diameter;
    const SensorLimits sensor{25.0, 0.5 * d, 3.0 * d, 1.5 * d, "true"};
    const Eigen::Vector3d middle = model.box.center();
    const auto from = [&](const Eigen::Vector3d& side) {
      return SensorView{middle + sensor.distance_mm * side.normalized(), middle};
    };
    const auto added = [&](const std::vector<char>& more, const std::vector<char>& seen) {
      return area_share(surface, [&](std::size_t v) { return more[v] != 0 && seen[v] == 0; });
    };
    std::vector<char> seen(surface.mesh.vertices.size(), 0);
    std::vector<SensorLimits> told;
    for (const Eigen::Vector3d& side : {Eigen::Vector3d(1, 0, 0.5), Eigen::Vector3d(0.7, 0.7, 0.5)}) {
      told.push_back(limits_seen(measured(from(side), sensor, model).positions, from(side).position, middle, d));
      const auto more = scanned(from(side), sensor, surface, model);
      for (std::size_t v = 0; v < seen.size(); ++v) seen[v] = static_cast<char>(seen[v] | more[v]);
    }
    const SensorLimits learnt = learnt_limits(told);
    EXPECT_NEAR(learnt.distance_mm, sensor.distance_mm, 0.01 * d) << name;
    const ViewPlanner planner(surface, model, learnt, Context(2));
    for (int step = 0; step < 4; ++step) {
      const auto views = planner.best_views({seen});
      ASSERT_FALSE(views.empty()) << name;
      const auto more = scanned(views[0].view, sensor, surface, model);
      const double brought = added(more, seen), promised = views[0].gain_share;
      // The most that any of 60 directions brings of which a quarter is known already.
      Random random(7, "directions", static_cast<std::uint64_t>(step));
      double most = 0.0;
      for (int i = 0; i < 60; ++i) {
        const auto there =
            scanned(from(Eigen::Vector3d(random.normal(), random.normal(), random.normal())), sensor, surface, model);
        const double all = area_share(surface, [&](std::size_t v) { return there[v] != 0; });
        const double fresh = added(there, seen);
        if (all - fresh >= 0.25 * all) most = std::max(most, fresh);
      }
      std::printf("%-14s step %d: promised %4.1f %%, brought %4.1f %%, the best of 60 directions %4.1f %%\n", name,
                  step, 100.0 * promised, 100.0 * brought, 100.0 * most);
      // Flat incidence counts as seen in part only, and what lies next to seen surface counts as seen.
      EXPECT_GT(brought, 0.8 * promised) << name << " " << step;
      EXPECT_LT(brought, 1.5 * promised + 0.005) << name << " " << step;
      EXPECT_GT(brought, 0.75 * most) << name << " " << step;
      for (std::size_t v = 0; v < seen.size(); ++v) seen[v] = static_cast<char>(seen[v] | more[v]);
    }
  }
}

}  // namespace
}  // namespace asbuilt::live
