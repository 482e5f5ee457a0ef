// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "asbuilt/report/report.h"

// Private to this stage.
namespace asbuilt::report {

/// How well the place of a scan is known, at the middle of the part.
struct PlaceError {
  std::optional<double> position_mm, rotation_deg;
};
[[nodiscard]] PlaceError place_error(const io::ScanRecord& scan, const Eigen::Vector3d& middle_in_model);

/// What the links of a scan say.
struct LinkSummary {
  int links = 0;
  std::optional<double> best_overlap, residual_mm;
};
[[nodiscard]] LinkSummary links_of(const io::RunRecord& record, int scan);

/// The residual of one link, both ways together; nothing if it was not refined.
struct LinkResidual {
  double rms_mm = 0.0;
  std::uint64_t pairs = 0;
};
[[nodiscard]] std::optional<LinkResidual> residual_of(const io::RunRecord& record, int a, int b);

/// Spots that a scan brought most points to.
[[nodiscard]] std::size_t spots_of(const inspect::DeviationReport& deviations, std::size_t scan);

[[nodiscard]] std::string alignment_method(const ReportInput& input);
[[nodiscard]] std::string alignment_detail(const ReportInput& input);
[[nodiscard]] std::string verdict_reason(const ReportInput& input);

/// A signed number with a real minus sign, three significant digits.
[[nodiscard]] std::string signed_mm(double value);

}  // namespace asbuilt::report
