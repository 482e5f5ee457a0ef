// SPDX-License-Identifier: Apache-2.0
#include "request_check.h"

#include <gtest/gtest.h>

namespace asbuilt::viewer {
namespace {

const AccessRules kLocal{true, 8600, ""};

TEST(RequestCheck, OnLoopbackOnlyLoopbackNamesAreAnswered) {
  for (const char* host : {"localhost:8600", "127.0.0.1:8600", "[::1]:8600", "localhost"}) {
    EXPECT_FALSE(refusal_of({host, "", "", ""}, kLocal)) << host;
  }
  for (const char* host : {"", "evil.example", "evil.example:8600", "localhost:80", "localhost.evil.example:8600",
                           "127.0.0.1.evil.example", "[::1]evil", "[::1", "127.0.0.2:8600"}) {
    const auto refused = refusal_of({host, "", "", ""}, kLocal);
    ASSERT_TRUE(refused) << host;
    EXPECT_EQ(refused->status, 403) << host;
  }
}

TEST(RequestCheck, PagesOfOtherSitesAreRefused) {
  EXPECT_FALSE(refusal_of({"localhost:8600", "http://localhost:8600", "", ""}, kLocal));
  for (const char* origin : {"http://evil.example", "null", "https://localhost:8600", "http://localhost:1"}) {
    EXPECT_TRUE(refusal_of({"localhost:8600", origin, "", ""}, kLocal)) << origin;
  }
}

TEST(RequestCheck, WhereATokenIsAskedForItMustBeTheRightOne) {
  const AccessRules rules{false, 8600, "secret"};
  EXPECT_FALSE(refusal_of({"scanner.lan:8600", "", "Bearer secret", ""}, rules));
  EXPECT_FALSE(refusal_of({"scanner.lan:8600", "", "", "secret"}, rules));
  for (const auto& head : {RequestHead{"scanner.lan", "", "", ""}, RequestHead{"scanner.lan", "", "", "secre"},
                           RequestHead{"scanner.lan", "", "", "secrets"}, RequestHead{"scanner.lan", "", "secret", ""},
                           RequestHead{"scanner.lan", "", "Bearer wrong", "secret"}}) {
    const auto refused = refusal_of(head, rules);
    ASSERT_TRUE(refused);
    EXPECT_EQ(refused->status, 401);
  }
}

TEST(RequestCheck, SecretsAreComparedWhole) {
  EXPECT_TRUE(same_secret("abc", "abc"));
  EXPECT_TRUE(same_secret("", ""));
  EXPECT_FALSE(same_secret("abc", "abd"));
  EXPECT_FALSE(same_secret("abcabc", "abc"));
  EXPECT_FALSE(same_secret("", "abc"));
  EXPECT_FALSE(same_secret("abc", ""));
}

TEST(RequestCheck, TokensAreLongAndDiffer) {
  EXPECT_EQ(random_token().size(), 32U);
  EXPECT_NE(random_token(), random_token());
}

}  // namespace
}  // namespace asbuilt::viewer
