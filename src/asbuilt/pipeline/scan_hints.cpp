// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/scan_hints.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <optional>

namespace asbuilt::pipeline {
namespace {

/// "a,b,c" as three finite numbers.
std::optional<Eigen::Vector3d> three_numbers(std::string_view text) {
  Eigen::Vector3d vector;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const char* const end_of_text = text.data() + text.size();
    const auto [end, error] = std::from_chars(text.data(), end_of_text, vector[axis]);
    if (error != std::errc() || !std::isfinite(vector[axis])) return std::nullopt;
    const bool is_last = axis == 2;
    if (is_last != (end == end_of_text) || (!is_last && *end != ',')) return std::nullopt;
    if (!is_last) text.remove_prefix(static_cast<std::size_t>(end - text.data()) + 1);
  }
  return vector;
}

Result<scan::Viewpoint> direction_from(std::string_view text) {
  const auto vector = three_numbers(text.substr(4));
  if (vector && vector->norm() > 0.0) return scan::Viewpoint{scan::Viewpoint::Kind::direction, vector->normalized()};
  return fail(ErrorCode::invalid_argument,
              fmt::format("--viewpoint {}: expected dir:dx,dy,dz, the direction in which parallel rays fly", text));
}

}  // namespace

bool names_scan(std::string_view typed, std::string_view path, std::string_view name) {
  if (typed == path || typed == name) return true;
  // Without its folder a file name still tells which scan is meant.
  return std::filesystem::path(typed) == std::filesystem::path(path).filename();
}

bool names_entry(std::string_view typed, const io::ScanRecord& entry) {
  if (names_scan(typed, entry.path, entry.name)) return true;
  std::string_view scan_name = entry.name;
  if (entry.instance > 1) scan_name = scan_name.substr(0, scan_name.rfind('#'));
  return typed == scan_name || typed == fmt::format("{}#{}", scan_name, entry.instance);
}

std::string entry_name(std::string_view scan_name, int instance) {
  return instance == 1 ? std::string(scan_name) : fmt::format("{}#{}", scan_name, instance);
}

Result<Viewpoints> Viewpoints::from_text(const std::string& text, io::Unit scan_unit) {
  Viewpoints viewpoints;
  if (text == "auto") return viewpoints;
  viewpoints.common_.automatic = false;
  if (text == "none") return viewpoints;
  if (text.starts_with("dir:")) {
    ASBUILT_TRY(direction, direction_from(text));
    viewpoints.common_.stated = direction;
    return viewpoints;
  }
  if (const auto position = three_numbers(text)) {
    viewpoints.common_.stated = {scan::Viewpoint::Kind::point, io::millimetres_per(scan_unit) * *position};
    return viewpoints;
  }
  if (!std::filesystem::exists(text)) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("--viewpoint {}: expected auto, none, x,y,z, dir:dx,dy,dz or an existing CSV file", text));
  }
  ASBUILT_TRY(rows, io::read_viewpoints(text, scan_unit));
  viewpoints.rows_ = std::move(rows);
  viewpoints.common_.automatic = true;
  return viewpoints;
}

scan::ViewpointRequest Viewpoints::of(std::string_view path, std::string_view name) const {
  const auto row =
      std::ranges::find_if(rows_, [&](const io::NamedViewpoint& r) { return names_scan(r.scan, path, name); });
  if (row == rows_.end()) return common_;
  return {false, {scan::Viewpoint::Kind::point, row->viewpoint_mm}};
}

}  // namespace asbuilt::pipeline
