#include "lib/base/base64.h"

#include <gtest/gtest.h>

namespace vog {
namespace {

TEST(ToBase64Test, IsThatOfTheRfc) {
  EXPECT_EQ(ToBase64(""), "");
  EXPECT_EQ(ToBase64("f"), "Zg==");
  EXPECT_EQ(ToBase64("fo"), "Zm8=");
  EXPECT_EQ(ToBase64("foo"), "Zm9v");
  EXPECT_EQ(ToBase64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(ToBase64("\xff\xef\xff"), "/+//");
}

}  // namespace
}  // namespace vog
