// SPDX-License-Identifier: Apache-2.0
// asbuilt_detection_opencv: the same scans through OpenCV's surface_matching (opencv_contrib, PPF3DDetector and ICP),
// with its defaults and the figures of its own sample. What the sample leaves to the user is done as well as we can:
// model and scene are sampled evenly at the same spacing in mm (its own sampling is relative to the scene, of whatever
// size that is), with normals fitted over that spacing and turned to the sensor, all by our code.
#include <algorithm>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/surface_matching.hpp>
#include <opencv2/surface_matching/ppf_helpers.hpp>

#include "asbuilt/model/prepared_model.h"
#include "asbuilt/scan/scan.h"
#include "peer.h"
#include "record.h"

namespace asbuilt::bench {
namespace {

namespace ppf = cv::ppf_match_3d;

constexpr double kRelativeDistanceStep = 0.05;      // of the sample
constexpr double kSceneReferenceShare = 1.0 / 5.0;  // its default, but fewer where that means hours:
constexpr double kMostPairs = 50e6;                 // scene pairs
constexpr std::size_t kRegistered = 5;              // poses that go through the ICP
constexpr std::size_t kLooked = 50;                 // poses among which the right one is looked for
constexpr double kIcpSpacing = 1.0 / 3.0;           // of the points for the ICP / sampling distance

// Rows of x y z nx ny nz.
cv::Mat to_mat(const PointCloud& cloud) {
  cv::Mat mat(static_cast<int>(cloud.size()), 6, CV_32F);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    auto* row = mat.ptr<float>(static_cast<int>(i));
    for (Eigen::Index k = 0; k < 3; ++k) {
      row[k] = cloud.positions[i][k];
      row[3 + k] = cloud.normals[i][k];
    }
  }
  return mat;
}

Pose model_from_scan_of(const ppf::Pose3D& found) {
  Eigen::Matrix4d scan_from_model;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) scan_from_model(row, column) = found.pose(row, column);
  }
  return bench::model_from_scan_of(scan_from_model);
}

double extent_mm(const PointCloud& cloud) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& point : cloud.positions) box.extend(point);
  return static_cast<double>(box.diagonal().norm());
}

/// A trained detector, and the part's denser samples for its ICP.
struct Trained {
  ppf::PPF3DDetector detector;
  cv::Mat dense;
  double spacing_mm = 0.0;
};

Result<std::shared_ptr<Trained>> trained(const SuitePart& part, double sampling_ratio, const Context& context) {
  ASBUILT_TRY(model, sampled(part, sampling_ratio, context));
  auto result = std::make_shared<Trained>();
  result->detector = ppf::PPF3DDetector(sampling_ratio, kRelativeDistanceStep);
  result->dense = to_mat(model.dense_samples);
  result->spacing_mm = model.sampling_distance;
  result->detector.trainModel(to_mat(model.samples));
  return result;
}

Result<void> judge(CaseRecord& record, const CaseScan& scan_of_case, const SuitePart& part, Trained& trained,
                   const Context& context) {
  PointCloud scene, dense;
  {
    const Timed timed(record.prepare_scan);
    ASBUILT_TRY(scan, scan::prepare_scan(scan_of_case.points_in_scan, std::nullopt, {}, {}, context));
    scene = scan::downsample(scan, trained.spacing_mm, trained.spacing_mm, context);
    dense = scan::downsample(scan, kIcpSpacing * trained.spacing_mm, trained.spacing_mm, context);
  }
  std::vector<ppf::Pose3DPtr> results;
  {
    const Timed timed(record.detect);
    const auto points = static_cast<double>(scene.size());
    trained.detector.match(to_mat(scene), results, std::min(kSceneReferenceShare, kMostPairs / (points * points)),
                           trained.spacing_mm / extent_mm(scene));
  }
  record.status = "rejected";
  record.reason_code = "no_hypothesis";
  record.hypotheses = results.size();
  if (results.empty()) return {};
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < std::min(results.size(), kLooked); ++i) poses.push_back(model_from_scan_of(*results[i]));
  record.right_rank = first_near(poses, scan_of_case.model_from_scan, part);

  std::vector<ppf::Pose3DPtr> registered(results.begin(),
                                         results.begin() + static_cast<long>(std::min(results.size(), kRegistered)));
  {
    const Timed timed(record.verify);
    ppf::ICP icp(100, 0.005F, 2.5F, 8);
    icp.registerModelToScene(trained.dense, to_mat(dense), registered);
  }
  // It cannot say that the part is not there: its first result always counts. Its ICP, which lets the hidden side of
  // the part pull as well, often does more harm than good; of the poses before and after, the better one counts.
  record.status = "accepted";
  record.reason_code = "";
  record.votes = static_cast<double>(results.front()->numVotes);
  record.best = judged(model_from_scan_of(*registered.front()), scan_of_case.model_from_scan, part);
  const Judged before = judged(poses.front(), scan_of_case.model_from_scan, part);
  if (before.displacement < record.best.displacement) record.best = before;
  record.best.score = record.votes;
  record.unverified = record.best;
  return {};
}

Result<Judge> judge_for(const SuitePart& part, const Peer& peer, const Selection&, const Context& context) {
  ASBUILT_TRY(detector, trained(part, peer.sampling_ratio, context));
  return
      [&, detector](CaseRecord& record, const CaseScan& scan) { return judge(record, scan, part, *detector, context); };
}

}  // namespace
}  // namespace asbuilt::bench

int main(int argc, char** argv) {
  return asbuilt::bench::run_peer(argc, argv,
                                  {"opencv", "OpenCV's surface_matching", 0.025, asbuilt::bench::judge_for});
}
