// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "asbuilt/io/scan_file.h"

namespace asbuilt::test {

/// Files of many formats by other programs; not part of the project.
inline const std::filesystem::path kFormats = std::filesystem::path(ASBUILT_DATA_DIR) / "formats";

inline io::ScanFile only_scan(const std::filesystem::path& path, io::Unit unit = io::Unit::stated) {
  auto scans = io::read_scans(path, unit);
  EXPECT_TRUE(scans) << (scans ? "" : scans.error().message);
  EXPECT_EQ(scans.value().size(), 1u);
  return std::move(scans.value().at(0));
}

inline std::string error_of(const std::filesystem::path& path) {
  const auto scans = io::read_scans(path, io::Unit::stated);
  if (scans) return "no error";
  EXPECT_EQ(scans.error().code, ErrorCode::unreadable_input);
  return scans.error().message;
}

}  // namespace asbuilt::test
