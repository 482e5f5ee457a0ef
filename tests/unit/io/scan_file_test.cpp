// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/scan_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

#include "asbuilt/io/mesh_file.h"
#include "unit/io/temporary_folder.h"

namespace asbuilt::io {
namespace {

using test::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// The one message that scan and mesh readers must agree on.
std::string shared_error_of(const std::filesystem::path& path) {
  const auto scans = read_scans(path, Unit::stated);
  const auto mesh = read_mesh(path, Unit::stated);
  if (scans || mesh) return "no error";
  EXPECT_EQ(scans.error().message, mesh.error().message);
  EXPECT_EQ(scans.error().code, ErrorCode::unreadable_input);
  return scans.error().message;
}

TEST(FileKind, KnownButUnsupportedKindsAreRefusedByTheirContentWithAWayOut) {
  const TemporaryFolder folder;
  EXPECT_THAT(shared_error_of(folder.file("scan.ply", "%PDF-1.4\n")),
              AllOf(HasSubstr("is a PDF document, which is not read"), HasSubstr("export it as STL")));
  EXPECT_THAT(shared_error_of(folder.file("part", "PK\x03\x04")), HasSubstr("ZIP archive"));
  EXPECT_THAT(shared_error_of(folder.file("Part.SLDPRT", "whatever")), HasSubstr("is a SolidWorks part"));
  EXPECT_THAT(shared_error_of(folder.file("hall.fls", "whatever")), HasSubstr("export it as PLY or PCD"));
}

TEST(FileKind, ScansAndModelsAreToldApartWhereTheOtherIsWanted) {
  const TemporaryFolder folder;
  for (const auto& [name, content] :
       {std::pair("scan.ply", "ASTM-E57\1"), std::pair("scan", "LASF"), std::pair("scan.ptx", "1\n1\n0 0 0\n")}) {
    EXPECT_THAT(read_mesh(folder.file(name, content), Unit::stated).error().message,
                HasSubstr("is a scan, expected a model"));
  }
  for (const auto& [name, content] :
       {std::pair("part.stl.txt", "ISO-10303-21;\nHEADER;\n"), std::pair("Part.STP", "whatever"),
        std::pair("part", "S                                                                       S      1\n")}) {
    EXPECT_THAT(read_scans(folder.file(name, content), Unit::stated).error().message, HasSubstr("is a CAD file"));
  }
}

TEST(FileKind, UnknownKindsAreRefusedWithTheListOfTheKnown) {
  const TemporaryFolder folder;
  EXPECT_THAT(shared_error_of(folder.file("notes.doc", "hello")),
              AllOf(HasSubstr("extension '.doc'"), HasSubstr(".ply, .pcd, .e57"), HasSubstr(".stl, .ply, .obj, .off")));
  EXPECT_THAT(shared_error_of(folder.file("empty.ply", "")), HasSubstr("empty.ply: the file is empty"));
  EXPECT_THAT(shared_error_of(folder.path()), HasSubstr("is a folder"));
  EXPECT_THAT(shared_error_of(folder.path() / "none.ply"), HasSubstr("none.ply: there is no such file"));
}

TEST(FileKind, ContentCountsMoreThanTheExtension) {
  const TemporaryFolder folder;
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 "
      "3\n";
  EXPECT_EQ(read_scans(folder.file("scan.xyz", ply), Unit::stated).value().at(0).format, "ply ascii");
  EXPECT_EQ(read_scans(folder.file("scan", ply), Unit::stated).value().at(0).name, "scan");
  EXPECT_EQ(read_scans(folder.file("scan.ply", "FIELDS x y z\nPOINTS 1\nDATA ascii\n1 2 3\n"), Unit::stated)
                .value()
                .at(0)
                .format,
            "pcd ascii");
  EXPECT_THAT(shared_error_of(folder.file("scan.ply", "1 2 3\n")),
              HasSubstr("line 1: the file does not begin with 'ply'"));
}

}  // namespace
}  // namespace asbuilt::io
