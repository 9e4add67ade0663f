#include "lib/foxglove/utf8.h"

#include <gtest/gtest.h>

namespace vog {
namespace {

TEST(Utf8Test, CharactersStay) {
  for (const char* text : {"", "plain\n", "M\xC3\xBCller", "\xE2\x82\xAC", "\xED\x9F\xBF",
                           "\xF0\x9F\x90\x9F", "\xF4\x8F\xBF\xBF"})
    EXPECT_EQ(ToUtf8(text), text);
}

TEST(Utf8Test, OtherBytesBecomeQuestionMarks) {
  EXPECT_EQ(ToUtf8("a\x80z"), "a?z");
  EXPECT_EQ(ToUtf8("\xC3"), "?") << "cut short";
  EXPECT_EQ(ToUtf8("\xE2\x82z"), "??z");
  EXPECT_EQ(ToUtf8("\xC0\xAF"), "??") << "a slash in two bytes";
  EXPECT_EQ(ToUtf8("\xE0\x9F\xBF"), "???") << "two bytes in three";
  EXPECT_EQ(ToUtf8("\xED\xA0\x80"), "???") << "a surrogate";
  EXPECT_EQ(ToUtf8("\xF4\x90\x80\x80"), "????") << "above U+10FFFF";
  EXPECT_EQ(ToUtf8("\xFF\xC3\xBC"), "?\xC3\xBC");
}

}  // namespace
}  // namespace vog
