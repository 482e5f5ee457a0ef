// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/options.h"

#include <gtest/gtest.h>

#include <set>

namespace asbuilt::pipeline {
namespace {

TEST(Options, HaveNamesThatNoTwoShare) {
  Options options;
  std::set<std::string> names;
  for_each_stage_field(options, [&](Half, const std::string& name, auto&, std::string_view) {
    EXPECT_TRUE(names.insert(name).second) << name;
  });
  EXPECT_GT(names.size(), 20U);
}

TEST(Options, ComeBackFromTheRecord) {
  Options options;
  options.scan_unit = io::Unit::metre;
  options.scan_units = {"scan_03.ply:inch"};
  options.viewpoint = "1,2,3";
  options.exclude = {"scan_01"};
  options.seed = 42;
  options.gauge = Gauge::fixed;
  options.instances = Instances::all;
  options.detect.angle_bins = 17;
  options.scan.use_file_normals = false;
  options.graph.edges.low = 0.123;
  const auto everything = {Half::model, Half::scan, Half::joint};
  const io::Options record = recorded(options, everything);
  Options back;
  ASSERT_TRUE(take_over(back, record).has_value());
  EXPECT_EQ(recorded(back, everything), record);
  EXPECT_EQ(back.scan_unit, io::Unit::metre);
  EXPECT_EQ(back.scan_units, options.scan_units);
  EXPECT_EQ(back.instances, Instances::all);
  EXPECT_EQ(back.detect.angle_bins, 17);
  EXPECT_FALSE(back.scan.use_file_normals);
  EXPECT_EQ(back.graph.edges.low, 0.123);
}

TEST(Options, OfTheWrongKindAreRefused) {
  Options options;
  EXPECT_FALSE(take_over(options, {{"angle_bins", std::string("many")}}).has_value());
  EXPECT_FALSE(take_over(options, {{"unit", std::string("parsec")}}).has_value());
  EXPECT_FALSE(take_over(options, {{"instances", std::string("some")}}).has_value());
}

TEST(Acceptance, IsAScanAndACandidate) {
  const auto acceptance = parse_acceptance("C:scan:2");
  ASSERT_TRUE(acceptance.has_value());
  EXPECT_EQ(acceptance->scan, "C:scan");
  EXPECT_EQ(acceptance->candidate, 2);
  for (const char* text : {"", "scan", "scan:", ":1", "scan:x", "scan:-1", "scan:1x"}) {
    EXPECT_FALSE(parse_acceptance(text).has_value()) << text;
  }
}

TEST(PipelineOptions, AScanMayHaveAUnitOfItsOwn) {
  Options options;
  options.scan_unit = io::Unit::metre;
  options.scan_units = {"scan_01:inch", "b/scan_02.ply:foot", "C:\\odd:name.ply:cm"};
  ASSERT_TRUE(options.validate());
  EXPECT_EQ(scan_reading(options, "a/scan_00.ply", Context(1)).unit, io::Unit::metre);
  EXPECT_EQ(scan_reading(options, "a/scan_01.ply", Context(1)).unit, io::Unit::inch);
  EXPECT_EQ(scan_reading(options, "b/scan_02.ply", Context(1)).unit, io::Unit::foot);
  EXPECT_EQ(scan_reading(options, "C:\\odd:name.ply", Context(1)).unit, io::Unit::centimetre);
  for (const char* wrong : {"scan_01", ":m", "scan_01:", "scan_01:mile"}) {
    options.scan_units = {wrong};
    EXPECT_FALSE(options.validate()) << wrong;
  }
}

}  // namespace
}  // namespace asbuilt::pipeline
