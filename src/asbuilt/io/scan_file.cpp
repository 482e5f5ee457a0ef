// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/scan_file.h"

#include <fmt/format.h>

#include <new>

#include "asbuilt/io/file.h"
#include "asbuilt/io/file_kind.h"
#include "asbuilt/io/gzip.h"
#include "asbuilt/io/readers.h"
#include "asbuilt/io/scan_assembly.h"

namespace asbuilt::io {
namespace {

/// The vertices of a mesh, as structured-light software exports its scans.
Result<std::vector<ScanFile>> scan_from_mesh(const std::filesystem::path& path, std::string format, const Input& input,
                                             const Result<TriangleMesh>& read, const ReadOptions& options) {
  if (!read) return tl::unexpected(read.error());
  if (read->vertices.empty()) return input.error("the file holds no points");
  RawPoints points;
  points.count = read->vertices.size();
  points.positions = values_in(read->vertices);
  ScanFile scan = assemble_scan(path, std::move(format), points, options);
  scan.notes.emplace_back("The file is a mesh: its vertices were taken as points.");
  const bool is_text = scan.format != "stl binary";
  if (is_text && !input.content.ends_with('\n')) {
    scan.notes.emplace_back("The last line has no line end: its last value may have been cut off.");
  }
  return std::vector<ScanFile>{std::move(scan)};
}

Result<std::vector<ScanFile>> read_kind(FileKind kind, const std::filesystem::path& path, const Input& input,
                                        const ReadOptions& options) {
  switch (kind) {
    case FileKind::ply:
      return read_ply_scan(path, input, options);
    case FileKind::pcd:
      return read_pcd_scan(path, input, options);
    case FileKind::text:
      return read_text_scan(path, input, options);
    case FileKind::e57:
      return read_e57_scans(path, input, options);
    case FileKind::ptx:
      return read_ptx_scans(path, input, options);
    case FileKind::las:
      return read_las_scan(path, input, options);
    case FileKind::depth_png:
      return read_depth_scan(path, input, options);
    case FileKind::stl:
      return scan_from_mesh(path, is_ascii_stl(input.content) ? "stl ascii" : "stl binary", input, read_stl_mesh(input),
                            options);
    case FileKind::off:
      return scan_from_mesh(path, "off", input, read_off_mesh(input), options);
    case FileKind::obj:
      return scan_from_mesh(path, "obj", input, read_obj_mesh(input), options);
    case FileKind::step:
    case FileKind::iges:
    case FileKind::brep:
      return input.error(fmt::format("is a CAD file ({}), expected a scan; the model stands first on the command line",
                                     name_of(kind)));
  }
  throw std::logic_error("asbuilt: expected a kind of file");
}

}  // namespace

Result<std::vector<ScanFile>> scans_from(const std::filesystem::path& path, const Input& input,
                                         const ReadOptions& options) {
  try {
    ASBUILT_TRY(kind, kind_of(path, input));
    return read_kind(kind, path, input, options);
  } catch (const std::bad_alloc&) {
    return input.error("the scan does not fit into memory");
  }
}

Result<std::vector<ScanFile>> scans_in(const std::filesystem::path& path, std::string_view content,
                                       const ReadOptions& options) {
  const Input input{path.string(), content};
  if (!is_gzip(content)) return scans_from(path, input, options);
  ASBUILT_TRY(unpacked, gunzip(input));
  ASBUILT_TRY(scans, scans_from(name_without_gz(path), {path.string(), unpacked}, options));
  for (ScanFile& scan : scans) scan.path = path;
  return std::move(scans);
}

Result<std::vector<ScanFile>> read_scans(const std::filesystem::path& path, const ReadOptions& options) {
  ASBUILT_TRY(content, FileContent::open(path));
  auto scans = scans_in(path, content.view(), options);
  ASBUILT_CHECK(content.whole());  // whatever a reader made of the zeros
  return scans;
}

}  // namespace asbuilt::io
