// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/web/pages.h"

// The build defines the paths of both pages, or neither. They are brought in by the assembler: as C++ literals they
// would cost the compiler seconds and hundreds of megabytes.
#ifdef ASBUILT_REPORT_PAGE

#define ASBUILT_EMBED(name, path)     \
  __asm__(                            \
      ".pushsection .rodata\n"        \
      ".global " #name                \
      "\n"                            \
      ".hidden " #name "\n" #name     \
      ":\n"                           \
      ".incbin \"" path               \
      "\"\n"                          \
      ".global " #name                \
      "_end\n"                        \
      ".hidden " #name "_end\n" #name \
      "_end:\n"                       \
      ".byte 0\n"                     \
      ".popsection\n");               \
  extern "C" {                        \
  extern const char name[];           \
  extern const char name##_end[];     \
  }

ASBUILT_EMBED(asbuilt_web_report_page, ASBUILT_REPORT_PAGE)
ASBUILT_EMBED(asbuilt_web_live_page, ASBUILT_LIVE_PAGE)

namespace asbuilt::web {

std::optional<std::string_view> report_page() {
  return std::string_view(asbuilt_web_report_page,
                          static_cast<std::size_t>(asbuilt_web_report_page_end - asbuilt_web_report_page));
}

std::optional<std::string_view> live_page() {
  return std::string_view(asbuilt_web_live_page,
                          static_cast<std::size_t>(asbuilt_web_live_page_end - asbuilt_web_live_page));
}

}  // namespace asbuilt::web

#else

namespace asbuilt::web {

std::optional<std::string_view> report_page() { return std::nullopt; }

std::optional<std::string_view> live_page() { return std::nullopt; }

}  // namespace asbuilt::web

#endif
