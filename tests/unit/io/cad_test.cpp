// SPDX-License-Identifier: Apache-2.0
// CAD files are written by OpenCASCADE here, of shapes whose size, area and faces are known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <set>

#include "asbuilt/io/mesh_file.h"
#include "asbuilt/io/readers.h"
#include "unit/io/temporary_folder.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wconversion"
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <IGESControl_Writer.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <STEPControl_Controller.hxx>
#include <STEPControl_Writer.hxx>
#include <TopoDS_Compound.hxx>
#pragma GCC diagnostic pop

namespace asbuilt::io {
namespace {

using test::TemporaryFolder;
using ::testing::Contains;
using ::testing::HasSubstr;

const std::filesystem::path kCad = std::filesystem::path(ASBUILT_DATA_DIR) / "cad";

std::filesystem::path step_of(const TopoDS_Shape& shape, const TemporaryFolder& folder, const char* unit = "MM") {
  Message::DefaultMessenger()->ChangePrinters().Clear();
  // The writer learns its unit when it is made.
  STEPControl_Controller::Init();
  Interface_Static::SetCVal("write.step.unit", unit);
  STEPControl_Writer writer;
  writer.Transfer(shape, STEPControl_AsIs);
  auto path = folder.path() / "shape.step";
  EXPECT_EQ(writer.Write(path.c_str()), IFSelect_RetDone);
  return path;
}

TopoDS_Shape box(double x, double y, double z) { return BRepPrimAPI_MakeBox(x, y, z).Shape(); }

/// Volume inside the mesh by the divergence theorem: positive where all triangles are turned outwards.
double volume(const TriangleMesh& mesh) {
  double six_volumes = 0.0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    six_volumes += doubled_area_vector(mesh, i).dot(mesh.vertices[static_cast<std::size_t>(mesh.triangles[i][0])]);
  }
  return six_volumes / 6.0;
}

std::string content_of(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(Step, ABoxIsTwelveTrianglesOnSixFaces) {
  const TemporaryFolder folder;
  const auto model = read_model(step_of(box(10, 20, 30), folder), Unit::stated);
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_TRUE(model->is_cad);
  EXPECT_EQ(model->mesh.triangles.size(), 12u);
  EXPECT_EQ(model->cad_faces, 6u);
  EXPECT_EQ(model->cad_parts, 1u);
  ASSERT_EQ(model->mesh.cad_faces.size(), 12u);
  EXPECT_EQ(std::set<int>(model->mesh.cad_faces.begin(), model->mesh.cad_faces.end()).size(), 6u);
  EXPECT_NEAR(volume(model->mesh), 6000.0, 1e-6);
  EXPECT_TRUE(bounding_box(model->mesh).sizes().isApprox(Eigen::Vector3d(10, 20, 30), 1e-9));
}

TEST(Step, UnitsThatTheFileStatesAreHonouredAndOverridden) {
  const TemporaryFolder folder;
  // The writer converts: 254 mm stand in the file as 10.
  const auto path = step_of(box(254, 254, 254), folder, "INCH");
  const auto stated = read_model(path, Unit::stated);
  ASSERT_TRUE(stated) << stated.error().message;
  EXPECT_EQ(stated->unit, Unit::inch);
  EXPECT_NEAR(bounding_box(stated->mesh).sizes().x(), 254.0, 1e-6);
  const auto overridden = read_model(path, Unit::millimetre);
  ASSERT_TRUE(overridden) << overridden.error().message;
  EXPECT_NEAR(bounding_box(overridden->mesh).sizes().x(), 10.0, 1e-6);
  EXPECT_THAT(overridden->notes, Contains(HasSubstr("as you said")));
}

TEST(Step, PartsOfAnAssemblyStandWhereItPlacesThemAndCountOnceEach) {
  gp_Trsf there;
  there.SetTranslation(gp_Vec(100, 0, 0));
  const TopoDS_Shape part = box(10, 20, 30);
  TopoDS_Compound assembly;
  BRep_Builder builder;
  builder.MakeCompound(assembly);
  builder.Add(assembly, part);
  builder.Add(assembly, part.Moved(there));
  const TemporaryFolder folder;
  const auto model = read_model(step_of(assembly, folder), Unit::stated);
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(model->cad_parts, 2u);
  EXPECT_EQ(model->cad_faces, 12u);
  EXPECT_NEAR(volume(model->mesh), 12000.0, 1e-6);
  EXPECT_TRUE(bounding_box(model->mesh).sizes().isApprox(Eigen::Vector3d(110, 20, 30), 1e-9));
}

TEST(Step, TessellationKeepsItsToleranceRelativeToTheSize) {
  for (const double radius : {0.5, 500.0}) {
    const TemporaryFolder folder;
    const auto path = step_of(BRepPrimAPI_MakeCylinder(radius, 2 * radius).Shape(), folder);
    for (const double tolerance : {1e-4, 1e-3}) {
      ModelReadOptions options;
      options.tessellation_tolerance = tolerance;
      const auto model = read_model(path, options);
      ASSERT_TRUE(model) << model.error().message;
      const double allowed = tolerance * std::sqrt(12.0) * radius;
      // Middles of edges stray furthest from a cylinder; those on its axis-parallel lines do not at all.
      for (const Eigen::Vector3i& t : model->mesh.triangles) {
        for (int k = 0; k < 3; ++k) {
          const Eigen::Vector3d& a = model->mesh.vertices[static_cast<std::size_t>(t[k])];
          const Eigen::Vector3d& b = model->mesh.vertices[static_cast<std::size_t>(t[(k + 1) % 3])];
          const bool on_wall = a.head<2>().norm() > 0.999 * radius && b.head<2>().norm() > 0.999 * radius &&
                               std::abs(a.z() - b.z()) > 1e-9 * radius;
          if (on_wall) {
            EXPECT_LE(radius - (0.5 * (a + b)).head<2>().norm(), 1.2 * allowed);
          }
        }
      }
      EXPECT_NEAR(volume(model->mesh), 2.0 * std::numbers::pi * std::pow(radius, 3), 0.03 * std::pow(radius, 3));
    }
  }
}

TEST(Step, CutAnywhereIsAnError) {
  const TemporaryFolder folder;
  const std::string whole = content_of(step_of(box(10, 20, 30), folder));
  const std::size_t end = whole.rfind("END-ISO-10303-21");
  // The end mark itself counts, but for the semicolon behind it.
  for (std::size_t length = 0; length < end + std::string("END-ISO-10303-21").size(); ++length) {
    const auto model = model_from("cut.step", {"cut.step", std::string_view(whole).substr(0, length)}, Unit::stated);
    ASSERT_FALSE(model) << length;
    EXPECT_THAT(model.error().message, HasSubstr("cut.step"));
  }
}

TEST(Brep, IsReadInMillimetres) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "shape.brep";
  BRepTools::Write(box(10, 20, 30), path.c_str());
  const auto model = read_model(path, Unit::stated);
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_NEAR(volume(model->mesh), 6000.0, 1e-6);
}

TEST(Brep, CutAnywhereIsAnErrorOrTheWholeShape) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "shape.brep";
  BRepTools::Write(box(10, 20, 30), path.c_str());
  const std::string whole = content_of(path);
  std::size_t last_error = 0;
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const auto model = model_from("cut.brep", {"cut.brep", std::string_view(whole).substr(0, length)}, Unit::stated);
    if (!model) last_error = length;
    if (model) {
      EXPECT_NEAR(volume(model->mesh), 6000.0, 1e-6) << length << " of " << whole.size();
    }
  }
  EXPECT_GE(last_error + 4, whole.size()) << "more is missing than blanks behind the last number";
}

std::filesystem::path iges_cube(const TemporaryFolder& folder) {
  auto path = folder.path() / "shape.igs";
  IGESControl_Writer writer("IN", 1);  // as solids
  EXPECT_TRUE(writer.AddShape(box(254, 254, 254)));
  writer.ComputeModel();
  EXPECT_TRUE(writer.Write(path.c_str()));
  return path;
}

TEST(Iges, CutAnywhereIsAnError) {
  const TemporaryFolder folder;
  const std::string whole = content_of(iges_cube(folder));
  // The mark of section T stands in column 73 of the last line; behind it are but digits that count the lines.
  const std::size_t mark = whole.rfind('T');
  ASSERT_EQ(whole.find_last_not_of("\r\n"), mark + 7);
  for (std::size_t length = 0; length <= mark; ++length) {
    const auto model = model_from("cut.igs", {"cut.igs", std::string_view(whole).substr(0, length)}, Unit::stated);
    ASSERT_FALSE(model) << length << " of " << whole.size();
    EXPECT_THAT(model.error().message, HasSubstr("cut.igs"));
  }
}

TEST(Iges, IsReadInTheUnitThatItStates) {
  const TemporaryFolder folder;
  const auto path = iges_cube(folder);
  const auto model = read_model(path, Unit::stated);
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(model->format, "iges");
  EXPECT_NEAR(bounding_box(model->mesh).sizes().x(), 254.0, 1e-4);
}

// The same parts, meshed by another program.
TEST(StepOfOtherSoftware, HasTheSizeAndVolumeOfItsMesh) {
  if (!std::filesystem::exists(kCad)) GTEST_SKIP() << kCad << " is not there";
  for (const char* name : {"linkrod", "screw_sym", "frame"}) {
    const auto step = read_model(kCad / (std::string(name) + ".step"), Unit::stated);
    const auto mesh = read_model(kCad / (std::string(name) + ".stl"), Unit::stated);
    ASSERT_TRUE(step) << step.error().message;
    ASSERT_TRUE(mesh) << mesh.error().message;
    const Eigen::Vector3d expected = bounding_box(mesh->mesh).sizes();
    EXPECT_LT((bounding_box(step->mesh).sizes() - expected).norm(), 2e-3 * expected.norm()) << name;
    EXPECT_NEAR(volume(step->mesh), volume(mesh->mesh), 0.01 * std::abs(volume(mesh->mesh))) << name;
  }
  EXPECT_EQ(read_model(kCad / "frame.step", Unit::stated)->unit, Unit::inch);
}

}  // namespace
}  // namespace asbuilt::io
