// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/file_kind.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "asbuilt/io/lines.h"
#include "asbuilt/io/readers.h"
#include "asbuilt/io/scalar_load.h"

namespace asbuilt::io {
namespace {

constexpr std::string_view kSupported =
    "expected a scan (.ply, .pcd, .e57, .ptx, .las, .xyz, .asc, .pts, .txt, .csv, .png) or a model (.step, .iges, "
    ".brep, "
    ".stl, .ply, .obj, .off)";

struct Unsupported {
  std::string_view mark;  ///< how such a file begins, or its extension
  std::string_view named;
  std::string_view way_out;
};

constexpr std::string_view kMeshWayOut = "export it as STL, OBJ or PLY", kScanWayOut = "export it as PLY or PCD";

constexpr std::array kUnsupportedContent{
    Unsupported{"glTF", "a binary glTF file", kMeshWayOut},
    Unsupported{"#VRML", "a VRML file", kMeshWayOut},
    Unsupported{"# vtk DataFile", "a VTK file", "export it as PLY"},
    Unsupported{"PK\x03\x04", "a ZIP archive (or a 3MF file)", "unpack it, or export it as STL, OBJ or PLY"},
    Unsupported{"\xd0\xcf\x11\xe0", "a CAD or office file of a closed kind", kMeshWayOut},
    Unsupported{"%PDF", "a PDF document", kMeshWayOut},
    Unsupported{"<?xml", "an XML file", "export the mesh as STL, OBJ or PLY"},
};

constexpr std::array kUnsupportedExtensions{
    Unsupported{".3mf", "a 3MF file", kMeshWayOut},
    Unsupported{".gltf", "a glTF file", kMeshWayOut},
    Unsupported{".dae", "a COLLADA file", kMeshWayOut},
    Unsupported{".wrl", "a VRML file", kMeshWayOut},
    Unsupported{".dxf", "a DXF file", kMeshWayOut},
    Unsupported{".sldprt", "a SolidWorks part", kMeshWayOut},
    Unsupported{".ipt", "an Inventor part", kMeshWayOut},
    Unsupported{".catpart", "a CATIA part", kMeshWayOut},
    Unsupported{".prt", "a CAD part of a closed kind", kMeshWayOut},
    Unsupported{".ptg", "a PTG file", kScanWayOut},
    Unsupported{".fls", "a FARO scan", kScanWayOut},
    Unsupported{".zfs", "a Zoller+Froehlich scan", kScanWayOut},
    Unsupported{".rcp", "a ReCap project", kScanWayOut},
    Unsupported{".rcs", "a ReCap scan", kScanWayOut},
    Unsupported{".vtk", "a VTK file", kScanWayOut},
    Unsupported{".vtp", "a VTK file", kScanWayOut},
    Unsupported{".pcap", "a packet capture", kScanWayOut},
};

tl::unexpected<Error> refuse(const Input& input, const Unsupported& kind) {
  return input.error(fmt::format("is {}, which is not read, {}", kind.named, kind.way_out));
}

bool is_binary_stl_by_size(std::string_view content) {
  if (content.size() < 84) return false;
  const double facets = load_scalar<std::uint32_t, std::endian::little>(content.data() + 80);
  return 84.0 + 50.0 * facets == static_cast<double>(content.size());
}

std::string_view without_leading_blanks(std::string_view content) {
  const std::size_t begin = content.find_first_not_of(" \t\r\n");
  return begin == std::string_view::npos ? std::string_view{} : content.substr(begin);
}

/// PCD has no magic number but a fixed order of header lines; comments may stand before them.
bool is_pcd(std::string_view content) {
  LineCursor lines(content.substr(0, 4096));
  while (lines.next_with_content()) {
    WordCursor words(lines.line());
    const std::string_view first = words.next();
    if (first.starts_with('#')) {
      if (lines.line().find(".PCD") != std::string_view::npos) return true;
      continue;
    }
    return (first == "VERSION" && !words.next().empty()) || first == "FIELDS";
  }
  return false;
}

/// IGES: cards of 80 columns with the letter of the section in column 73.
bool is_iges(std::string_view content) {
  LineCursor lines(content);
  return lines.next() && lines.line().size() >= 80 && lines.line()[72] == 'S' && lines.line().ends_with('1');
}

std::optional<FileKind> kind_from_content(std::string_view content) {
  if (content.starts_with("ASTM-E57")) return FileKind::e57;
  if (content.starts_with("LASF")) return FileKind::las;
  if (content.starts_with("\x89PNG")) return FileKind::depth_png;
  if (content.starts_with("ply\n") || content.starts_with("ply\r\n")) return FileKind::ply;
  if (is_binary_stl_by_size(content) || is_ascii_stl(content)) return FileKind::stl;
  const std::string_view text = without_leading_blanks(content);
  for (const std::string_view off : {"OFF", "COFF", "NOFF", "CNOFF", "STOFF"}) {
    if (text.starts_with(off) && text.size() > off.size() &&
        (text[off.size()] == '\n' || text[off.size()] == '\r' || text[off.size()] == ' ')) {
      return FileKind::off;
    }
  }
  if (is_pcd(content)) return FileKind::pcd;
  if (text.starts_with("ISO-10303-21")) return FileKind::step;
  if (text.starts_with("DBRep_DrawableShape") || text.starts_with("CASCADE Topology")) return FileKind::brep;
  if (is_iges(content)) return FileKind::iges;
  if (is_ptx(content)) return FileKind::ptx;
  return std::nullopt;
}

}  // namespace

std::string_view name_of(FileKind kind) {
  constexpr std::string_view kNames[] = {"ply", "pcd", "stl",       "off",  "obj",  "text", "e57",
                                         "ptx", "las", "png depth", "step", "iges", "brep"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::optional<FileKind> kind_from_extension(std::string_view extension) {
  if (extension == ".ply") return FileKind::ply;
  if (extension == ".pcd") return FileKind::pcd;
  if (extension == ".stl" || extension == ".stla" || extension == ".stlb") return FileKind::stl;
  if (extension == ".off" || extension == ".coff" || extension == ".noff") return FileKind::off;
  if (extension == ".obj") return FileKind::obj;
  if (extension == ".ptx") return FileKind::ptx;
  if (extension == ".e57") return FileKind::e57;
  if (extension == ".las" || extension == ".laz") return FileKind::las;
  if (extension == ".step" || extension == ".stp" || extension == ".p21") return FileKind::step;
  if (extension == ".iges" || extension == ".igs") return FileKind::iges;
  if (extension == ".brep" || extension == ".brp") return FileKind::brep;
  constexpr std::array<std::string_view, 8> kText{".xyz", ".asc", ".pts", ".txt", ".csv", ".xyzn", ".xyzrgb", ".ascii"};
  if (std::ranges::find(kText, extension) != kText.end()) return FileKind::text;
  return std::nullopt;
}

bool is_cad(FileKind kind) { return kind == FileKind::step || kind == FileKind::iges || kind == FileKind::brep; }

bool is_ascii_stl(std::string_view content) {
  if (is_binary_stl_by_size(content)) return false;
  const std::string_view text = without_leading_blanks(content);
  if (lower_case(text.substr(0, 5)) != "solid") return false;
  // The head of a binary file is padded with zeros or blanks, and its numbers are hardly ever free of zeros.
  return text.substr(0, 1024).find('\0') == std::string_view::npos;
}

Result<FileKind> kind_of(const std::filesystem::path& path, const Input& input) {
  if (input.content.empty()) return input.error(fmt::format("the file is empty, {}", kSupported));
  if (const auto kind = kind_from_content(input.content)) return *kind;
  for (const Unsupported& kind : kUnsupportedContent) {
    if (input.content.starts_with(kind.mark)) return refuse(input, kind);
  }
  const std::string extension = lower_case(path.extension().string());
  if (const auto kind = kind_from_extension(extension)) return *kind;
  const auto known = std::ranges::find(kUnsupportedExtensions, extension, &Unsupported::mark);
  if (known != kUnsupportedExtensions.end()) return refuse(input, *known);
  return input.error(fmt::format("the kind of file is unknown (extension {}), {}", in_quotes(extension), kSupported));
}

}  // namespace asbuilt::io
