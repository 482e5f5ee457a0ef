// SPDX-License-Identifier: Apache-2.0
// A STEP file in inch and scans in other units give what millimetres give.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "asbuilt/io/mesh_file.h"
#include "asbuilt/io/ply_writer.h"
#include "asbuilt/io/scan_file.h"
#include "asbuilt/pipeline.h"
#include "asbuilt/simulate/simulate.h"
#include "support/parts.h"

// OpenCASCADE's own headers, and warnings in them.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wconversion"
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakePolygon.hxx>
#include <BRepBuilderAPI_Sewing.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <STEPControl_Controller.hxx>
#include <STEPControl_Writer.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Wire.hxx>
#pragma GCC diagnostic pop

namespace asbuilt {
namespace {

namespace fs = std::filesystem;

/// Writes a mesh as STEP whose lengths are inches: a planar face for each triangle.
void write_step_in_inch(const fs::path& path, const TriangleMesh& mesh) {
  Message::DefaultMessenger()->ChangePrinters().Clear();
  BRepBuilderAPI_Sewing sewing(1e-6);
  for (const Eigen::Vector3i& triangle : mesh.triangles) {
    BRepBuilderAPI_MakePolygon outline;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d& v = mesh.vertices[static_cast<std::size_t>(triangle[k])];
      outline.Add(gp_Pnt(v.x(), v.y(), v.z()));
    }
    outline.Close();
    sewing.Add(BRepBuilderAPI_MakeFace(outline.Wire(), true).Face());
  }
  sewing.Perform();
  STEPControl_Controller::Init();  // the writer learns its unit when it is made
  Interface_Static::SetCVal("write.step.unit", "INCH");
  STEPControl_Writer writer;
  writer.Transfer(sewing.SewedShape(), STEPControl_AsIs);
  ASSERT_EQ(writer.Write(path.c_str()), IFSelect_RetDone);
}

/// The same points, in another unit; doubles, so that only the file's unit differs.
void write_in_unit(const fs::path& path, const std::vector<Eigen::Vector3f>& points_mm, io::Unit unit) {
  std::array<std::vector<double>, 3> columns;
  for (const Eigen::Vector3f& point : points_mm) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      columns[axis].push_back(static_cast<double>(point[static_cast<Eigen::Index>(axis)]) / io::millimetres_per(unit));
    }
  }
  const std::vector<io::PlyColumn> named{{"x", std::span<const double>(columns[0])},
                                         {"y", std::span<const double>(columns[1])},
                                         {"z", std::span<const double>(columns[2])}};
  const auto written = io::write_ply(path, named, {});
  ASSERT_TRUE(written) << written.error().message;
}

/// How far two poses put the corners of a box apart at most, mm.
double largest_difference_mm(const Pose& a, const Pose& b, const std::vector<Eigen::Vector3d>& corners_in_scan) {
  double largest = 0.0;
  for (const Eigen::Vector3d& corner : corners_in_scan) largest = std::max(largest, (a * corner - b * corner).norm());
  return largest;
}

class Units : public testing::Test {
 protected:
  Units()
      : base_(fs::path(testing::TempDir()) / "asbuilt_units" /
              testing::UnitTest::GetInstance()->current_test_info()->name()) {
    fs::remove_all(base_);
    fs::create_directories(base_);
  }
  ~Units() override { fs::remove_all(base_); }

  void simulate_scans(const TriangleMesh& part, simulate::SimulateOptions options) {
    auto simulation = simulate::simulate(part, options, Context(2));
    ASSERT_TRUE(simulation) << simulation.error().message;
    simulation_ = std::move(*simulation);
  }

  /// The scans in these units, one after the other, from the first again where there are more scans than units.
  [[nodiscard]] std::vector<std::string> written(const std::string& folder, const std::vector<io::Unit>& units) const {
    fs::create_directories(base_ / folder);
    std::vector<std::string> paths;
    for (std::size_t i = 0; i < simulation_.scans.size(); ++i) {
      const auto path = base_ / folder / (simulation_.scans[i].name + ".ply");
      write_in_unit(path, simulation_.scans[i].points_in_scan, units[i % units.size()]);
      paths.push_back(path.string());
    }
    return paths;
  }

  [[nodiscard]] io::RunRecord detected(const fs::path& model, const std::vector<std::string>& scans,
                                       const pipeline::Options& options, const std::string& output) const {
    const auto record = pipeline::detect(model.string(), scans, options, {base_ / output, false, {}}, Context(2));
    EXPECT_TRUE(record) << (record ? "" : record.error().message);
    return record.value_or(io::RunRecord{});
  }

  /// Same words about each scan, and poses that agree to a share of the noise at the part.
  void expect_same(const io::RunRecord& found, const io::RunRecord& expected, double sigmas = 0.25) const {
    ASSERT_EQ(found.scans.size(), expected.scans.size());
    EXPECT_NEAR(found.model.diameter, expected.model.diameter, 1e-3 * expected.model.diameter);
    std::size_t accepted = 0;
    for (std::size_t i = 0; i < found.scans.size(); ++i) {
      const io::ScanRecord &scan = found.scans[i], &reference = expected.scans[i];
      EXPECT_EQ(scan.status, reference.status) << scan.name << ": " << scan.reason << " / " << reference.reason;
      if (!scan.model_from_scan || !reference.model_from_scan) continue;
      ++accepted;
      std::vector<Eigen::Vector3d> part_in_scan;
      for (const Eigen::Vector3d& v : simulation_.model.vertices) {
        part_in_scan.push_back(reference.model_from_scan->inverse() * v);
      }
      EXPECT_LT(largest_difference_mm(*scan.model_from_scan, *reference.model_from_scan, part_in_scan),
                sigmas * simulation_.noise_sigma_mm)
          << scan.name;
    }
    EXPECT_GE(accepted, 1u) << "nothing was compared";
  }

  fs::path base_;
  simulate::Simulation simulation_;
};

// Of a part whose surface holds its pose: what only edges hold is found in steps of 0.4 % of the diameter, and faces in
// another order are sampled at other places, which may end a step apart.
TEST_F(Units, AStepFileInInchAndScansInMetresGiveWhatMillimetresGive) {
  simulate_scans(test::casing(), {.scans = 3, .points = 40000, .seed = 5, .as_built = {}});
  ASSERT_TRUE(io::write_mesh_ply(base_ / "model.ply", simulation_.model));
  const auto expected = detected(base_ / "model.ply", written("mm", {io::Unit::millimetre}), {}, "all_mm");

  write_step_in_inch(base_ / "model.step", simulation_.model);
  pipeline::Options options;
  options.scan_unit = io::Unit::metre;
  expect_same(detected(base_ / "model.step", written("m", {io::Unit::metre}), options, "inch_and_m"), expected);
}

TEST_F(Units, EachScanMayHaveAUnitOfItsOwn) {
  simulate_scans(test::casing(), {.scans = 5, .points = 30000, .seed = 6, .as_built = {}});
  ASSERT_TRUE(io::write_mesh_ply(base_ / "model.ply", simulation_.model));
  const auto expected = detected(base_ / "model.ply", written("mm", {io::Unit::millimetre}), {}, "all_mm");

  const auto mixed =
      written("mixed", {io::Unit::metre, io::Unit::inch, io::Unit::centimetre, io::Unit::foot, io::Unit::millimetre});
  pipeline::Options options;
  options.scan_unit = io::Unit::metre;
  options.scan_units = {"scan_01:inch", "scan_02.ply:cm", mixed[3] + ":foot", "scan_04:mm"};
  // A viewpoint is in the unit of its scan, too; the origin is the same in all of them.
  options.viewpoint = "0,0,0";
  expect_same(detected(base_ / "model.ply", mixed, options, "mixed_result"), expected);

  options.scan_units = {"scan_17:inch"};
  const auto refused =
      pipeline::detect((base_ / "model.ply").string(), mixed, options, {base_ / "no", false, {}}, Context(2));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::invalid_argument);
}

TEST_F(Units, TheFrameInInchAndScansInMetresGiveWhatMillimetresGive) {
  const fs::path cad = fs::path(ASBUILT_DATA_DIR) / "cad";
  if (!fs::exists(cad / "frame.step")) GTEST_SKIP() << "no " << cad;
  const auto mesh = io::read_mesh(cad / "frame.stl", io::Unit::millimetre);
  ASSERT_TRUE(mesh) << mesh.error().message;
  simulate_scans(*mesh, {.scans = 3, .points = 60000, .seed = 7, .as_built = {}});
  const auto scans_in_mm = written("mm", {io::Unit::millimetre});
  pipeline::Options options;
  options.scan_unit = io::Unit::metre;
  const auto found = detected(cad / "frame.step", written("m", {io::Unit::metre}), options, "inch_and_m");
  expect_same(found, detected(cad / "frame.step", scans_in_mm, {}, "inch_and_mm"));
  // Another tessellation is sampled at other places, of which poses detected from few points feel a little.
  expect_same(found, detected(cad / "frame.stl", scans_in_mm, {}, "all_mm"), 0.75);
}

}  // namespace
}  // namespace asbuilt
