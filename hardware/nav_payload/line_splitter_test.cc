#include "hardware/nav_payload/line_splitter.h"

#include <gtest/gtest.h>

#include "lib/base/random.h"

namespace vog {
namespace {

using Lines = std::vector<std::string>;

ByteSpan AsBytes(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

TEST(LineSplitterTest, BothEndsOfLinesEndThem) {
  LineSplitter dut;
  EXPECT_EQ(dut.Add(AsBytes("one\r\ntwo\n\nthree\rfo")), (Lines{"one", "two", "three"}));
  EXPECT_EQ(dut.buffered_bytes(), 2u);
  EXPECT_EQ(dut.Add(AsBytes("ur\n")), (Lines{"four"}));
  EXPECT_EQ(dut.garbage_bytes(), 0);
}

TEST(LineSplitterTest, TheChunksDoNotMatter) {
  std::string text;
  for (int i = 0; i < 50; ++i) text += std::string(i, 'a') + "\r\n";
  const Lines expected = LineSplitter().Add(AsBytes(text));
  for (int seed = 0; seed < 20; ++seed) {
    Random random(1, "chunks", seed);
    LineSplitter dut;
    Lines lines;
    for (std::size_t begin = 0; begin < text.size();) {
      const std::string chunk = text.substr(begin, random.Index(30));
      for (const std::string& line : dut.Add(AsBytes(chunk))) lines.push_back(line);
      begin += chunk.size();
    }
    EXPECT_EQ(lines, expected);
  }
}

TEST(LineSplitterTest, GarbageIsCountedAndLeftOut) {
  LineSplitter dut;
  EXPECT_EQ(dut.Add(AsBytes("ab\x80\xff$GOOD\n")), (Lines{"$GOOD"}));
  EXPECT_EQ(dut.garbage_bytes(), 4);
}

TEST(LineSplitterTest, ALineThatIsTooLongIsLeftOutWhole) {
  LineSplitter dut(10);
  EXPECT_EQ(dut.Add(AsBytes("0123456789\n")), (Lines{"0123456789"}));
  EXPECT_TRUE(dut.Add(AsBytes(std::string(1000, 'x'))).empty());
  EXPECT_LE(dut.buffered_bytes(), 10u);
  EXPECT_EQ(dut.Add(AsBytes("tail\nnext\n")), (Lines{"next"}));
  EXPECT_EQ(dut.garbage_bytes(), 1004);
}

}  // namespace
}  // namespace vog
