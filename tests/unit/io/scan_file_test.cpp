// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/scan_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "asbuilt/io/mesh_file.h"
#include "unit/io/temporary_folder.h"

namespace asbuilt::io {
namespace {

using test::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// The one message that scan and mesh readers must agree on.
std::string error_of(const std::filesystem::path& path) {
  const auto scans = read_scans(path, Unit::stated);
  const auto mesh = read_mesh(path, Unit::stated);
  if (scans || mesh) return "no error";
  EXPECT_EQ(scans.error().message, mesh.error().message);
  EXPECT_EQ(scans.error().code, ErrorCode::unreadable_input);
  return scans.error().message;
}

TEST(FileKind, KnownButUnsupportedKindsAreRefusedByTheirContentWithAWayOut) {
  const TemporaryFolder folder;
  EXPECT_THAT(error_of(folder.file("part.stl.txt", "ISO-10303-21;\nHEADER;\n")),
              AllOf(HasSubstr("is a STEP file, which is not supported yet"), HasSubstr("export it as STL")));
  EXPECT_THAT(error_of(folder.file("scan.ply", "ASTM-E57\1\0\0\0")),
              AllOf(HasSubstr("is an E57 file"), HasSubstr("export it as PLY or PCD")));
  EXPECT_THAT(error_of(folder.file("scan", "LASF")), HasSubstr("is a LAS or LAZ file"));
  EXPECT_THAT(error_of(folder.file("part", "PK\x03\x04")), HasSubstr("ZIP archive"));
  EXPECT_THAT(error_of(folder.file("part", "S" + std::string(71, ' ') + "S      1\n")), HasSubstr("is an IGES file"));
  EXPECT_THAT(error_of(folder.file("scan.ptx", "1\n1\n0 0 0\n")), HasSubstr("is a PTX file"));
  EXPECT_THAT(error_of(folder.file("Part.STP", "whatever")), HasSubstr("is a STEP file"));
}

TEST(FileKind, UnknownKindsAreRefusedWithTheListOfTheKnown) {
  const TemporaryFolder folder;
  EXPECT_THAT(error_of(folder.file("notes.doc", "hello")),
              AllOf(HasSubstr("extension '.doc'"), HasSubstr(".ply, .pcd, .xyz"), HasSubstr(".stl, .obj, .off")));
  EXPECT_THAT(error_of(folder.file("empty.ply", "")), HasSubstr("empty.ply: the file is empty"));
  EXPECT_THAT(error_of(folder.path()), HasSubstr("is a folder"));
  EXPECT_THAT(error_of(folder.path() / "none.ply"), HasSubstr("none.ply: there is no such file"));
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
  EXPECT_THAT(error_of(folder.file("scan.ply", "1 2 3\n")), HasSubstr("line 1: the file does not begin with 'ply'"));
}

}  // namespace
}  // namespace asbuilt::io
