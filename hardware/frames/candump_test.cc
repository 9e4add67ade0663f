#include "hardware/frames/candump.h"

#include <gtest/gtest.h>

#include "lib/base/random.h"

namespace vog {
namespace {

CanFrame RandomFrame(Random& random) {
  CanFrame frame;
  frame.time = FromUtime(1'400'000'000'000'000 + random.Index(2'000'000'000));
  const int kind = random.Index(5);
  frame.extended = kind == 1 || (kind > 2 && random.Chance(0.5));
  frame.error = kind == 2;
  frame.remote = kind == 3;
  frame.fd = kind == 4;
  frame.id = random.Index((frame.extended || frame.error ? kMaxExtendedId : kMaxStandardId) + 1);
  frame.fd_flags = frame.fd ? random.Index(4) : 0;
  frame.size = random.Index((frame.fd ? kMaxFdSize : kMaxClassicSize) + 1);
  if (frame.remote) return frame;
  for (int i = 0; i < frame.size; ++i) frame.data[i] = random.Index(256);
  return frame;
}

TEST(CandumpTest, ReadsALineOfALog) {
  const auto line = ParseCandumpLine("(1436509052.249713) vcan0 044#2A366C2BBA\n");
  ASSERT_TRUE(line);
  EXPECT_EQ(line->interface, "vcan0");
  EXPECT_EQ(ToUtime(line->frame.time), 1436509052249713);
  EXPECT_EQ(line->frame.id, 0x44u);
  EXPECT_FALSE(line->frame.extended);
  EXPECT_EQ(line->frame.size, 5);
  EXPECT_EQ(line->frame.data[4], 0xBA);
}

TEST(CandumpTest, ReadsAllForms) {
  EXPECT_TRUE(ParseCandumpLine("(0000000001.000000) can0 123#")->frame.size == 0);
  EXPECT_TRUE(ParseCandumpLine("(0000000001.000000) can0 00000123#01 R")->frame.extended);
  EXPECT_TRUE(ParseCandumpLine("(0000000001.000000) can0 20000004#0004000000000000")->frame.error);
  EXPECT_EQ(ParseCandumpLine("(0000000001.000000) can0 123#R5")->frame.size, 5);
  EXPECT_TRUE(ParseCandumpLine("(0000000001.000000) can0 123#R")->frame.remote);
  EXPECT_EQ(ParseCandumpLine("(0000000001.000000) can0 123##3AABB")->frame.fd_flags, 3);
}

TEST(CandumpTest, RefusesAllElse) {
  for (const char* line :
       {"", "can0 123#", "(1.000000) can0", "(1.5) can0 123#", "(1.000000) 123#",
        "(1.000000) can0 FFF#", "(1.000000) can0 1234#", "(1.000000) can0 123#1",
        "(1.000000) can0 123#112233445566778899", "(1.000000) can0 123#R9", "(1.000000) can0 123##",
        "(1.000000) can0 123#GG", "(1.000000)can0 123#"})
    EXPECT_FALSE(ParseCandumpLine(line)) << line;
}

TEST(CandumpTest, WhatIsWrittenIsReadBack) {
  for (int i = 0; i < 2000; ++i) {
    Random random(1, "candump", i);
    const CandumpLine line{"vcan0", RandomFrame(random)};
    const std::string text = FormatCandumpLine(line);
    ASSERT_EQ(ParseCandumpLine(text), line) << text;
  }
}

}  // namespace
}  // namespace vog
