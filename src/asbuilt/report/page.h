// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "asbuilt/report/report.h"

// Private to this stage.
namespace asbuilt::report {

/// The page of asbuilt::web with its data in place of the mark.
[[nodiscard]] std::string page_with_data(std::string_view page, std::string_view report_json,
                                         std::string_view scene_json);

/// The page of a build without web pages: everything but the 3D view, and a word that it is missing. `pictures` are PNG
/// files of the standard views, put into the page.
[[nodiscard]] std::string plain_page(const ReportInput& input, const std::vector<std::string>& pictures);

}  // namespace asbuilt::report
