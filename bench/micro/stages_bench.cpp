// SPDX-License-Identifier: Apache-2.0
// The kernels of the stages on one scan of the demonstration part. One thread unless the name says otherwise.
#include <benchmark/benchmark.h>

#include <array>
#include <vector>

#include "asbuilt/core/random.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/detect/detect.h"
#include "asbuilt/inspect/deviation.h"
#include "asbuilt/refine/refine.h"
#include "asbuilt/verify/lm_icp.h"
#include "asbuilt/verify/verdict.h"
#include "asbuilt/verify/verify.h"
#include "scene.h"

namespace asbuilt::bench {
namespace {

std::vector<Eigen::Vector3f> points_near_surface(std::size_t count) {
  const model::PreparedModel& model = scene().model;
  std::vector<Eigen::Vector3f> points;
  Random random(1, "near", 0);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t sample = random.below(model.dense_samples.size());
    const auto offset = static_cast<float>(0.01 * model.diameter * random.normal());
    points.emplace_back(model.dense_samples.positions[sample] + offset * model.dense_samples.normals[sample]);
  }
  return points;
}

void BM_DistanceFieldLookup(benchmark::State& state) {
  const auto points = points_near_surface(4096);
  std::size_t next = 0;
  for (auto _ : state) benchmark::DoNotOptimize(scene().model.field->at(points[next++ % points.size()]));
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_DistanceFieldLookup);

void BM_DistanceFieldDistanceAlone(benchmark::State& state) {
  const auto points = points_near_surface(4096);
  std::size_t next = 0;
  for (auto _ : state) benchmark::DoNotOptimize(scene().model.field->distance_at(points[next++ % points.size()]));
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_DistanceFieldDistanceAlone);

// What the field saves: the exact search.
void BM_SurfaceDistanceNearest(benchmark::State& state) {
  const auto points = points_near_surface(4096);
  std::size_t next = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(scene().model.surface->nearest(points[next++ % points.size()].cast<double>()));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_SurfaceDistanceNearest);

void BM_CodebookBuild(benchmark::State& state) {
  const Context context(1);
  for (auto _ : state) benchmark::DoNotOptimize(detect::build_codebook(scene().model, {}, context));
}
BENCHMARK(BM_CodebookBuild)->Unit(benchmark::kMillisecond);

void BM_Voting(benchmark::State& state) {
  const Context context(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    benchmark::DoNotOptimize(detect::find_hypotheses(scene().scan, *scene().codebook, {}, context));
  }
}
BENCHMARK(BM_Voting)->ArgName("threads")->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

// Sparse LM-ICP of one hypothesis, from a displacement of some 2 % of the diameter to convergence (Sec. 3.1).
void BM_SparseLmIcp(benchmark::State& state) {
  const model::PreparedModel& model = scene().model;
  const scan::Scan& scan = scene().scan;
  std::vector<Eigen::Vector3f> points;
  const std::size_t wanted = static_cast<std::size_t>(state.range(0));
  for (std::size_t k = 0; k < wanted; ++k) points.push_back(scan.cloud.positions[k * scan.cloud.size() / wanted]);
  Vector6d push;
  push << 0.02, -0.015, 0.01, 2.0, -3.0, 2.5;
  const Pose start = pose_from_twist(push) * scene().model_from_scan;
  const verify::LmIcpOptions options{model.sampling_distance, 30, true};
  verify::LmIcpResult result;
  for (auto _ : state) result = verify::lm_icp(points, start, model, scan.viewpoint, options);
  state.counters["iterations"] = result.iterations;
  state.counters["displacement_mm"] = verify::displacement_mm(result.model_from_scan, scene().model_from_scan, model);
}
BENCHMARK(BM_SparseLmIcp)->ArgName("points")->Arg(300)->Arg(1000)->Unit(benchmark::kMicrosecond);

void BM_Verify(benchmark::State& state) {
  const Context context(static_cast<int>(state.range(0)));
  const auto hypotheses = detect::find_hypotheses(scene().scan, *scene().codebook, {}, context);
  if (!hypotheses) return state.SkipWithError(hypotheses.error().message.c_str());
  for (auto _ : state) {
    benchmark::DoNotOptimize(verify::verify(scene().scan, scene().model, *hypotheses, {}, context));
  }
}
BENCHMARK(BM_Verify)->ArgName("threads")->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

// Three views of the part from 35 degrees apart, started 1 mm and 0.2 degrees off.
void BM_Refine(benchmark::State& state) {
  const Context context(static_cast<int>(state.range(0)));
  const model::PreparedModel& model = scene().model;
  std::vector<refine::View> views;
  for (int i = 0; i < 3; ++i) {
    const double angle = 0.6 * i;
    const Eigen::Vector3d eye = bounding_box(model.skin).center() +
                                2.5 * model.diameter * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.5);
    refine::View view;
    const PointCloud points = rays_onto(model, eye, 250, 0.1, view.model_from_scan);
    const auto scan = scan::prepare_scan(points, Eigen::Vector3d(Eigen::Vector3d::Zero()), {}, {}, context);
    if (!scan) return state.SkipWithError(scan.error().message.c_str());
    view.segment_in_scan = scan->cloud;
    Vector6d push;
    push << 0.003, -0.002, 0.001, 1.0, -0.5, 0.5;
    if (i > 0) view.model_from_scan = pose_from_twist(push) * view.model_from_scan;
    views.push_back(view);
  }
  const std::array<refine::Link, 3> links{{{0, 1}, {1, 2}, {0, 2}}};
  for (auto _ : state) {
    const auto refined = refine::refine(views, links, {}, context);
    if (!refined) return state.SkipWithError(refined.error().message.c_str());
    state.counters["iterations"] = refined->iterations;
  }
}
BENCHMARK(BM_Refine)->ArgName("threads")->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

void BM_Inspect(benchmark::State& state) {
  const Context context(1);
  PointCloud cloud = scene().scan.cloud;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    cloud.positions[i] = (scene().model_from_scan * cloud.positions[i].cast<double>()).cast<float>();
    cloud.normals[i] = (scene().model_from_scan.linear() * cloud.normals[i].cast<double>()).cast<float>();
  }
  for (auto _ : state) benchmark::DoNotOptimize(inspect::inspect(cloud, scene().model, {}, context));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(cloud.size()));
}
BENCHMARK(BM_Inspect)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace asbuilt::bench
