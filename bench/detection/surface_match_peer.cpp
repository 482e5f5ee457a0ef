// SPDX-License-Identifier: Apache-2.0
// asbuilt_detection_surface_match: the same scans through surface_match (github.com/SurfaceMan/surface_match), a public
// point pair detector with registration and a score, at the defaults of its interface. It
// samples model and scene itself; what it samples from is ours: the part's dense samples and the scan at a spacing of
// half its registration's, both with normals fitted over the sampling distance and turned outwards or to the sensor.
#include <omp.h>
#include <ppf.h>

#include <Eigen/Geometry>
#include <array>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "apart.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/model/sample_normals.h"
#include "asbuilt/scan/scan.h"
#include "peer.h"

namespace asbuilt::bench {
namespace {

constexpr double kSecondsAtMost = 300.0;  // for training and a scan; a scan beyond that counts as not found

// Its defaults, written down where its header tells what they mean.
constexpr float kKeyPointShare = 0.2F, kLeastScore = 0.2F;
constexpr double kModelSamplingRatio = 0.025;  // our dense samples stand at a third of it, finer than its 0.01
constexpr double kSceneSpacing = 0.005;        // of the diameter; its registration samples the scene at 0.01

::ppf::PointCloud to_cloud(const PointCloud& cloud) {
  ::ppf::PointCloud result;
  result.point = cloud.positions;
  result.normal = cloud.normals;
  return result;
}

/// What the other process tells.
struct Matches {
  std::vector<std::array<double, 16>> scan_from_model;  ///< row by row, best first
  std::vector<double> scores;
  StepTime train, match;
};

nlohmann::json to_json(const Matches& matches) {
  return {{"poses", matches.scan_from_model},
          {"scores", matches.scores},
          {"train", {matches.train.wall, matches.train.cpu}},
          {"match", {matches.match.wall, matches.match.cpu}}};
}

Matches matches_of(const nlohmann::json& json) {
  const auto time = [&](const char* name) { return StepTime{json.at(name).at(0), json.at(name).at(1)}; };
  return {json.at("poses"), json.at("scores"), time("train"), time("match")};
}

std::array<double, 16> by_rows(const Eigen::Matrix4f& matrix) {
  std::array<double, 16> values{};
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data()) = matrix.cast<double>();
  return values;
}

// Trains anew for every scan: the process in which it does has no past.
Matches matched(const ::ppf::PointCloud& model, const ::ppf::PointCloud& scene, float sampling_ratio, int threads) {
  std::cout.setstate(std::ios::failbit);  // it tells its steps there
  if (threads > 0) omp_set_num_threads(threads);
  Matches result;
  ::ppf::Detector detector;
  {
    const Timed timed(result.train);
    detector.trainModel(model, sampling_ratio);
  }
  std::vector<Eigen::Matrix4f> poses;
  std::vector<float> scores;
  {
    const Timed timed(result.match);
    detector.matchScene(scene, poses, scores, sampling_ratio, kKeyPointShare, kLeastScore);
  }
  for (const Eigen::Matrix4f& pose : poses) result.scan_from_model.push_back(by_rows(pose));
  result.scores.assign(scores.begin(), scores.end());
  return result;
}

/// What it trains with.
struct Part {
  ::ppf::PointCloud samples;
  double diameter_mm = 0.0, spacing_mm = 0.0;
};

void note(CaseRecord& record, const Matches& matches, const CaseScan& scan, const SuitePart& part) {
  record.prepare_model.wall += matches.train.wall;
  record.prepare_model.cpu += matches.train.cpu;
  record.detect = matches.match;  // its registration and score included
  std::vector<Pose> poses;
  for (const std::array<double, 16>& values : matches.scan_from_model) {
    poses.push_back(model_from_scan_of(Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data())));
  }
  record.hypotheses = poses.size();
  record.right_rank = first_near(poses, scan.model_from_scan, part);
  record.status = poses.empty() ? "rejected" : "accepted";
  record.reason_code = poses.empty() ? "no_hypothesis" : "";
  if (poses.empty()) return;
  record.best = judged(poses.front(), scan.model_from_scan, part);
  record.best.score = matches.scores.front();
  record.unverified = record.best;
}

Result<void> judge(CaseRecord& record, const CaseScan& scan_of_case, const SuitePart& part, const Part& prepared,
                   double sampling_ratio, int threads, const Context& context) {
  ::ppf::PointCloud scene;
  {
    const Timed timed(record.prepare_scan);
    ASBUILT_TRY(scan, scan::prepare_scan(scan_of_case.points_in_scan, std::nullopt, {}, {}, context));
    scene = to_cloud(scan::downsample(scan, kSceneSpacing * prepared.diameter_mm, prepared.spacing_mm, context));
    scene.viewPoint = scan.viewpoint.value.cast<float>();
  }
  const auto told = run_apart(kSecondsAtMost, [&] {
    return to_json(matched(prepared.samples, scene, static_cast<float>(sampling_ratio), threads)).dump();
  });
  if (told) return note(record, matches_of(nlohmann::json::parse(*told)), scan_of_case, part), Result<void>{};
  record.status = "failed";
  record.reason_code = "peer_failed";
  record.reason = told.error().message;
  return {};
}

Result<Judge> judge_for(const SuitePart& part, const Peer& peer, const Selection& selection, const Context& context) {
  ASBUILT_TRY(model, sampled(part, kModelSamplingRatio, context));
  const double spacing_mm = peer.sampling_ratio * model.diameter;
  PointCloud& samples = model.dense_samples;
  samples.normals = model::fitted_normals(samples, samples, spacing_mm, context);
  auto prepared = std::make_shared<Part>(Part{to_cloud(samples), model.diameter, spacing_mm});
  return [&, prepared](CaseRecord& record, const CaseScan& scan) {
    return judge(record, scan, part, *prepared, peer.sampling_ratio, selection.threads, context);
  };
}

}  // namespace
}  // namespace asbuilt::bench

int main(int argc, char** argv) {
  return asbuilt::bench::run_peer(
      argc, argv, {"surface_match", "surface_match (github.com/SurfaceMan)", 0.05, asbuilt::bench::judge_for});
}
