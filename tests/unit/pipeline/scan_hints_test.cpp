// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/scan_hints.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "asbuilt/io/file.h"

namespace asbuilt::pipeline {
namespace {

using Kind = scan::Viewpoint::Kind;

TEST(Viewpoints, AreReadFromEveryFormOfTheOption) {
  EXPECT_TRUE(Viewpoints::from_text("auto", io::Unit::stated)->of("a.ply", "a").automatic);
  const auto none = Viewpoints::from_text("none", io::Unit::stated)->of("a.ply", "a");
  EXPECT_FALSE(none.automatic);
  EXPECT_FALSE(none.stated.known());
  const auto point = Viewpoints::from_text("1,-2.5,3e1", io::Unit::metre)->of("a.ply", "a");
  EXPECT_EQ(point.stated.kind, Kind::point);
  EXPECT_EQ(point.stated.value, Eigen::Vector3d(1000, -2500, 30000));  // in the unit of the scans
  const auto direction = Viewpoints::from_text("dir:0,0,-2", io::Unit::metre)->of("a.ply", "a");
  EXPECT_EQ(direction.stated.kind, Kind::direction);
  EXPECT_EQ(direction.stated.value, Eigen::Vector3d(0, 0, -1));
}

TEST(Viewpoints, ThatAreNoneOfTheFormsAreRefused) {
  for (const char* text : {"", "somewhere", "1,2", "1,2,3,4", "1,2,x", "dir:0,0,0", "dir:1,2", "nan,0,0", "1,,2"}) {
    EXPECT_FALSE(Viewpoints::from_text(text, io::Unit::stated).has_value()) << text;
  }
}

TEST(Viewpoints, OfATableBelongToTheScansItNames) {
  const auto path = std::filesystem::path(testing::TempDir()) / "viewpoints.csv";
  ASSERT_TRUE(io::write_file(path, "a,1,2,3\nb.ply,4,5,6\n").has_value());
  const auto viewpoints = Viewpoints::from_text(path.string(), io::Unit::stated);
  ASSERT_TRUE(viewpoints.has_value()) << viewpoints.error().message;
  EXPECT_EQ(viewpoints->of("x/a.ply", "a").stated.value, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(viewpoints->of("x/b.ply", "b").stated.value, Eigen::Vector3d(4, 5, 6));
  EXPECT_TRUE(viewpoints->of("x/c.ply", "c").automatic);
}

TEST(EntryNames, TellThePlacementsOfAScanApart) {
  EXPECT_EQ(entry_name("scan", 1), "scan");
  EXPECT_EQ(entry_name("scan", 2), "scan#2");
  io::ScanRecord first, second;
  first.path = second.path = "folder/scan.ply";
  first.name = "scan", second.name = "scan#2", second.instance = 2;
  for (const char* of_both : {"scan", "folder/scan.ply", "scan.ply"}) {
    EXPECT_TRUE(names_entry(of_both, first)) << of_both;
    EXPECT_TRUE(names_entry(of_both, second)) << of_both;
  }
  EXPECT_TRUE(names_entry("scan#1", first));
  EXPECT_FALSE(names_entry("scan#1", second));
  EXPECT_TRUE(names_entry("scan#2", second));
  EXPECT_FALSE(names_entry("scan#2", first));
  EXPECT_FALSE(names_entry("sca", second));
}

}  // namespace
}  // namespace asbuilt::pipeline
