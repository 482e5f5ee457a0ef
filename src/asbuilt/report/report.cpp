// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/report/report.h"

#include <fmt/format.h>

#include <system_error>

#include "asbuilt/io/file.h"
#include "asbuilt/report/page.h"
#include "asbuilt/report/scene.h"
#include "asbuilt/report/views.h"
#include "asbuilt/web/pages.h"

namespace asbuilt::report {
namespace {

namespace fs = std::filesystem;

void take_away(const fs::path& path) {
  std::error_code ignored;
  fs::remove(path, ignored);
}

Result<void> write_views(const fs::path& folder, const std::vector<std::string>& pictures) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return fail(ErrorCode::unwritable_output, fmt::format("{}: {}", folder.string(), error.message()));
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    ASBUILT_CHECK(io::write_file(folder / (standard_views()[i].name + ".png"), pictures[i]));
  }
  return {};
}

Result<void> write_tables(const fs::path& folder, const ReportInput& input) {
  ASBUILT_CHECK(io::write_file(folder / "points.csv", spots_csv(input)));
  ASBUILT_CHECK(io::write_file(folder / "faces.csv", faces_csv(input)));
  ASBUILT_CHECK(io::write_file(folder / "regions.csv", regions_csv(input)));
  if (!input.record.scans.empty()) ASBUILT_CHECK(io::write_file(folder / "scans.csv", scans_csv(input)));
  if (input.deviations.reference) return io::write_file(folder / "reference.csv", reference_csv(input));
  take_away(folder / "reference.csv");
  return {};
}

}  // namespace

Result<void> write_report(const fs::path& folder, const ReportInput& input, const Context& context) {
  const Scene scene = scene_of(input.model, input.deviations, context);
  const std::string json = report_json(input);
  ASBUILT_CHECK(io::write_file(folder / "report.json", json));
  ASBUILT_CHECK(write_tables(folder, input));

  const auto page = web::report_page();
  std::vector<std::string> pictures;
  if (input.views || !page) {
    ViewOptions options;
    options.steps = input.steps;
    pictures = rendered_views(scene, colours_of(input), options, context);
  }
  if (input.views) {
    ASBUILT_CHECK(write_views(folder / "views", pictures));
  } else {
    for (const View& view : standard_views()) take_away(folder / "views" / (view.name + ".png"));
    take_away(folder / "views");  // if nothing else is in it
  }
  const std::string html =
      page ? page_with_data(*page, json, scene_json(scene, input.record)) : plain_page(input, pictures);
  return io::write_file(folder / "report.html", html);
}

std::vector<std::string> report_files() {
  std::vector<std::string> files{"report.json", "report.html", "points.csv",   "faces.csv",
                                 "regions.csv", "scans.csv",   "reference.csv"};
  for (const View& view : standard_views()) files.push_back("views/" + view.name + ".png");
  return files;
}

}  // namespace asbuilt::report
