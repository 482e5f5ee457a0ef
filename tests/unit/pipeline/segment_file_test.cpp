// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/segment_file.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "asbuilt/io/ply_writer.h"

namespace asbuilt::pipeline {
namespace {

std::filesystem::path temporary(const char* name) { return std::filesystem::path(testing::TempDir()) / name; }

Segment three_points() {
  Segment segment;
  segment.cloud.positions = {{0.1F, 0.2F, 0.3F}, {1, 2, 3}, {-4, 5, 6}};
  segment.cloud.normals = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}};
  segment.is_part = {1, 0, 1};
  return segment;
}

TEST(Segment, GivesBackThePartWithoutTheMargin) {
  const auto path = temporary("segment.ply");
  ASSERT_TRUE(write_segment(path, three_points(), Eigen::Vector3d::Zero()).has_value());
  const auto part = read_part(path, Eigen::Vector3d::Zero());
  ASSERT_TRUE(part.has_value()) << part.error().message;
  const Segment written = three_points();
  EXPECT_EQ(part->cloud.positions, (std::vector{written.cloud.positions[0], written.cloud.positions[2]}));
  EXPECT_EQ(part->cloud.normals, (std::vector{written.cloud.normals[0], written.cloud.normals[2]}));
  EXPECT_TRUE(part->beside_occluder.empty()) << "nothing was known";
}

TEST(Segment, CutAnewKeepsTheFlagsOfTheScanHalfAndWhatTheSensorSaw) {
  const auto path = temporary("recut_segment.ply");
  Segment written = three_points();
  written.was_part_detected = {1, 1, 0};
  written.beside_occluder = {0, 1, 1};
  written.colours = {{1, 2, 3}, {4, 5, 6}, {255, 0, 128}};
  written.intensities = {0.5F, 0.25F, 7.0F};
  ASSERT_TRUE(write_segment(path, written, Eigen::Vector3d::Zero()).has_value());
  const auto read = read_segment(path, Eigen::Vector3d::Zero());
  ASSERT_TRUE(read.has_value()) << read.error().message;
  EXPECT_EQ(read->cloud.positions, written.cloud.positions);
  EXPECT_EQ(read->is_part, written.is_part);
  EXPECT_EQ(read->was_part_detected, written.was_part_detected);
  EXPECT_EQ(read->beside_occluder, written.beside_occluder);
  EXPECT_EQ(read->colours, written.colours);
  EXPECT_EQ(read->intensities, written.intensities);
  // The joint half begins with what the scan half had cut out.
  const auto part = read_part(path, Eigen::Vector3d::Zero());
  EXPECT_EQ(part->cloud.positions, (std::vector{written.cloud.positions[0], written.cloud.positions[1]}));
  EXPECT_EQ(part->beside_occluder, (std::vector<std::uint8_t>{0, 1}));
}

TEST(Segment, FarFromTheOriginIsWrittenInTheFilesCoordinatesWithoutLoss) {
  const auto path = temporary("far_segment.ply");
  const Eigen::Vector3d offset(4.5e9, -3.2e9, 1.0e6);  // a national grid in mm
  ASSERT_TRUE(write_segment(path, three_points(), offset).has_value());
  const auto vertices = io::read_ply_vertices(path);
  ASSERT_TRUE(vertices.has_value());
  EXPECT_NEAR((*vertices->find("x"))[0], 4.5e9 + 0.1, 1e-5);
  const auto part = read_part(path, offset);
  ASSERT_TRUE(part.has_value());
  EXPECT_NEAR((part->cloud.positions[0] - three_points().cloud.positions[0]).norm(), 0.0F, 1e-5F);
}

TEST(Segment, WithoutOurColumnsIsNotASegment) {
  const auto path = temporary("no_segment.ply");
  const std::vector<float> x{1, 2};
  const std::vector<io::PlyColumn> columns{{"x", std::span<const float>(x)}};
  ASSERT_TRUE(io::write_ply(path, columns).has_value());
  const auto part = read_part(path, Eigen::Vector3d::Zero());
  ASSERT_FALSE(part.has_value());
  EXPECT_EQ(part.error().code, ErrorCode::unreadable_input);
}

}  // namespace
}  // namespace asbuilt::pipeline
