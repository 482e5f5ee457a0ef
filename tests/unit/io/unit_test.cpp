// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/unit.h"

#include <gtest/gtest.h>

namespace asbuilt::io {
namespace {

TEST(Unit, IsTheLegalNumberOfMillimetres) {
  EXPECT_EQ(millimetres_per(Unit::stated), 1.0);
  EXPECT_EQ(millimetres_per(Unit::millimetre), 1.0);
  EXPECT_EQ(millimetres_per(Unit::centimetre), 10.0);
  EXPECT_EQ(millimetres_per(Unit::metre), 1000.0);
  EXPECT_EQ(millimetres_per(Unit::inch), 25.4);
  EXPECT_EQ(millimetres_per(Unit::foot), 304.8);
}

TEST(Unit, NamesGoBothWays) {
  for (const Unit unit : {Unit::millimetre, Unit::centimetre, Unit::metre, Unit::inch, Unit::foot}) {
    EXPECT_EQ(unit_from_name(name_of(unit)).value(), unit);
  }
  EXPECT_EQ(unit_from_name("in").value(), Unit::inch);
  EXPECT_EQ(unit_from_name("ft").value(), Unit::foot);
}

TEST(Unit, UnknownNamesAreRefusedWithTheListOfTheKnown) {
  for (const char* name : {"", "MM", "yard", "mm "}) {
    const auto unit = unit_from_name(name);
    ASSERT_FALSE(unit) << name;
    EXPECT_EQ(unit.error().code, ErrorCode::invalid_argument);
    EXPECT_NE(unit.error().message.find("expected mm, cm, m, inch or foot"), std::string::npos);
  }
}

}  // namespace
}  // namespace asbuilt::io
