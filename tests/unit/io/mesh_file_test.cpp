// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/mesh_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "asbuilt/io/scan_file.h"
#include "unit/io/bytes.h"
#include "unit/io/temporary_folder.h"

namespace asbuilt::io {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using Eigen::Vector3i;
using test::little;
using test::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class MeshFile : public ::testing::Test {
 protected:
  TriangleMesh read(const std::string& name, const std::string& content, Unit unit = Unit::stated) {
    auto mesh = read_mesh(folder_.file(name, content), unit);
    EXPECT_TRUE(mesh) << (mesh ? "" : mesh.error().message);
    return std::move(mesh.value());
  }
  std::string error_of(const std::string& name, const std::string& content) {
    const auto mesh = read_mesh(folder_.file(name, content), Unit::stated);
    if (mesh) return "no error";
    EXPECT_EQ(mesh.error().code, ErrorCode::unreadable_input);
    return mesh.error().message;
  }

  TemporaryFolder folder_;
};

std::string binary_stl(const std::string& title, std::uint32_t triangles, std::uint32_t declared) {
  std::string content = title + std::string(80 - title.size(), ' ') + little(declared);
  for (std::uint32_t t = 0; t < triangles; ++t) {
    const auto z = static_cast<float>(t);
    for (const float value : {0.f, 0.f, 1.f, 0.f, 0.f, z, 1.f, 0.f, z, 0.f, 1.5f, z}) content += little(value);
    content += little(std::uint16_t{0});
  }
  return content;
}

const std::string kAsciiStl =
    "solid part\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 0 1e0 0\n  endloop\n "
    "endfacet\nendsolid part\n";

TEST_F(MeshFile, ReadsBinaryStl) {
  const TriangleMesh mesh = read("a.stl", binary_stl("made by hand", 2, 2), Unit::inch);
  EXPECT_THAT(mesh.triangles, ElementsAre(Vector3i(0, 1, 2), Vector3i(3, 4, 5)));
  ASSERT_EQ(mesh.vertices.size(), 6u);
  EXPECT_EQ(mesh.vertices[5], Vector3d(0, 1.5 * 25.4, 25.4));
}

TEST_F(MeshFile, ABinaryStlThatBeginsWithSolidIsKnownByItsSize) {
  EXPECT_EQ(read("a.stl", binary_stl("solid facet normal", 3, 3)).triangles.size(), 3u);
  EXPECT_EQ(read("anything.xyz", binary_stl("solid", 1, 1)).triangles.size(), 1u);
  EXPECT_THAT(error_of("cut.stl", binary_stl("solid", 3, 4)), HasSubstr("the file ends after 3 of 4 triangles"));
}

TEST_F(MeshFile, ReadsAsciiStlInEitherCaseAndOfSeveralSolids) {
  const TriangleMesh mesh = read("a.stl", kAsciiStl +
                                              "SOLID two\nFACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX 0 0 5\nVERTEX 1 0 "
                                              "5\nVERTEX 0 1 5\nENDLOOP\nENDFACET\nENDSOLID\n");
  EXPECT_THAT(mesh.triangles, ElementsAre(Vector3i(0, 1, 2), Vector3i(3, 4, 5)));
  EXPECT_EQ(mesh.vertices[2], Vector3d(0, 1, 0));
  EXPECT_EQ(mesh.vertices[3], Vector3d(0, 0, 5));
}

TEST_F(MeshFile, DamagedStlIsRefused) {
  EXPECT_THAT(error_of("a.stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0\n"),
              HasSubstr("line 4: found '', expected 'vertex X Y Z'"));
  EXPECT_THAT(error_of("a.stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nendloop\n"),
              HasSubstr("line 5: a facet has 1 vertices, expected 3"));
  EXPECT_THAT(error_of("a.stl", "solid\nface 1\n"), HasSubstr("line 2: found 'face', expected facet"));
  EXPECT_THAT(error_of("a.stl", kAsciiStl.substr(0, kAsciiStl.find("endsolid"))),
              HasSubstr("after 1 triangles without 'endsolid'"));
  EXPECT_THAT(error_of("a.stl", "solid\nendsolid\n"), HasSubstr("no triangles"));
  EXPECT_THAT(error_of("a.stl", "short"), HasSubstr("5 bytes are too few"));
  EXPECT_THAT(error_of("a.stl", binary_stl("x", 2, 4'000'000'000u)), HasSubstr("after 2 of 4000000000 triangles"));
  EXPECT_THAT(error_of("a.stl", binary_stl("x", 0, 0)), HasSubstr("no triangles"));
}

TEST_F(MeshFile, ReadsOffWithCommentsColoursNormalsAndPolygons) {
  const auto quad = ElementsAre(Vector3i(0, 1, 2), Vector3i(0, 2, 3));
  const TriangleMesh off =
      read("a.off", "OFF # a square\n# comment\n4 1 0\n\n0 0 0\n1 0 0 # here\n1 1 0\n0 1 0\n4 0 1 2 3 0.5 0.5 0.5\n",
           Unit::metre);
  EXPECT_THAT(off.triangles, quad);
  EXPECT_EQ(off.vertices[2], Vector3d(1000, 1000, 0));
  EXPECT_THAT(read("b.off", "OFF 4 1 4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n").triangles, quad);
  EXPECT_THAT(
      read("c.off",
           "COFF\n4 1 0\n0 0 0 255 0 0 255\n1 0 0 255 0 0 255\n1 1 0 255 0 0 255\n0 1 0 255 0 0 255\n4 0 1 2 3\n")
          .triangles,
      quad);
  EXPECT_THAT(
      read("d.txt", "NOFF\r\n4 1 0\r\n0 0 0 0 0 1\r\n1 0 0 0 0 1\r\n1 1 0 0 0 1\r\n0 1 0 0 0 1\r\n4 0 1 2 3\r\n")
          .triangles,
      quad);
}

TEST_F(MeshFile, DamagedOffIsRefused) {
  const std::string head = "OFF\n3 1 0\n0 0 0\n1 0 0\n";
  EXPECT_THAT(error_of("a.off", "4OFF\n1 1 1\n"), HasSubstr("line 1: found '4OFF', expected OFF, COFF or NOFF"));
  EXPECT_THAT(error_of("a.off", "OFF BINARY\n"), HasSubstr("binary OFF is not supported"));
  EXPECT_THAT(error_of("a.off", "OFF\n"), HasSubstr("before the counts"));
  EXPECT_THAT(error_of("a.off", "OFF\n-3 1 0\n"), HasSubstr("line 2: found '-3 1 0', expected the counts"));
  EXPECT_THAT(error_of("a.off", head), HasSubstr("line 5: the file ends after 2 of 3 vertices"));
  EXPECT_THAT(error_of("a.off", head + "0 1\n"), HasSubstr("line 5: found '', expected three coordinates"));
  EXPECT_THAT(error_of("a.off", head + "0 1 0\n"), HasSubstr("line 6: the file ends after 0 of 1 faces"));
  EXPECT_THAT(error_of("a.off", head + "0 1 0\n3 0 1 3\n"),
              HasSubstr("line 6: face 0 names vertex 3, the file has 3 vertices"));
  EXPECT_THAT(error_of("a.off", head + "0 1 0\n3 0 1\n"), HasSubstr("corner 2 of 3 is '', expected a vertex index"));
  EXPECT_THAT(error_of("a.off", "OFF\n18446744073709551615 18446744073709551615 0\n"),
              HasSubstr("more than a mesh can index"));
  EXPECT_THAT(error_of("a.off", "OFF\n2000000000 18446744073709551615 0\n0 0 0\n"),
              HasSubstr("after 1 of 2000000000 vertices"));
  EXPECT_THAT(error_of("a.off", "OFF\n1 1 0\n0 0 0\n99999999999 0 0 0\n"), HasSubstr("corner 3 of 99999999999"));
}

TEST_F(MeshFile, ReadsObjWithNegativeIndicesPolygonsAndEveryFormOfCorner) {
  const TriangleMesh mesh =
      read("a.obj",
           "# square and triangle\nmtllib a.mtl\no part\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0 0.5 0.5 0.5\nv 0 1 0\nvt 0 "
           "0\nvn 0 0 1\n"
           "usemtl red\ns off\nf 1/1/1 2/1/1 \\\n 3/1 4\nf -4//1 -2//-1 -1 # back\nl 1 2\nv 2 0 0\nf 5 6 2\nv 2 1 0\n",
           Unit::foot);
  EXPECT_THAT(mesh.triangles, ElementsAre(Vector3i(0, 1, 2), Vector3i(0, 2, 3), Vector3i(0, 2, 3), Vector3i(4, 5, 1)));
  EXPECT_EQ(mesh.vertices[4], Vector3d(2 * 304.8, 0, 0));
}

TEST_F(MeshFile, DamagedObjIsRefused) {
  EXPECT_THAT(error_of("a.obj", "v 0 0\n"), HasSubstr("line 1: found '', expected 'v X Y Z'"));
  EXPECT_THAT(error_of("a.obj", "v 0 0 0\nv 1 0 0\nf 1 2\n"),
              HasSubstr("line 3: a face has 2 corners, expected at least 3"));
  EXPECT_THAT(error_of("a.obj", "v 0 0 0\nf 1 0 1\n"),
              HasSubstr("line 2: found '0', expected a vertex index, counted from 1"));
  EXPECT_THAT(error_of("a.obj", "v 0 0 0\nf 1 -2 1\n"),
              HasSubstr("line 2: index -2 reaches back beyond the 1 vertices"));
  EXPECT_THAT(error_of("a.obj", "v 0 0 0\nf 1 2 1\n"),
              HasSubstr("line 2: a face names vertex 2, the file has 1 vertices"));
  EXPECT_THAT(error_of("a.obj", "v 0 0 0\nf 1 a/b 1\n"), HasSubstr("found 'a/b'"));
  EXPECT_THAT(error_of("a.obj", "v 0 0 0\n"), HasSubstr("no triangles"));
  EXPECT_THAT(error_of("a.obj", "nothing at all"), HasSubstr("no triangles"));
  EXPECT_THAT(error_of("a.obj", "v 0 0 0\nf 1 9223372036854775807 -9223372036854775808\n"), HasSubstr("line 2"));
}

TEST_F(MeshFile, APointCloudIsNoMesh) {
  EXPECT_THAT(error_of("a.xyz", "1 2 3\n"), HasSubstr("is a scan, expected a model"));
  EXPECT_THAT(error_of("a.pcd", "FIELDS x y z\n"), HasSubstr("is a scan, expected a model"));
}

TEST_F(MeshFile, AMeshIsWelcomeAsAScan) {
  const auto stl = read_scans(folder_.file("scan.stl", kAsciiStl), Unit::metre);
  ASSERT_TRUE(stl);
  EXPECT_EQ(stl->at(0).format, "stl ascii");
  EXPECT_THAT(stl->at(0).cloud.positions, ElementsAre(Vector3f(0, 0, 0), Vector3f(1000, 0, 0), Vector3f(0, 1000, 0)));
  EXPECT_THAT(stl->at(0).notes, ElementsAre(HasSubstr("The file is a mesh")));
  EXPECT_EQ(read_scans(folder_.file("scan.obj", "v 1 2 3\n"), Unit::stated).value().at(0).cloud.size(), 1u);
  EXPECT_FALSE(read_scans(folder_.file("scan.obj", "vt 1 2 3\n"), Unit::stated));
  EXPECT_EQ(read_scans(folder_.file("scan.off", "OFF\n1 0 0\n1 2 3\n"), Unit::stated).value().at(0).cloud.size(), 1u);
}

}  // namespace
}  // namespace asbuilt::io
