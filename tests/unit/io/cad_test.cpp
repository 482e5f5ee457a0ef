// SPDX-License-Identifier: Apache-2.0
// CAD files are written by OpenCASCADE here, of shapes whose size, area and faces are known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>
#include <regex>
#include <set>
#include <sstream>

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

// One part in two places, 100 mm apart.
TopoDS_Compound two_boxes() {
  gp_Trsf there;
  there.SetTranslation(gp_Vec(100, 0, 0));
  const TopoDS_Shape part = box(10, 20, 30);
  TopoDS_Compound assembly;
  BRep_Builder builder;
  builder.MakeCompound(assembly);
  builder.Add(assembly, part);
  builder.Add(assembly, part.Moved(there));
  return assembly;
}

TEST(Step, PartsOfAnAssemblyStandWhereItPlacesThemAndCountOnceEach) {
  const TopoDS_Compound assembly = two_boxes();
  const TemporaryFolder folder;
  const auto model = read_model(step_of(assembly, folder), Unit::stated);
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(model->cad_parts, 2u);
  EXPECT_EQ(model->cad_faces, 12u);
  EXPECT_NEAR(volume(model->mesh), 12000.0, 1e-6);
  EXPECT_TRUE(bounding_box(model->mesh).sizes().isApprox(Eigen::Vector3d(110, 20, 30), 1e-9));
}

/// A STEP file whose faces bear names, as a text: the first string of every ADVANCED_FACE, in the order of the file.
std::string with_face_names(const std::string& step, const std::vector<std::string>& names) {
  std::string result;
  std::size_t from = 0, next = 0;
  const std::string empty = "ADVANCED_FACE('',";
  for (std::size_t at = step.find(empty); at != std::string::npos; at = step.find(empty, from)) {
    const std::string& name = next < names.size() ? names[next++] : std::string();
    result += step.substr(from, at - from) + "ADVANCED_FACE('" + name + "',";
    from = at + empty.size();
  }
  return result + step.substr(from);
}

/// The planes on which the named faces of a STEP text lie, told from the text alone: a place and a direction by name.
std::map<std::string, std::pair<Eigen::Vector3d, Eigen::Vector3d>> planes_by_name(std::string step) {
  std::erase(step, '\n');
  std::map<std::string, std::string> entities;
  const std::regex entity("#(\\d+) ?= ?([A-Z0-9_]+\\([^;]*\\));");
  for (std::sregex_iterator i(step.begin(), step.end(), entity), end; i != end; ++i) entities[(*i)[1]] = (*i)[2];
  const auto referred = [&](const std::string& text) {
    std::vector<std::string> found;
    const std::regex reference("#(\\d+)");
    for (std::sregex_iterator i(text.begin(), text.end(), reference), end; i != end; ++i) found.push_back((*i)[1]);
    return found;
  };
  const auto vector_of = [&](const std::string& id) {
    const std::string& text = entities.at(id);
    std::string numbers = text.substr(text.rfind('(') + 1);
    for (char& c : numbers) c = c == ',' || c == ')' ? ' ' : c;
    std::istringstream stream(numbers);
    Eigen::Vector3d v;
    stream >> v.x() >> v.y() >> v.z();
    return v;
  };
  std::map<std::string, std::pair<Eigen::Vector3d, Eigen::Vector3d>> planes;
  for (const auto& [id, text] : entities) {
    if (!text.starts_with("ADVANCED_FACE('")) continue;
    const std::string name = text.substr(15, text.find("',") - 15);
    const std::string plane = referred(text.substr(text.find("),"))).front();
    const auto axes = referred(entities.at(referred(entities.at(plane)).front()));
    planes[name] = {vector_of(axes[0]), vector_of(axes[1])};
  }
  return planes;
}

TEST(Step, FacesKeepTheNamesThatTheFileGivesThem) {
  const TemporaryFolder folder;
  const std::string plain = content_of(step_of(box(10, 20, 30), folder));
  const std::vector<std::string> names{"bore A", "rim", "lid", "foot", "left", "right"};
  const std::string named = with_face_names(plain, names);
  const auto path = folder.file("named.step", named);
  const auto model = read_model(path, Unit::stated);
  ASSERT_TRUE(model) << model.error().message;
  ASSERT_EQ(model->face_names.size(), 6u);
  const auto planes = planes_by_name(named);
  ASSERT_EQ(planes.size(), 6u);
  for (std::size_t t = 0; t < model->mesh.triangles.size(); ++t) {
    const CadFaceName& face = model->face_names[static_cast<std::size_t>(model->mesh.cad_faces[t])];
    EXPECT_EQ(face.part, "");  // one part only
    ASSERT_TRUE(planes.contains(face.name)) << face.name;
    const auto& [place, direction] = planes.at(face.name);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d& corner = model->mesh.vertices[static_cast<std::size_t>(model->mesh.triangles[t][k])];
      EXPECT_NEAR((corner - place).dot(direction), 0.0, 1e-9) << face.name;
    }
  }
}

TEST(Step, FileThatNamesNoFaceHasNoNames) {
  const TemporaryFolder folder;
  const auto path = step_of(box(10, 20, 30), folder);
  EXPECT_TRUE(read_model(path, Unit::stated).value().face_names.empty());
  const std::string none = with_face_names(content_of(path), {"NONE", "", " ", "none", "NONE", "NONE"});
  EXPECT_TRUE(read_model(folder.file("none.step", none), Unit::stated).value().face_names.empty());
}

TEST(Step, HostileNamesOfFacesAreHarmless) {
  const TemporaryFolder folder;
  const std::string longest(3000, 'x');
  const std::vector<std::string> names{
      "it''s \"quoted\"", "<script>alert(1)</script>", R"(Dichtfl\X2\00E4\X0\che)", longest, "a,b;c)#1=(", "tab\there"};
  const auto path = folder.file("hostile.step", with_face_names(content_of(step_of(box(1, 2, 3), folder)), names));
  const auto model = read_model(path, Unit::stated);
  ASSERT_TRUE(model) << model.error().message;
  std::set<std::string> found;
  for (const CadFaceName& face : model->face_names) found.insert(face.name);
  EXPECT_TRUE(found.contains("it's \"quoted\""));
  EXPECT_TRUE(found.contains("<script>alert(1)</script>"));
  EXPECT_TRUE(found.contains("Dichtfläche"));
  EXPECT_TRUE(found.contains(longest.substr(0, 500)));
  EXPECT_TRUE(found.contains("a,b;c)#1=("));
  EXPECT_EQ(found.size(), 6u);
}

TEST(Step, FacesOfAnAssemblyKnowTheirPart) {
  TopoDS_Compound assembly = two_boxes();
  BRep_Builder().Add(assembly, BRepPrimAPI_MakeCylinder(3.0, 40.0).Shape());
  const TemporaryFolder folder;
  Interface_Static::SetIVal("write.step.assembly", 1);
  const std::string step = content_of(step_of(assembly, folder));
  Interface_Static::SetIVal("write.step.assembly", 0);
  const std::regex product("PRODUCT\\('([^']*)', *'([^']*)'");
  std::set<std::string> called;
  std::string text = step;
  std::erase(text, '\n');  // lines end within strings, too
  for (std::sregex_iterator i(text.begin(), text.end(), product), end; i != end; ++i) called.insert((*i)[2]);
  const auto model = read_model(folder.file("assembly.step", step), Unit::stated);
  ASSERT_TRUE(model) << model.error().message;
  ASSERT_EQ(model->face_names.size(), 15u);
  std::map<std::string, std::set<int>> where;  // by the part's name: which of the two kinds of faces
  for (std::size_t t = 0; t < model->mesh.triangles.size(); ++t) {
    const CadFaceName& face = model->face_names[static_cast<std::size_t>(model->mesh.cad_faces[t])];
    EXPECT_TRUE(called.contains(face.part)) << face.part;
    double furthest = 0.0;  // the cylinder stands about the z axis, no face of a box lies within 3 mm of it all over
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d& corner = model->mesh.vertices[static_cast<std::size_t>(model->mesh.triangles[t][k])];
      furthest = std::max(furthest, corner.head<2>().norm());
    }
    where[face.part].insert(furthest < 3.5 ? 1 : 0);
  }
  ASSERT_EQ(where.size(), 2u);
  EXPECT_NE(where.begin()->second, std::next(where.begin())->second);
  for (const auto& [name, kinds] : where) EXPECT_EQ(kinds.size(), 1u) << name;
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
