// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/mirror_image.h"

#include <gtest/gtest.h>

#include <memory>
#include <numbers>
#include <vector>

#include "asbuilt/scan/mirrored.h"
#include "asbuilt/simulate/mesh_edit.h"
#include "asbuilt/simulate/simulate.h"
#include "asbuilt/verify/verdict.h"
#include "asbuilt/verify/verify.h"
#include "unit/detect/oriented_points.h"

namespace asbuilt::pipeline {
namespace {

using verify::Detection;
using verify::Reason;
using verify::Status;

TriangleMesh mirrored(const TriangleMesh& mesh) { return simulate::scaled(mesh, {-1.0, 1.0, 1.0}); }

// A scan of a part or its mirror image, and the part to be found in it.
struct MirrorScene {
  explicit MirrorScene(const TriangleMesh& standing_there) {
    simulate::SimulateOptions options;
    options.scans = 1;
    options.points = 25000;
    options.clutter_objects = 3;
    options.seed = 5;
    const simulate::Simulation simulation = simulate::simulate(standing_there, options, context).value();
    standing_from_scan = *simulation.scans.front().model_from_scan;
    scan = scan::prepare_scan({simulation.scans.front().points_in_scan, {}}, Eigen::Vector3d(0, 0, 0), {}, {}, context)
               .value();
  }
  // The best of the given poses, whatever speaks against it.
  [[nodiscard]] std::vector<Detection> vouched_for(const std::vector<detect::Hypothesis>& poses) const {
    return {verify::verify(scan, model, poses, {}, context, true).value()};
  }
  [[nodiscard]] Detection asked(std::vector<Detection> placements, const Options& options = {}) const {
    EXPECT_TRUE(reject_mirror_images(placements, scan, model, *book, options, context));
    return placements.front();
  }

  Context context{2};
  model::PreparedModel model = test::small_model(0.04);
  std::shared_ptr<const detect::Codebook> book = detect::build_codebook(model, {}, context).value();
  Pose standing_from_scan = Pose::Identity();
  scan::Scan scan;
};

// The poses that put the part where its mirror image stands, as near to it as may be: mirrored at planes through the
// middle of its box.
std::vector<detect::Hypothesis> in_place_of_its_mirror_image(const MirrorScene& scene) {
  std::vector<detect::Hypothesis> poses;
  for (const Eigen::Vector3d& turn :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1)}) {
    const Eigen::Vector3d centre = scene.model.box.center(), mirrored_centre(-centre.x(), centre.y(), centre.z());
    const double angle = turn.norm() > 0.0 ? std::numbers::pi : 0.0;
    const Eigen::Vector3d axis = turn.norm() > 0.0 ? turn : Eigen::Vector3d(0, 0, 1);
    poses.push_back({Eigen::Translation3d(centre) * Eigen::AngleAxisd(angle, axis) *
                         Eigen::Translation3d(-mirrored_centre) * scene.standing_from_scan,
                     1.0});
  }
  return poses;
}

TEST(MirrorImage, IsRejectedForThePart) {
  const MirrorScene scene(mirrored(test::stepped_block()));
  std::vector<Detection> placements = scene.vouched_for(in_place_of_its_mirror_image(scene));
  ASSERT_EQ(placements.front().status, Status::accepted);
  ASSERT_FALSE(verify::is_beyond_doubt(placements.front(), {}));
  const Detection asked = scene.asked(placements);
  EXPECT_EQ(asked.status, Status::rejected);
  EXPECT_EQ(asked.reason, Reason::mirror_image) << asked.explanation;
  EXPECT_TRUE(asked.segment.empty());

  Options paper;
  paper.paper_mode = true;
  EXPECT_EQ(scene.asked(placements, paper).status, Status::accepted) << "the published method does not ask";
}

TEST(MirrorImage, OfThePartExplainsNoMoreThanThePart) {
  const MirrorScene scene(test::stepped_block());
  std::vector<Detection> placements = scene.vouched_for({{scene.standing_from_scan, 1.0}});
  ASSERT_EQ(placements.front().status, Status::accepted);
  placements.front().best.weakest_direction = 0.0;  // so that it is asked
  placements.front().best.slip_lead = 0.0;
  ASSERT_FALSE(verify::is_beyond_doubt(placements.front(), {}));
  EXPECT_EQ(scene.asked(placements).status, Status::accepted);
}

// What stands elsewhere in the scan says nothing of the placement.
TEST(MirrorImage, ElsewhereSaysNothing) {
  const MirrorScene scene(mirrored(test::stepped_block()));
  std::vector<Detection> placements = scene.vouched_for(in_place_of_its_mirror_image(scene));
  placements.front().best.model_from_scan =
      Pose(Eigen::Translation3d(scene.model.diameter, 0, 0)) * placements.front().best.model_from_scan;
  EXPECT_EQ(scene.asked(placements).status, Status::accepted);
}

TEST(MirroredScan, TwiceIsTheScan) {
  const MirrorScene scene(test::stepped_block());
  const scan::Scan once = scan::mirrored(scene.scan), twice = scan::mirrored(once);
  ASSERT_TRUE(scene.scan.spacing_by_range.known());
  for (std::size_t i = 0; i < scene.scan.cloud.size(); i += 100) {
    const Eigen::Vector3f &point = scene.scan.cloud.positions[i], &image = once.cloud.positions[i];
    ASSERT_EQ(image, Eigen::Vector3f(-point.x(), point.y(), point.z()));
    ASSERT_EQ(twice.cloud.positions[i], point);
    ASSERT_EQ(twice.cloud.normals[i], scene.scan.cloud.normals[i]);
    ASSERT_DOUBLE_EQ(once.spacing_at(image.cast<double>()), scene.scan.spacing_at(point.cast<double>()));
  }
}

}  // namespace
}  // namespace asbuilt::pipeline
