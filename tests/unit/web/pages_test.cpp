// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/web/pages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace asbuilt::web {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TEST(WebPages, AreThereIfTheyWereBuilt) {
  EXPECT_EQ(report_page().has_value(), ASBUILT_WITH_PAGES);
  EXPECT_EQ(live_page().has_value(), ASBUILT_WITH_PAGES);
}

TEST(WebPages, AreWholeDocuments) {
  if (!ASBUILT_WITH_PAGES) GTEST_SKIP() << "built without the web pages";
  for (const auto page : {report_page(), live_page()}) {
    EXPECT_THAT(*page, StartsWith("<!doctype html>"));
    EXPECT_THAT(*page, EndsWith("</html>\n"));
    EXPECT_EQ(page->find('\0'), std::string_view::npos);
  }
}

TEST(WebPages, TheReportHasOnePlaceForItsData) {
  if (!ASBUILT_WITH_PAGES) GTEST_SKIP() << "built without the web pages";
  const auto first = report_page()->find(kReportDataMark);
  ASSERT_NE(first, std::string_view::npos);
  EXPECT_EQ(report_page()->find(kReportDataMark, first + 1), std::string_view::npos);
}

TEST(WebPages, NameNoFileToFetch) {
  if (!ASBUILT_WITH_PAGES) GTEST_SKIP() << "built without the web pages";
  for (const auto page : {report_page(), live_page()}) {
    EXPECT_THAT(*page, Not(HasSubstr("<script src")));
    EXPECT_THAT(*page, Not(HasSubstr("<link rel=\"stylesheet\"")));
    EXPECT_THAT(*page, Not(HasSubstr(" href=\"http")));
    EXPECT_THAT(*page, Not(HasSubstr("@import")));
    EXPECT_THAT(*page, Not(HasSubstr("url(http")));
  }
}

}  // namespace
}  // namespace asbuilt::web
