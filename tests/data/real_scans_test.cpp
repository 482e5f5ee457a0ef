// SPDX-License-Identifier: Apache-2.0
// Is the part found in real scans, and never in a wrong place? The truth comes with the data (x_scan = M * x_model).
// Accuracy is measured by bench/real/run; here only right and wrong count.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "asbuilt/core/pose.h"
#include "asbuilt/detect/codebook.h"
#include "asbuilt/detect/detect.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/io/scan_file.h"
#include "asbuilt/io/unit.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/scan/scan.h"
#include "asbuilt/verify/verify.h"

namespace asbuilt {
namespace {

namespace fs = std::filesystem;

const fs::path kData = ASBUILT_DATA_DIR;

// Where the data set is absent there is nothing to test; the report says so.
#define SKIP_WITHOUT(folder) \
  if (!fs::exists(kData / (folder))) GTEST_SKIP() << (kData / (folder)) << " is not there"

struct Part {
  Part(const fs::path& file, io::Unit file_unit)
      : unit(file_unit),
        model(model::prepare(io::read_mesh(file, unit).value(), {}, context).value()),
        codebook(detect::build_codebook(model, {}, context).value()) {}

  Context context;
  io::Unit unit;
  model::PreparedModel model;
  std::shared_ptr<const detect::Codebook> codebook;
};

verify::Detection find(const Part& part, const fs::path& scan_file, const scan::ViewpointRequest& viewpoint = {}) {
  const io::ScanFile file = io::read_scans(scan_file, part.unit).value().front();
  const scan::Scan scan = scan::prepare_scan(file.cloud, file.viewpoint_mm, viewpoint, {}, part.context).value();
  const auto hypotheses = detect::find_hypotheses(scan, *part.codebook, {}, part.context).value();
  return verify::verify(scan, part.model, hypotheses, {}, part.context).value();
}

Pose true_model_from_scan(const fs::path& file, io::Unit unit) {
  std::ifstream stream(file);
  Eigen::Matrix4d scan_from_model = Eigen::Matrix4d::Zero();
  for (int i = 0; i < 16; ++i) stream >> scan_from_model(i / 4, i % 4);
  scan_from_model.topRightCorner<3, 1>() *= io::millimetres_per(unit);
  EXPECT_TRUE(is_rigid(scan_from_model, 1e-2)) << file;
  return orthonormalised(Pose(scan_from_model)).inverse();
}

enum class Outcome { right, wrong, missed };

std::ostream& operator<<(std::ostream& stream, Outcome outcome) {
  return stream << (outcome == Outcome::right ? "right" : outcome == Outcome::wrong ? "wrong" : "missed");
}

// Right: no vertex of the CAD is displaced by more than 2 % of the diameter.
Outcome judge(const Part& part, const verify::Detection& detection, const Pose& truth) {
  if (detection.status != verify::Status::accepted) return Outcome::missed;
  const Pose error = detection.best.model_from_scan * truth.inverse();
  double largest = 0.0;
  for (const Eigen::Vector3d& vertex : part.model.skin.vertices) {
    largest = std::max(largest, (error * vertex - vertex).norm());
  }
  return largest <= 0.02 * part.model.diameter ? Outcome::right : Outcome::wrong;
}

class MianScene : public testing::TestWithParam<std::string> {};

// One laser scan of four toys on top of one another, 68 to 85 % of each hidden.
TEST_P(MianScene, ShowsTheModelInItsPlace) {
  SKIP_WITHOUT("mian");
  const Part part(kData / "mian/models" / (GetParam() + ".ply"), io::Unit::millimetre);
  const verify::Detection detection = find(part, kData / "mian/scenes/rs1.ply");
  const Pose truth = true_model_from_scan(kData / "mian/gt" / (GetParam() + "-rs1.xf"), part.unit);
  EXPECT_EQ(judge(part, detection, truth), Outcome::right) << detection.explanation;
}

INSTANTIATE_TEST_SUITE_P(RealScans, MianScene, testing::Values("chef", "chicken", "parasaurolophus", "T-rex_shifted"),
                         [](const auto& model) { return model.index == 3 ? std::string("T_rex") : model.param; });

std::vector<Outcome> outcomes(const Part& part, const fs::path& scans, const fs::path& truths,
                              const scan::ViewpointRequest& viewpoint = {}) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(scans)) files.push_back(entry.path());
  std::ranges::sort(files);
  std::vector<Outcome> result;
  for (const fs::path& file : files) {
    const Pose truth = true_model_from_scan(truths / (file.stem().string() + ".txt"), part.unit);
    result.push_back(judge(part, find(part, file, viewpoint), truth));
  }
  return result;
}

// A depth camera with a resolution of 1 mm, metres, bad normals in the files.
TEST(RealScans, OfThePrintedBunnyShowItInAtLeastElevenOfTwelve) {
  SKIP_WITHOUT("tum_bunny");
  const Part part(kData / "tum_bunny/model_bun_zipper.ply", io::Unit::metre);
  const auto found = outcomes(part, kData / "tum_bunny/scans", kData / "tum_bunny/gt_icp");
  EXPECT_THAT(found, testing::Not(testing::Contains(Outcome::wrong)));
  EXPECT_GE(std::ranges::count(found, Outcome::right), 11);
}

class StanfordBunny : public testing::TestWithParam<std::string> {};

// Parallel rays from +z: the origin is no place of the sensor, and "auto" has to notice.
TEST_P(StanfordBunny, IsFoundInEveryScanWhateverIsSaidOfTheViewpoint) {
  SKIP_WITHOUT("stanford_bunny");
  const Part part(kData / "stanford_bunny/model_bun_zipper_mm.ply", io::Unit::millimetre);
  scan::ViewpointRequest viewpoint;
  viewpoint.automatic = GetParam() == "automatic";
  if (GetParam() == "direction") viewpoint.stated = {scan::Viewpoint::Kind::direction, -Eigen::Vector3d::UnitZ()};
  const auto found = outcomes(part, kData / "stanford_bunny/scans", kData / "stanford_bunny/gt", viewpoint);
  EXPECT_THAT(found, testing::AllOf(testing::SizeIs(testing::Ge(4U)), testing::Each(Outcome::right)));
}

INSTANTIATE_TEST_SUITE_P(RealScans, StanfordBunny, testing::Values("automatic", "none", "direction"),
                         [](const auto& viewpoint) { return viewpoint.param; });

}  // namespace
}  // namespace asbuilt
