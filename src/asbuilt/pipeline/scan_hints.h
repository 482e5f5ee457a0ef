// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "asbuilt/core/result.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/io/unit.h"
#include "asbuilt/io/viewpoint_file.h"
#include "asbuilt/scan/viewpoint.h"

namespace asbuilt::pipeline {

/// Whether what the user typed names this scan: its name, or its path as given.
[[nodiscard]] bool names_scan(std::string_view typed, std::string_view path, std::string_view name);

/// The same for an entry of the record. Where a scan has several, one for each placement of the part, the scan's name
/// names them all, and NAME#1, NAME#2 ... one of them.
[[nodiscard]] bool names_entry(std::string_view typed, const io::ScanRecord& entry);

/// Name of the entry for a placement of the part in a scan: that of the scan for the first, then NAME#2, NAME#3 ...
[[nodiscard]] std::string entry_name(std::string_view scan_name, int instance);

/// What --viewpoint says of each scan.
class Viewpoints {
 public:
  /// auto, none, x,y,z, dir:dx,dy,dz or the name of a CSV file whose rows are SCAN,x,y,z. Coordinates are those of the
  /// scan files, so `scan_unit` applies to them too. Errors: invalid_argument (text), unreadable_input (file).
  [[nodiscard]] static Result<Viewpoints> from_text(const std::string& text, io::Unit scan_unit);

  /// In the coordinates of the file, mm. Scans that a CSV does not list are decided automatically.
  [[nodiscard]] scan::ViewpointRequest of(std::string_view path, std::string_view name) const;

 private:
  scan::ViewpointRequest common_;
  std::vector<io::NamedViewpoint> rows_;
};

}  // namespace asbuilt::pipeline
