// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <numbers>
#include <optional>
#include <sstream>

#include "asbuilt/core/pose.h"
#include "asbuilt/evaluate/truth.h"
#include "asbuilt/io/file.h"
#include "asbuilt/io/json_text.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/io/number.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/io/scan_file.h"
#include "asbuilt/model/prepared_file.h"
#include "asbuilt/scan/sanitise.h"
#include "commands.h"
#include "options.h"

namespace asbuilt::cli {
namespace {

using Json = nlohmann::ordered_json;

struct Arguments {
  std::vector<std::string> files;
  io::ReadOptions reading;
};

struct ScanInfo {
  std::string name, title;
  std::size_t points = 0;
  std::optional<Eigen::Vector3d> viewpoint;
  bool has_pose = false, has_normals = false;
  std::optional<io::ScanGrid> grid;
  bool has_colours = false, has_intensities = false;
};

struct FileInfo {
  std::string path, kind, format, unit = "mm";
  bool unit_is_known = true;  ///< stated by the file or by the user; else mm was taken
  std::size_t points = 0, triangles = 0;
  Eigen::AlignedBox3d box;
  std::vector<ScanInfo> scans;
  std::vector<std::string> notes;
  std::string error;  ///< in place of everything else
};

Json vector_json(const Eigen::Vector3d& v) {
  return {io::json_number(v.x()), io::json_number(v.y()), io::json_number(v.z())};
}

void add_scan(FileInfo& info, const io::ScanFile& file, const Context& context) {
  const scan::Sanitised sane = scan::sanitise(file.cloud, context);
  info.points += sane.cloud.size();
  // Several scans are told as large as they are together, where the file's poses place them.
  const Pose placed = file.file_from_scan.value_or(Pose::Identity());
  for (const Eigen::Vector3f& position : sane.cloud.positions) {
    info.box.extend(placed * (position.cast<double>() + file.offset_mm));
  }
  info.scans.push_back({file.name, file.title, sane.cloud.size(), file.viewpoint_mm, file.file_from_scan.has_value(),
                        file.cloud.has_normals(), file.grid, !file.colours.empty(), !file.intensities.empty()});
  info.unit = io::name_of(file.unit);
  info.notes.insert(info.notes.end(), file.notes.begin(), file.notes.end());
  // STL repeats a corner in each of its triangles: there that is no flaw.
  const std::size_t duplicates = file.format.starts_with("stl") ? 0 : sane.report.duplicates;
  const std::size_t removed = sane.report.not_finite + sane.report.no_return + duplicates;
  if (removed > 0) {
    info.notes.push_back(fmt::format("{}: {} unusable point{} ({} not finite, {} without return, {} duplicates)",
                                     file.name, removed, removed == 1 ? "" : "s", sane.report.not_finite,
                                     sane.report.no_return, duplicates));
  }
}

void describe_mesh(FileInfo& info, const TriangleMesh& mesh) {
  info.triangles = mesh.triangles.size();
  info.box.extend(bounding_box(mesh));
}

Result<void> describe_result(FileInfo& info, const std::filesystem::path& file) {
  ASBUILT_TRY(record, io::read_run_record(file));
  info.kind = "result";
  info.format = fmt::format("asbuilt result, schema {}", io::RunRecord::kSchema);
  for (const io::ScanRecord& scan : record.scans) {
    info.points += scan.points;
    info.scans.push_back({scan.name, "", scan.points, scan.viewpoint, scan.model_from_scan.has_value(), false, {}});
  }
  info.notes.push_back(fmt::format("state {}, model {} (diameter {:.6g} mm)", io::name_of(record.state),
                                   record.model.path, record.model.diameter));
  return {};
}

Result<void> describe_prepared(FileInfo& info, const Context& context) {
  ASBUILT_TRY(model, model::load_prepared(info.path, context));
  info.kind = "prepared";
  info.format = "asbuilt prepared model";
  info.points = model.samples.size();
  describe_mesh(info, model.skin);
  info.notes.push_back(fmt::format("from {}, diameter {:.6g} mm, sampling distance {:.4g} mm", model.source_path,
                                   model.diameter, model.sampling_distance));
  info.notes.push_back("symmetry: " + model.symmetry.describe());
  if (const std::string near = model.symmetry.describe_near(); !near.empty()) {
    info.notes.push_back("nearly the same: " + near);
  }
  return {};
}

/// The numbers of a small text file that holds nothing else.
std::optional<std::vector<double>> only_numbers(const std::filesystem::path& path) {
  constexpr std::uintmax_t kMostBytes = 2000;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored) || std::filesystem::file_size(path, ignored) > kMostBytes) {
    return std::nullopt;
  }
  const auto text = io::read_file(path);
  if (!text) return std::nullopt;
  std::istringstream words(*text);
  std::vector<double> numbers;
  for (std::string word; words >> word;) {
    const auto number = io::parse_number(word);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

/// Matrices lie beside scans and would pass for three or four points: a pose is 4 x 4, a camera 3 x 3.
bool describe_matrix(FileInfo& info) {
  const auto n = only_numbers(info.path);
  if (!n) return false;
  const auto is_row = [&](std::size_t at, std::initializer_list<double> row) {
    return std::equal(row.begin(), row.end(), n->begin() + static_cast<std::ptrdiff_t>(at));
  };
  if (n->size() == 16 && is_row(12, {0, 0, 0, 1})) {
    const Eigen::Matrix4d matrix = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(n->data());
    constexpr double kFewDigits = 1e-3;
    const bool is_motion = is_rigid(matrix, kFewDigits);
    info.kind = "pose";
    info.format = is_motion ? "4 x 4 matrix" : "4 x 4 matrix that is no rigid motion";
    if (!is_motion) return true;
    const Eigen::Vector3d shift = matrix.topRightCorner<3, 1>();
    info.notes.push_back(fmt::format(
        "It turns by {:.4g} degrees and then shifts by {:.6g}, {:.6g}, {:.6g}; which way it "
        "leads the file does not say. --poses takes model_from_scan, as CSV or JSON.",
        rotation_angle(matrix.topLeftCorner<3, 3>()) * 180.0 / std::numbers::pi, shift.x(), shift.y(), shift.z()));
  } else if (n->size() == 9 && is_row(6, {0, 0, 1}) && (*n)[1] == 0.0 && (*n)[3] == 0.0 && (*n)[0] > 0.0) {
    info.kind = "camera";
    info.format = "3 x 3 matrix";
    info.notes.push_back(
        fmt::format("fx {:g}, fy {:g}, cx {:g}, cy {:g} in pixels; --camera takes it for depth images.", (*n)[0],
                    (*n)[4], (*n)[2], (*n)[5]));
  } else {
    return false;
  }
  return true;
}

Result<void> describe_truth(FileInfo& info) {
  ASBUILT_TRY(truth, evaluate::read_truth(info.path));
  info.kind = "truth";
  info.format = "truth of simulated scans, schema 1";
  const auto shows_it = [](const evaluate::TrueScan& scan) { return scan.model_from_scan.has_value(); };
  info.notes.push_back(
      fmt::format("{} scans, of which {} show the part; noise {:.4g} mm (1 sigma); `asbuilt evaluate` reads it",
                  truth.scans.size(), std::ranges::count_if(truth.scans, shows_it), truth.noise_sigma_mm));
  return {};
}

void describe_model(FileInfo& info, const io::ModelFile& model) {
  info.kind = model.is_cad ? "cad" : "mesh";
  info.format = model.format;
  info.unit = io::name_of(model.unit);
  info.points = model.mesh.vertices.size();
  describe_mesh(info, model.mesh);
  info.notes.insert(info.notes.end(), model.notes.begin(), model.notes.end());
  if (!model.is_cad) return;
  info.points = 0;  // surfaces have none
  info.notes.push_back(fmt::format("{} CAD face{} of {}, here as triangles", model.cad_faces,
                                   model.cad_faces == 1 ? "" : "s",
                                   model.cad_parts == 1 ? "one body" : fmt::format("{} bodies", model.cad_parts)));
}

/// A hint where the size that follows from taking mm is that of nothing that is scanned.
void look_at_unit(FileInfo& info, const Arguments& arguments) {
  constexpr double kSmallest_mm = 10.0;
  const bool states_it = info.kind == "cad" || info.format.starts_with("e57");
  info.unit_is_known = states_it || arguments.reading.unit != io::Unit::stated;
  const bool says_so_already = info.format.starts_with("las") || info.format.starts_with("ptx");
  if (info.unit_is_known || says_so_already || info.box.isEmpty()) return;
  const double diagonal_mm = info.box.sizes().norm();
  if (diagonal_mm >= kSmallest_mm || diagonal_mm == 0.0) return;
  info.notes.push_back(
      fmt::format("The file states no unit. In mm all of it is {:.3g} mm across; were it in metres, {:.3g} m: "
                  "then say --unit m of a model and --scan-unit m of a scan.",
                  diagonal_mm, diagonal_mm));
}

Result<void> describe(FileInfo& info, const Arguments& arguments, const Context& context) {
  const std::filesystem::path path(info.path);
  if (std::filesystem::is_directory(path)) return describe_result(info, path / "result.json");
  if (path.filename() == "result.json") return describe_result(info, path);
  if (path.filename() == "truth.json") return describe_truth(info);
  if (model::is_prepared_file(path)) return describe_prepared(info, context);
  if (describe_matrix(info)) return {};

  // A file may be both: structured-light software exports scans as meshes.
  const auto model = io::read_model(path, arguments.reading.unit);
  if (model) describe_model(info, *model);
  if (model && model->is_cad) return {};
  const auto scans = io::read_scans(path, arguments.reading);
  if (!scans) return tl::unexpected(io::is_model_name(path) && !model ? model.error() : scans.error());
  info.points = 0;
  for (const io::ScanFile& file : *scans) add_scan(info, file, context);
  if (!model) info.kind = "scan";
  info.format = scans->front().format;
  look_at_unit(info, arguments);
  return {};
}

Json json_of(const FileInfo& info) {
  if (!info.error.empty()) return {{"path", info.path}, {"error", info.error}};
  Json scans = Json::array();
  for (const ScanInfo& scan : info.scans) {
    scans.push_back({{"name", scan.name},
                     {"points", scan.points},
                     {"viewpoint", scan.viewpoint ? vector_json(*scan.viewpoint) : Json(nullptr)},
                     {"has_pose", scan.has_pose},
                     {"has_normals", scan.has_normals},
                     {"has_grid", scan.grid.has_value()},
                     {"title", scan.title},
                     {"has_colours", scan.has_colours},
                     {"has_intensities", scan.has_intensities}});
  }
  const Eigen::Vector3d extent = info.box.isEmpty() ? Eigen::Vector3d::Zero().eval() : info.box.sizes().eval();
  return {{"path", info.path},
          {"kind", info.kind},
          {"format", info.format},
          {"unit", info.unit},
          {"points", info.points},
          {"triangles", info.triangles},
          {"extent", vector_json(extent)},
          {"scans", std::move(scans)},
          {"notes", info.notes}};
}

/// What a file calls something, for a terminal: no control characters.
std::string printable(std::string text) {
  std::erase_if(text, [](unsigned char c) { return c < 0x20 || c == 0x7f; });
  return text.substr(0, 60);
}

std::string lines_of(const FileInfo& info) {
  if (!info.error.empty()) return {};  // told on standard error
  const bool holds_surface = info.kind != "pose" && info.kind != "camera" && info.kind != "truth";
  if (!holds_surface) {
    std::string text = fmt::format("{}\n  {}, {}\n", info.path, info.kind, info.format);
    for (const std::string& note : info.notes) text += fmt::format("  note: {}\n", note);
    return text;
  }
  const Eigen::Vector3d extent = info.box.isEmpty() ? Eigen::Vector3d::Zero().eval() : info.box.sizes().eval();
  std::string text = fmt::format("{}\n  {}, {}, unit {}{}\n  ", info.path, info.kind, info.format, info.unit,
                                 info.unit_is_known ? "" : " (not stated)");
  if (info.points > 0 || info.triangles == 0) text += fmt::format("{} points, ", info.points);
  if (info.triangles > 0) text += fmt::format("{} triangles, ", info.triangles);
  text += info.box.isEmpty() ? "no extent\n"
                             : fmt::format("extent {:.6g} x {:.6g} x {:.6g} mm\n", extent.x(), extent.y(), extent.z());
  for (const ScanInfo& scan : info.scans) {
    const std::string viewpoint = scan.viewpoint ? fmt::format("{:.4g}, {:.4g}, {:.4g}", scan.viewpoint->x(),
                                                               scan.viewpoint->y(), scan.viewpoint->z())
                                                 : "not stated";
    text += fmt::format("  scan {}: {} points, viewpoint {}, normals {}{}{}{}{}{}\n", scan.name, scan.points, viewpoint,
                        scan.has_normals ? "yes" : "no", scan.has_colours ? ", colour" : "",
                        scan.has_intensities ? ", intensity" : "",
                        scan.grid ? fmt::format(", grid of {} x {}", scan.grid->rows, scan.grid->columns) : "",
                        scan.has_pose ? ", with a pose" : "",
                        scan.title.empty() ? "" : fmt::format(", called {}", printable(scan.title)));
  }
  for (const std::string& note : info.notes) text += fmt::format("  note: {}\n", note);
  return text;
}

Result<int> run(const Arguments& arguments, Shell& shell) {
  Json files = Json::array();
  std::string text;
  int code = kDone;
  for (const std::string& path : arguments.files) {
    FileInfo info;
    info.path = path;
    if (const auto described = describe(info, arguments, shell.context()); !described) {
      info.error = described.error().message;
      shell.finish(described.error());
      code = kNoReadableInput;
    }
    files.push_back(json_of(info));
    text += lines_of(info);
  }
  shell.print_json(io::json_text({{"schema", 1}, {"files", std::move(files)}}));
  shell.print_result(text);
  return code;
}

}  // namespace

void add_info_command(CLI::App& app, Shell& shell) {
  CLI::App* command = app.add_subcommand("info", "What a file holds: kind, points, extent, unit, normals, viewpoint");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("FILE", arguments->files, "Scans, meshes, prepared models, results")->required();
  add_unit_option(*command, "--unit", arguments->reading.unit, "Unit of the files: mm, cm, m, inch or foot");
  command->add_option("--columns", arguments->reading.columns, "Columns of text scans, as for reconstruct");
  command->add_option("--camera", arguments->reading.camera, "Camera of depth images, as for reconstruct");
  add_common_options(*command, shell, false);
  command->footer(
      "Examples:\n"
      "  asbuilt info part.stl scans/*.ply\n"
      "  asbuilt info scans/scan_00.ply --unit m --json");
  run_on_call(*command, shell, [arguments, &shell] { return run(*arguments, shell); });
}

}  // namespace asbuilt::cli
