// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

namespace asbuilt::web {

/// Where report_page() wants its data: the two script elements described in docs/web.md.
inline constexpr std::string_view kReportDataMark = "<!-- asbuilt:data -->";

/// The report page, one self-contained HTML document, UTF-8, that holds kReportDataMark once. Nothing when the library
/// was built without the web pages (no node or npm, or ASBUILT_WITH_WEB=OFF).
std::optional<std::string_view> report_page();

/// The live page, one self-contained HTML document, UTF-8. Nothing when built without the web pages.
std::optional<std::string_view> live_page();

}  // namespace asbuilt::web
