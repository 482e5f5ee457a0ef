// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/cad_face_name.h"

#include <gmock/gmock.h>

#include "asbuilt/io/step_text.h"

namespace asbuilt::io {
namespace {

TEST(CadFaceName, IsToldBesideTheNumber) {
  const CadFaceNames names{{"bore A", ""}, {"", "lid"}, {"rim", "lid"}, {}};
  EXPECT_EQ(face_label(0, names), "face 0 \"bore A\"");
  EXPECT_EQ(face_label(1, names), "face 1 of lid");
  EXPECT_EQ(face_label(2, names), "face 2 \"rim\" of lid");
  EXPECT_EQ(face_label(3, names), "face 3");
  EXPECT_EQ(face_label(4, names), "face 4");
  EXPECT_EQ(face_label(-1, names), "face -1");
  EXPECT_EQ(face_label(12, {}), "face 12");
}

TEST(CadFaceName, ThatIsLongIsShortenedBetweenCharacters) {
  std::string name;
  for (int i = 0; i < 100; ++i) name += "ä";
  std::string shown;
  for (int i = 0; i < 48; ++i) shown += "ä";
  EXPECT_EQ(face_label(0, {{name, ""}}), "face 0 \"" + shown + "…\"");
}

TEST(CadFaceName, ThatMeansNoneIsNone) {
  for (const char* text : {"", "  ", "NONE", "none", " None ", "\t\n"}) EXPECT_EQ(clean_cad_name(text), "") << text;
  EXPECT_EQ(clean_cad_name("None of these"), "None of these");
}

TEST(CadFaceName, IsOneLineOfUtf8WhateverStandsInTheFile) {
  EXPECT_EQ(clean_cad_name(" bore\nA\r\x01 "), "bore A");
  EXPECT_EQ(clean_cad_name("a\x80z"), "a\xEF\xBF\xBDz");
  EXPECT_EQ(clean_cad_name("a\xC0\xAFz"), "a\xEF\xBF\xBD\xEF\xBF\xBDz");                // overlong
  EXPECT_EQ(clean_cad_name("a\xED\xA0\x80"), "a\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD");  // half a character
  EXPECT_EQ(clean_cad_name("a\xE2\x80\xAEz"), "a z");                                   // from right to left
  EXPECT_EQ(clean_cad_name("a\xE4"), "a\xEF\xBF\xBD");                                  // cut short
  EXPECT_EQ(clean_cad_name("<script>\"'&Ä €😀"), "<script>\"'&Ä €😀");
  EXPECT_EQ(clean_cad_name(std::string(10000, 'x')).size(), 500U);
}

TEST(StepText, DirectivesBecomeTheirCharacters) {
  EXPECT_EQ(decoded_step_text("plain"), "plain");
  EXPECT_EQ(decoded_step_text(R"(Dichtfl\X2\00E4\X0\che)"), "Dichtfläche");
  EXPECT_EQ(decoded_step_text(R"(\X2\03B103B2\X0\)"), "αβ");
  EXPECT_EQ(decoded_step_text(R"(\X2\D83DDE00\X0\)"), "😀");
  EXPECT_EQ(decoded_step_text(R"(\X4\0001F600\X0\)"), "😀");
  EXPECT_EQ(decoded_step_text(R"(\X\E4\S\d)"), "ää");
  EXPECT_EQ(decoded_step_text(R"(a\\b)"), R"(a\b)");
}

TEST(StepText, WhatIsNoWholeDirectiveStays) {
  for (const char* text : {R"(\X2\00E4)", R"(\X2\00G4\X0\)", R"(\X2\00E\X0\)", R"(\X\)", R"(\S\)", R"(\P)"}) {
    EXPECT_EQ(decoded_step_text(text), text);
  }
  EXPECT_EQ(decoded_step_text(R"(\X2\DC00\X0\)"), "\xEF\xBF\xBD");
}

}  // namespace
}  // namespace asbuilt::io
