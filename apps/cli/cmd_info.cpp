// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <optional>

#include "asbuilt/io/file.h"
#include "asbuilt/io/json_text.h"
#include "asbuilt/io/mesh_file.h"
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
  io::Unit unit = io::Unit::stated;
};

struct ScanInfo {
  std::string name;
  std::size_t points = 0;
  std::optional<Eigen::Vector3d> viewpoint;
  bool has_pose = false, has_normals = false, has_grid = false;
};

struct FileInfo {
  std::string path, kind, format, unit = "mm";
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
  for (const Eigen::Vector3f& position : sane.cloud.positions)
    info.box.extend(position.cast<double>() + file.offset_mm);
  info.scans.push_back({file.name, sane.cloud.size(), file.viewpoint_mm, file.viewpoint_mm.has_value(),
                        file.cloud.has_normals(), false});
  info.notes.insert(info.notes.end(), file.notes.begin(), file.notes.end());
  const std::size_t removed = file.cloud.size() - sane.cloud.size();
  if (removed > 0) {
    info.notes.push_back(fmt::format("{}: {} unusable points ({} not finite, {} without return, {} duplicates)",
                                     file.name, removed, sane.report.not_finite, sane.report.no_return,
                                     sane.report.duplicates));
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
    info.scans.push_back({scan.name, scan.points, scan.viewpoint, scan.model_from_scan.has_value(), false, false});
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

/// "stl", in lower case.
std::string extension_of(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  if (extension.starts_with('.')) extension.erase(0, 1);
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

Result<void> describe(FileInfo& info, io::Unit unit, const Context& context) {
  const std::filesystem::path path(info.path);
  if (std::filesystem::is_directory(path)) return describe_result(info, path / "result.json");
  if (path.filename() == "result.json") return describe_result(info, path);
  if (model::is_prepared_file(path)) return describe_prepared(info, context);
  if (unit != io::Unit::stated) info.unit = io::name_of(unit);

  // A file may be both: structured-light software exports scans as meshes.
  const auto mesh = io::read_mesh(path, unit);
  const auto scans = io::read_scans(path, unit);
  if (!mesh && !scans) {
    const bool is_mesh_format =
        extension_of(info.path) == "stl" || extension_of(info.path) == "off" || extension_of(info.path) == "obj";
    return tl::unexpected(is_mesh_format ? mesh.error() : scans.error());
  }
  info.kind = mesh ? "mesh" : "scan";
  info.format = scans && !scans->empty() ? scans->front().format : extension_of(info.path);
  if (scans) {
    for (const io::ScanFile& file : *scans) add_scan(info, file, context);
  }
  if (mesh) describe_mesh(info, *mesh);
  if (mesh && !scans) info.points = mesh->vertices.size();
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
                     {"has_grid", scan.has_grid}});
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

std::string lines_of(const FileInfo& info) {
  if (!info.error.empty()) return {};  // told on standard error
  const Eigen::Vector3d extent = info.box.isEmpty() ? Eigen::Vector3d::Zero().eval() : info.box.sizes().eval();
  std::string text =
      fmt::format("{}\n  {}, {}, unit {}\n  {} points, {} triangles, extent {:.6g} x {:.6g} x {:.6g} mm\n", info.path,
                  info.kind, info.format, info.unit, info.points, info.triangles, extent.x(), extent.y(), extent.z());
  for (const ScanInfo& scan : info.scans) {
    const std::string viewpoint = scan.viewpoint ? fmt::format("{:.4g}, {:.4g}, {:.4g}", scan.viewpoint->x(),
                                                               scan.viewpoint->y(), scan.viewpoint->z())
                                                 : "not stated";
    text += fmt::format("  scan {}: {} points, viewpoint {}, normals {}\n", scan.name, scan.points, viewpoint,
                        scan.has_normals ? "yes" : "no");
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
    if (const auto described = describe(info, arguments.unit, shell.context()); !described) {
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
  add_unit_option(*command, "--unit", arguments->unit, "Unit of the files: mm, cm, m, inch or foot");
  add_common_options(*command, shell, false);
  command->footer(
      "Examples:\n"
      "  asbuilt info part.stl scans/*.ply\n"
      "  asbuilt info scans/scan_00.ply --unit m --json");
  run_on_call(*command, shell, [arguments, &shell] { return run(*arguments, shell); });
}

}  // namespace asbuilt::cli
