// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "asbuilt/io/file.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/io/ply_writer.h"
#include "asbuilt/io/scan_file.h"
#include "unit/io/bytes.h"
#include "unit/io/scans.h"
#include "unit/io/temporary_folder.h"

namespace asbuilt::io {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using Eigen::Vector3i;
using test::big;
using test::error_of;
using test::little;
using test::only_scan;
using test::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(PlyScan, ReadsAsciiWithCommentsAndWindowsLineEnds) {
  const TemporaryFolder folder;
  const ScanFile scan =
      only_scan(folder.file("part.ply",
                            "ply\r\nformat ascii 1.0\r\ncomment made by hand\r\nobj_info x\r\nelement vertex 2\r\n"
                            "property float x\r\nproperty float y\r\nproperty float z\r\nend_header\r\n"
                            "1 2 3\r\n\r\n-4.5\t nan  6e1 \r\n"));
  EXPECT_EQ(scan.name, "part");
  EXPECT_EQ(scan.format, "ply ascii");
  ASSERT_EQ(scan.cloud.size(), 2u);
  EXPECT_EQ(scan.cloud.positions[0], Vector3f(1, 2, 3));
  EXPECT_EQ(scan.cloud.positions[1].x(), -4.5f);
  EXPECT_TRUE(std::isnan(scan.cloud.positions[1].y()));
  EXPECT_EQ(scan.cloud.positions[1].z(), 60.0f);
  EXPECT_FALSE(scan.cloud.has_normals());
  EXPECT_FALSE(scan.viewpoint_mm);
  EXPECT_EQ(scan.offset_mm, Vector3d::Zero());
  EXPECT_THAT(scan.notes, IsEmpty());
}

/// A vertex element whose x has the type under test, between a short and a list, after another element.
template <class T>
void expect_type_is_read(const std::string& type_name, const T value) {
  const TemporaryFolder folder;
  for (const bool big_endian : {false, true}) {
    const auto put = [&](auto number) { return big_endian ? big(number) : little(number); };
    std::string content =
        std::string("ply\nformat ") + (big_endian ? "binary_big_endian" : "binary_little_endian") +
        " 1.0\nelement camera 2\nproperty list uchar short sizes\nproperty double f\nelement vertex 2\n"
        "property short flag\nproperty double z\nproperty " +
        type_name + " x\nproperty float y\nend_header\n";
    content += put(std::uint8_t{2}) + put(std::int16_t{7}) + put(std::int16_t{8}) + put(1.0);
    content += put(std::uint8_t{0}) + put(2.0);
    content += put(std::int16_t{1}) + put(30.0) + put(value) + put(2.5f);
    content += put(std::int16_t{2}) + put(-3.0) + put(T{1}) + put(-2.5f);
    const ScanFile scan = only_scan(folder.file("typed.ply", content));
    EXPECT_EQ(scan.format, big_endian ? "ply binary_big_endian" : "ply binary_little_endian");
    ASSERT_EQ(scan.cloud.size(), 2u);
    EXPECT_EQ(scan.cloud.positions[0], Vector3f(static_cast<float>(value), 2.5f, 30.0f)) << type_name;
    EXPECT_EQ(scan.cloud.positions[1], Vector3f(1.0f, -2.5f, -3.0f)) << type_name;
    EXPECT_THAT(scan.notes, IsEmpty());
  }
}

TEST(PlyScan, ReadsEveryScalarTypeUnderBothOfItsNamesInBothByteOrders) {
  for (const char* name : {"char", "int8"}) expect_type_is_read<std::int8_t>(name, -128);
  for (const char* name : {"uchar", "uint8"}) expect_type_is_read<std::uint8_t>(name, 255);
  for (const char* name : {"short", "int16"}) expect_type_is_read<std::int16_t>(name, -32768);
  for (const char* name : {"ushort", "uint16"}) expect_type_is_read<std::uint16_t>(name, 65535);
  for (const char* name : {"int", "int32"}) expect_type_is_read<std::int32_t>(name, -65000);
  for (const char* name : {"uint", "uint32"}) expect_type_is_read<std::uint32_t>(name, 65000);
  for (const char* name : {"float", "float32"}) expect_type_is_read<float>(name, -1.25e-3f);
  for (const char* name : {"double", "float64"}) expect_type_is_read<double>(name, 1.0 / 1024);
}

TEST(PlyScan, ReadsVerticesThatHoldLists) {
  const TemporaryFolder folder;
  std::string content =
      "ply\nformat binary_big_endian 1.0\nelement vertex 2\nproperty float x\nproperty list int double weights\n"
      "property float y\nproperty float z\nend_header\n";
  content += big(1.0f) + big(std::int32_t{2}) + big(9.0) + big(8.0) + big(2.0f) + big(3.0f);
  content += big(4.0f) + big(std::int32_t{0}) + big(5.0f) + big(6.0f);
  EXPECT_THAT(only_scan(folder.file("a.ply", content)).cloud.positions,
              ElementsAre(Vector3f(1, 2, 3), Vector3f(4, 5, 6)));

  const std::string ascii =
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty list int double weights\n"
      "property float y\nproperty float z\nend_header\n1 2 9 8 2 3\n4 0 5 6\n";
  EXPECT_THAT(only_scan(folder.file("b.ply", ascii)).cloud.positions,
              ElementsAre(Vector3f(1, 2, 3), Vector3f(4, 5, 6)));
}

TEST(PlyScan, TakesNormalsUnderBothNamesAsTheyAre) {
  const TemporaryFolder folder;
  for (const std::string prefix : {"n", "normal_"}) {
    const std::string content = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float " + prefix +
                                "z\nproperty float " + prefix + "y\nproperty float " + prefix +
                                "x\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3 4 5 6\n";
    const ScanFile scan = only_scan(folder.file("n.ply", content), Unit::metre);
    EXPECT_THAT(scan.cloud.normals, ElementsAre(Vector3f(3, 2, 1)));  // no unit, no length of one
    EXPECT_THAT(scan.cloud.positions, ElementsAre(Vector3f(4000, 5000, 6000)));
  }
}

TEST(PlyScan, TakesTheVerticesOfAMeshAndTellsWhenItsFacesAreCutOff) {
  const TemporaryFolder folder;
  const std::string content =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  const ScanFile whole = only_scan(folder.file("whole.ply", content));
  EXPECT_EQ(whole.cloud.size(), 3u);
  EXPECT_THAT(whole.notes, IsEmpty());
  const ScanFile cut = only_scan(folder.file("cut.ply", content.substr(0, content.size() - 4)));
  EXPECT_EQ(cut.cloud.size(), 3u);
  EXPECT_THAT(cut.notes, ElementsAre(HasSubstr("The points are complete, what follows them is not")));
}

TEST(PlyScan, ConvertsUnitsInDouble) {
  const TemporaryFolder folder;
  const auto path = folder.file("inch.ply",
                                "ply\nformat ascii 1.0\nelement vertex 1\nproperty double x\nproperty double y\n"
                                "property double z\nend_header\n1 -0.5 0.1\n");
  EXPECT_THAT(only_scan(path, Unit::inch).cloud.positions, ElementsAre(Vector3f(25.4f, -12.7f, 2.54f)));
  EXPECT_THAT(only_scan(path, Unit::stated).cloud.positions, ElementsAre(Vector3f(1.0f, -0.5f, 0.1f)));
}

TEST(PlyScan, TakesAnOffsetOffLargeCoordinatesBeforeTheyBecomeFloat) {
  const TemporaryFolder folder;
  std::string content =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double "
      "z\nend_header\n";
  // Metres in a national grid: 0.1 mm apart, which float could not tell from one another (its step is 0.25 m there).
  const double east = 3'500'000.0, north = 5'400'000.0;
  for (const double step : {0.0, 0.0001, 0.0002}) content += little(east + step) + little(north) + little(12.5);
  const ScanFile scan = only_scan(folder.file("grid.ply", content), Unit::metre);
  EXPECT_EQ(scan.offset_mm.z(), 0.0);
  for (int i = 0; i < 3; ++i) {
    const Vector3d back = scan.cloud.positions[static_cast<std::size_t>(i)].cast<double>() + scan.offset_mm;
    // Half a step of double at 5.4e9 mm is 5e-7, the rest is float within a metre of the offset.
    EXPECT_NEAR(back.x(), east * 1000 + 0.1 * i, 1e-3);
    EXPECT_NEAR(back.y(), north * 1000, 1e-3);
    EXPECT_EQ(back.z(), 12500.0);
  }
  EXPECT_THAT(scan.notes, ElementsAre(HasSubstr("was taken off")));
}

TEST(PlyScan, MarksMissingReturnsBeforeAnOffsetHidesThem) {
  const TemporaryFolder folder;
  const auto path =
      folder.file("far.ply",
                  "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n"
                  "end_header\n1e6 1e6 0\n0 0 0\n1e6 1000001 0\n");
  const ScanFile scan = only_scan(path);
  EXPECT_TRUE(scan.cloud.positions[1].array().isNaN().all());
  EXPECT_EQ(scan.offset_mm, Vector3d(1e6, 1e6, 0));
  EXPECT_THAT(scan.cloud.positions[2], Vector3f(0, 1, 0));
  EXPECT_THAT(scan.notes, ::testing::Contains(HasSubstr("1 points at exactly (0, 0, 0)")));
}

TEST(PlyScan, ErrorsNameThePlaceAndWhatWasExpected) {
  const TemporaryFolder folder;
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  const auto message = [&](const std::string& content) { return error_of(folder.file("bad.ply", content)); };
  EXPECT_THAT(message("ply\nformat ascii 2.0\n"), HasSubstr("bad.ply, line 2: format version is '2.0', expected 1.0"));
  EXPECT_THAT(message("ply\nformat text 1.0\n"), HasSubstr("line 2: format is 'text', expected ascii"));
  EXPECT_THAT(message("ply\nformat ascii 1.0\nelement vertex -1\n"),
              HasSubstr("line 3: element 'vertex' has the count '-1'"));
  EXPECT_THAT(message("ply\nformat ascii 1.0\nelement vertex 1\nproperty half x\n"),
              HasSubstr("line 4: property type is 'half'"));
  EXPECT_THAT(message("ply\nformat ascii 1.0\nelement vertex 1\nproperty list float int x\n"),
              HasSubstr("counted in 'float', expected an integer"));
  EXPECT_THAT(message("ply\nformat ascii 1.0\nproperty float x\n"), HasSubstr("line 3: a property stands before"));
  EXPECT_THAT(message("ply\nformat ascii 1.0\nvertices 3\n"),
              HasSubstr("line 3: found 'vertices', expected format, element"));
  EXPECT_THAT(message("ply\nformat ascii 1.0\n"), HasSubstr("line 3: the file ends within the PLY header"));
  EXPECT_THAT(message("ply\nelement vertex 1\n" + xyz + "end_header\n1 2 3\n"), HasSubstr("no line 'format'"));
  EXPECT_THAT(message("ply\nformat ascii 1.0\nelement face 0\nend_header\n"), HasSubstr("no element 'vertex'"));
  EXPECT_THAT(message("ply\nformat ascii 1.0\nelement vertex 0\n" + xyz + "end_header\n"), HasSubstr("0 vertices"));
  EXPECT_THAT(message("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n"),
              HasSubstr("no properties x, y and z"));
  const std::string head = "ply\nformat ascii 1.0\nelement vertex 2\n" + xyz + "end_header\n";
  EXPECT_THAT(message(head + "1 2 3\n1 2\n"),
              HasSubstr("line 9: row 1 of 'vertex' has 2 values, the header declares more"));
  EXPECT_THAT(message(head + "1 2 3\n1 2 3 4\n"), HasSubstr("line 9: row 1 of 'vertex' has more than the 3 values"));
  EXPECT_THAT(message(head + "1 2 3\n1 2 z\n"), HasSubstr("line 9: found 'z', expected a number"));
  EXPECT_THAT(message(head + "1 2 3\n"), HasSubstr("line 9: the file ends after 1 of 2 rows of element 'vertex'"));
}

TEST(PlyScan, ABinaryFileCutOffSaysHowManyPointsOfHowManyItHas) {
  const TemporaryFolder folder;
  const std::string head =
      "ply\nformat binary_little_endian 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float "
      "z\nend_header\n";
  const std::string content = head + std::string(3 * 12 + 11, '\1');
  EXPECT_THAT(error_of(folder.file("cut.ply", content)),
              HasSubstr("cut.ply, byte " + std::to_string(content.size()) +
                        ": the file ends after 3 of 5 rows of element 'vertex'"));
}

TEST(PlyScan, HostileCountsAreRefusedWithoutTakingMemory) {
  const TemporaryFolder folder;
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  for (const std::string format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    for (const std::string count : {"1000000000000", "18446744073709551615", "1537228672809129302"}) {
      const std::string content =
          "ply\nformat " + format + " 1.0\nelement vertex " + count + "\n" + xyz + "end_header\n1 2 3\n";
      EXPECT_THAT(error_of(folder.file("a.ply", content)), HasSubstr("of " + count + " rows"));
      const std::string nothing = "ply\nformat " + format + " 1.0\nelement nothing " + count + "\nelement vertex " +
                                  count + "\nproperty list uint int a\n" + xyz + "end_header\n\xff\xff\xff\xff";
      EXPECT_NE(error_of(folder.file("b.ply", nothing)), "no error");
      const std::string empty = "ply\nformat " + format + " 1.0\nelement vertex " + count + "\nend_header\n1 2 3\n";
      EXPECT_THAT(error_of(folder.file("c.ply", empty)), HasSubstr("no properties x, y and z"));
    }
  }
}

TEST(PlyScan, BytesBehindTheLastElementAreWorthANote) {
  const TemporaryFolder folder;
  const std::string content =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
      "z\nend_header\n" +
      std::string(12, '\0') + "more";
  EXPECT_THAT(only_scan(folder.file("more.ply", content)).notes, ElementsAre(HasSubstr("4 bytes follow")));
}

std::string two_quads(const std::string& format, const std::string& index_name) {
  return "ply\nformat " + format +
         " 1.0\nelement vertex 6\nproperty double x\nproperty double y\nproperty double z\nelement face 2\n"
         "property uchar red\nproperty list uchar uint " +
         index_name + "\nproperty list uchar float uv\nend_header\n";
}

TEST(PlyMesh, SplitsPolygonsIntoFansInEveryEncoding) {
  const TemporaryFolder folder;
  std::string ascii = two_quads("ascii", "vertex_index") +
                      "0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0 0\n2 1 0\n255 4 0 1 2 3 0\n0 5 1 4 5 2 0 2 0.5 0.5\n";
  std::string little_endian = two_quads("binary_little_endian", "vertex_indices"),
              big_endian = two_quads("binary_big_endian", "vertex_indices");
  const auto put = [&](auto value) {
    little_endian += little(value);
    big_endian += big(value);
  };
  for (const double v : {0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0., 2., 0., 0., 2., 1., 0.}) put(v);
  put(std::uint8_t{255}), put(std::uint8_t{4});
  for (const std::uint32_t i : {0u, 1u, 2u, 3u}) put(i);
  put(std::uint8_t{0});
  put(std::uint8_t{0}), put(std::uint8_t{5});
  for (const std::uint32_t i : {1u, 4u, 5u, 2u, 0u}) put(i);
  put(std::uint8_t{2}), put(0.5f), put(0.5f);

  for (const std::string& content : {ascii, little_endian, big_endian}) {
    const auto mesh = read_mesh(folder.file("quads.ply", content), Unit::centimetre);
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_EQ(mesh->vertices.size(), 6u);
    EXPECT_EQ(mesh->vertices[5], Vector3d(20, 10, 0));
    EXPECT_THAT(mesh->triangles, ElementsAre(Vector3i(0, 1, 2), Vector3i(0, 2, 3), Vector3i(1, 4, 5), Vector3i(1, 5, 2),
                                             Vector3i(1, 2, 0)));
  }
}

TEST(PlyMesh, RefusesFacesWithoutVerticesAndMeshesWithoutFaces) {
  const TemporaryFolder folder;
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string points = "end_header\n0 0 0\n1 0 0\n0 1 0\n";
  const auto message = [&](const std::string& rest, const std::string& values) {
    const auto mesh = read_mesh(folder.file("bad.ply", head + rest + points + values), Unit::stated);
    return mesh ? std::string("no error") : mesh.error().message;
  };
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\n";
  EXPECT_THAT(message("", ""), HasSubstr("no element 'face'"));
  EXPECT_THAT(message(faces, "3 0 1 3\n"), HasSubstr("face 0 names vertex 3, the file has 3 vertices"));
  EXPECT_THAT(message(faces, "3 0 1 -1\n"), HasSubstr("face 0 names vertex -1"));
  EXPECT_THAT(message(faces, "3 0 1 1.5\n"), HasSubstr("expected an integer"));
  EXPECT_THAT(message(faces, "-3 0 1 2\n"), HasSubstr("a list has -3 entries"));
  EXPECT_THAT(message(faces, "2 0 1\n"), HasSubstr("no triangles"));
  EXPECT_THAT(message("element face 1\nproperty int vertex_indices\n", "1\n"),
              HasSubstr("no list property vertex_indices"));
  EXPECT_THAT(message(faces, ""), HasSubstr("after 0 of 1 rows of element 'face'"));
}

TEST(PlyWriter, WritesTheBytesThatTheFormatPrescribes) {
  const TemporaryFolder folder;
  const std::vector<float> x{1.5f, -2.0f};
  const std::vector<std::uint16_t> scan{7, 65535};
  const std::vector<double> sigma{0.1, 0.2};
  const std::vector<std::uint8_t> flag{1, 0};
  const std::vector<std::int32_t> id{-5, 6};
  const std::vector<PlyColumn> columns{{"x", std::span(x)},
                                       {"scan", std::span(scan)},
                                       {"sigma", std::span(sigma)},
                                       {"flag", std::span(flag)},
                                       {"id", std::span(id)}};
  const std::vector<std::string> comments{"unit mm"};
  const auto path = folder.path() / "out.ply";
  ASSERT_TRUE(write_ply(path, columns, comments));
  EXPECT_EQ(read_file(path).value(),
            "ply\nformat binary_little_endian 1.0\ncomment unit mm\nelement vertex 2\nproperty float x\nproperty "
            "ushort scan\n"
            "property double sigma\nproperty uchar flag\nproperty int id\nend_header\n" +
                little(1.5f) + little(std::uint16_t{7}) + little(0.1) + little(std::uint8_t{1}) +
                little(std::int32_t{-5}) + little(-2.0f) + little(std::uint16_t{65535}) + little(0.2) +
                little(std::uint8_t{0}) + little(std::int32_t{6}));

  const PlyVertices back = read_ply_vertices(path).value();
  EXPECT_THAT(back.names, ElementsAre("x", "scan", "sigma", "flag", "id"));
  EXPECT_THAT(*back.find("sigma"), ElementsAre(0.1, 0.2));
  EXPECT_THAT(*back.find("scan"), ElementsAre(7.0, 65535.0));
  EXPECT_EQ(back.find("none"), nullptr);
}

TEST(PlyWriter, ChecksItsPreconditions) {
  const TemporaryFolder folder;
  const std::vector<float> two{1, 2}, one{1};
  const auto path = folder.path() / "out.ply";
  EXPECT_THROW((void)write_ply(path, std::vector<PlyColumn>{{"x", std::span(two)}, {"y", std::span(one)}}),
               std::logic_error);
  EXPECT_THROW((void)write_ply(path, std::vector<PlyColumn>{{"two words", std::span(two)}}), std::logic_error);
  EXPECT_THROW(
      (void)write_ply(path, std::vector<PlyColumn>{{"x", std::span(two)}}, std::vector<std::string>{"a\nend_header"}),
      std::logic_error);
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(PlyWriter, AMeshComesBackBitByBit) {
  const TemporaryFolder folder;
  TriangleMesh mesh;
  mesh.vertices = {{0.1, 1.0 / 3.0, -1e-300}, {1e12, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  mesh.triangles = {{0, 1, 2}, {3, 2, 1}};
  const auto path = folder.path() / "mesh.ply";
  ASSERT_TRUE(write_mesh_ply(path, mesh));
  const TriangleMesh back = read_mesh(path, Unit::stated).value();
  EXPECT_EQ(back.vertices, mesh.vertices);
  EXPECT_EQ(back.triangles, mesh.triangles);
}

TEST(PlyVertices, ReadAsciiAndLeaveListsOut) {
  const TemporaryFolder folder;
  const auto path = folder.file(
      "v.ply",
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty uchar flag\nproperty list uchar int a\nproperty double d\n"
      "end_header\n1 1 5 0.25\n0 0 0.5\n");
  const PlyVertices vertices = read_ply_vertices(path).value();
  EXPECT_THAT(vertices.names, ElementsAre("flag", "d"));
  EXPECT_THAT(*vertices.find("flag"), ElementsAre(1, 0));
  EXPECT_THAT(*vertices.find("d"), ElementsAre(0.25, 0.5));
}

}  // namespace
}  // namespace asbuilt::io
