// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/report/report.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "asbuilt/core/random.h"
#include "asbuilt/io/file.h"
#include "asbuilt/report/views.h"
#include "asbuilt/web/pages.h"
#include "png_decoder.h"
#include "unit/io/temporary_folder.h"
#include "unit/model/shapes.h"

namespace asbuilt::report {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using Json = nlohmann::json;

constexpr double kEdge = 60.0;

const model::PreparedModel& cube() {
  static const model::PreparedModel model =
      model::prepare(test::joined(test::box({0, 0, 0}, {kEdge, kEdge, kEdge})), {}, Context(2)).value();
  return model;
}

/// The top of the cube measured by two scans, with a plateau 1 mm high on a quarter of it; the rest was not seen.
struct Inspected {
  PointCloud cloud;
  std::vector<std::uint16_t> scan, support;
  inspect::InspectOptions options;
  io::RunRecord record;
  inspect::DeviationReport deviations;

  Inspected() {
    Random random(1, "report", 0);
    for (double x = 0.3; x < kEdge; x += 0.6) {
      for (double y = 0.3; y < kEdge; y += 0.6) {
        const double height = x < 30.0 && y < 30.0 ? 1.0 : 0.0;
        cloud.positions.push_back(Eigen::Vector3d(x, y, kEdge + height + 0.02 * random.normal()).cast<float>());
        cloud.normals.emplace_back(Eigen::Vector3f::UnitZ());
        scan.push_back(x < 40.0 ? 0 : 1);
        support.push_back(1);
      }
    }
    options.tolerance = inspect::Tolerance{-0.5, 0.5};
    deviations = inspect::inspect(inspect::Measurement{cloud, scan, support}, cube(), options, Context(2)).value();
    record.version = "0.0.test";
    record.model.path = "cube <&>.stl";
    for (int i = 0; i < 2; ++i) {
      io::ScanRecord entry;
      entry.name = i == 0 ? "left, \"first\"" : "right";
      entry.status = io::ScanStatus::accepted;
      entry.model_from_scan = Pose::Identity();
      record.scans.push_back(entry);
    }
    record.graph = io::GraphRecord{{{0, 1, 0.4, true}}, {{0, 1}}};
    io::RefinementRecord refinement;
    refinement.edges = {{0, 1, 100, 0.3}, {1, 0, 300, 0.1}};
    record.refinement = {refinement};
  }

  [[nodiscard]] ReportInput input() const {
    ReportInput result{"reconstruct", {"reconstruct", "cube.stl", "a.ply"}, record, cube(), deviations, options};
    result.points = cloud.size();
    return result;
  }
};

const Inspected& inspected() {
  static const Inspected shared;
  return shared;
}

TEST(ReportJson, HasTheStructureThatItsPageDocuments) {
  const Json report = Json::parse(report_json(inspected().input()));
  for (const char* key :
       {"asbuilt",     "command",    "unit",      "sign",      "verdict",  "summary",      "notes",
        "model",       "measured",   "alignment", "tolerance", "coverage", "significance", "over_area",
        "over_points", "histogram",  "colours",   "faces",     "boxes",    "regions",      "scans",
        "graph",       "refinement", "reference", "options",   "files"}) {
    EXPECT_TRUE(report.contains(key)) << key;
  }
  EXPECT_EQ(report["verdict"]["part"], "fail");
  EXPECT_EQ(report["verdict"]["fail"], 1);
  EXPECT_EQ(report["verdict"]["not_scanned"], 5);
  EXPECT_EQ(report["faces"].size(), 6U);
  EXPECT_NEAR(report["coverage"]["share"].get<double>(), 1.0 / 6.0, 0.01);
  EXPECT_NEAR(report["over_points"]["mean"].get<double>(), 0.25, 0.01);
  EXPECT_NEAR(report["over_points"]["over_tolerance"].get<double>(), 0.25, 0.01);
  ASSERT_EQ(report["regions"].size(), 1U);
  EXPECT_NEAR(report["regions"][0]["area"].get<double>(), 900.0, 60.0);
  EXPECT_NEAR(report["regions"][0]["mean"].get<double>(), 1.0, 0.05);
  EXPECT_EQ(report["scans"].size(), 2U);
  EXPECT_GT(report["scans"][0]["spots"].get<int>(), report["scans"][1]["spots"].get<int>());
  // Both ways of a link together: sqrt((100 * 0.3^2 + 300 * 0.1^2) / 400).
  EXPECT_NEAR(report["graph"]["links"][0]["residual"].get<double>(), std::sqrt(12.0 / 400.0), 1e-9);
  std::size_t counted =
      report["histogram"]["below"].get<std::size_t>() + report["histogram"]["above"].get<std::size_t>();
  for (const auto& bin : report["histogram"]["over_area"]) counted += bin.get<std::size_t>();
  EXPECT_EQ(counted, report["coverage"]["spots_scanned"].get<std::size_t>());
  EXPECT_EQ(report["command"]["arguments"].size(), 3U);
}

TEST(ReportJson, UsesTheRealMinusSignInSentences) {
  const Json report = Json::parse(report_json(inspected().input()));
  EXPECT_THAT(report["verdict"]["reason"].get<std::string>(), HasSubstr("\u22120.5"));
}

TEST(ReportJson, SaysHowManyFacesAPassLeavesUnjudged) {
  // The top alone was seen, and less of the part is asked for: five sides of the cube nobody judged.
  inspect::InspectOptions options;
  options.tolerance = inspect::Tolerance{-2.0, 2.0};
  options.minimum_coverage = 0.1;
  const Inspected& measured = inspected();
  const auto deviations =
      inspect::inspect(inspect::Measurement{measured.cloud, measured.scan, measured.support}, cube(), options, Context(2))
          .value();
  ReportInput input{"reconstruct", {"reconstruct"}, measured.record, cube(), deviations, options};
  const Json report = Json::parse(report_json(input));
  EXPECT_EQ(report["verdict"]["part"], "pass");
  EXPECT_THAT(report["verdict"]["reason"].get<std::string>(), HasSubstr("5 of 6 faces too little to be judged"));
}

TEST(Tables, HaveAsManyFieldsInEveryLineAsInTheHeader) {
  const ReportInput input = inspected().input();
  for (const std::string& text : {spots_csv(input), faces_csv(input), regions_csv(input), scans_csv(input)}) {
    std::istringstream stream(text);
    std::size_t expected = 0;
    for (std::string line; std::getline(stream, line);) {
      std::size_t fields = 1;
      bool quoted = false;
      for (const char c : line) {
        if (c == '"') quoted = !quoted;
        if (c == ',' && !quoted) ++fields;
      }
      if (expected == 0) expected = fields;
      ASSERT_EQ(fields, expected) << line;
    }
    EXPECT_GT(expected, 5U);
  }
  EXPECT_THAT(scans_csv(input), HasSubstr("\"left, \"\"first\"\"\""));
}

TEST(Views, ColourWhatWasScannedAndLeaveTheRestGrey) {
  const Scene scene = scene_of(cube(), inspected().deviations, Context(2));
  const ColourMap colours = colours_of(inspected().input());
  ViewOptions options;
  options.width = 480;
  options.height = 360;
  const auto top = std::ranges::find(standard_views(), "plus_z", &View::name);
  const auto side = std::ranges::find(standard_views(), "plus_x", &View::name);
  const test::Decoded from_top = test::decode_png(rendered(scene, colours, *top, options).png());
  const test::Decoded from_side = test::decode_png(rendered(scene, colours, *side, options).png());
  const int middle_x = (480 - 210) / 2, middle_y = 44 + (360 - 44) / 2;
  // From above, x runs to the right and y up: the plateau is at the lower left.
  const auto* plateau = from_top.at(middle_x - 50, middle_y + 50);
  EXPECT_GT(plateau[0], plateau[2] + 40);
  const auto* flat = from_top.at(middle_x + 50, middle_y - 50);
  EXPECT_NEAR(flat[0], flat[2], 12);
  EXPECT_GT(flat[0], 200);
  const auto* grey = from_side.at(middle_x, middle_y);
  EXPECT_LT(grey[0], 170);
  EXPECT_NEAR(grey[0], grey[2], 14);
  EXPECT_EQ(from_top.at(2, 100)[0], 255);  // paper
}

TEST(Report, IsWrittenWholeWithAllThatBelongsToIt) {
  const test::TemporaryFolder folder;
  ReportInput input = inspected().input();
  input.views = true;
  ASSERT_TRUE(write_report(folder.path(), input, Context(2)).has_value());
  for (const char* name : {"report.json", "report.html", "points.csv", "faces.csv", "regions.csv", "scans.csv",
                           "views/corner.png", "views/minus_z.png"}) {
    EXPECT_TRUE(fs::exists(folder.path() / name)) << name;
  }
  EXPECT_FALSE(fs::exists(folder.path() / "reference.csv"));
  const std::string html = io::read_file(folder.path() / "report.html").value();
  EXPECT_LT(html.size(), 15U << 20);
  if (web::report_page()) {
    EXPECT_THAT(html, HasSubstr("id=\"asbuilt-report\""));
    EXPECT_THAT(html, HasSubstr("cube \\u003c&>.stl"));
    EXPECT_EQ(html.find(web::kReportDataMark), std::string::npos);
  } else {
    EXPECT_THAT(html, HasSubstr("no 3D view"));
    EXPECT_THAT(html, HasSubstr("cube &lt;&amp;&gt;.stl"));
  }
  // Again, without views and to the same bytes: what is no longer true goes.
  const std::string json = io::read_file(folder.path() / "report.json").value();
  input.views = false;
  ASSERT_TRUE(write_report(folder.path(), input, Context(1)).has_value());
  EXPECT_FALSE(fs::exists(folder.path() / "views"));
  input.views = true;
  ASSERT_TRUE(write_report(folder.path(), input, Context(1)).has_value());
  EXPECT_EQ(io::read_file(folder.path() / "report.json").value(), json);
  EXPECT_EQ(io::read_file(folder.path() / "report.html").value(), html);
}

}  // namespace
}  // namespace asbuilt::report
