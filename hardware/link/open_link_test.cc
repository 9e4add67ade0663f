#include "hardware/link/open_link.h"

#include <gtest/gtest.h>

#include <fstream>

#include "hardware/link/backoff.h"
#include "hardware/link/link_testing.h"
#include "hardware/link/loopback_links.h"
#include "hardware/link/recorded_links.h"
#include "lib/base/errors.h"

namespace vog {
namespace {

CanFrame FrameOf(std::uint32_t id, std::uint8_t size) {
  CanFrame frame;
  frame.id = id;
  frame.size = size;
  for (int i = 0; i < size; ++i) frame.data[i] = static_cast<std::uint8_t>(i + 1);
  return frame;
}

TEST(BackoffTest, WaitsTwiceAsLongEachTimeUpTo5Seconds) {
  Backoff dut;
  Time now{};
  EXPECT_TRUE(dut.IsDue(now));
  for (const int ms : {10, 20, 40, 80, 160, 320, 640, 1280, 2560, 5000, 5000}) {
    dut.Fail(now);
    EXPECT_FALSE(dut.IsDue(now + std::chrono::milliseconds(ms) - Duration(1)));
    now += std::chrono::milliseconds(ms);
    EXPECT_TRUE(dut.IsDue(now));
  }
  dut.Fail(now);
  dut.Reset();
  EXPECT_TRUE(dut.IsDue(now));
}

TEST(FileLinkTest, GivesTheBytesOfTheFileAndEnds) {
  const TestFolder folder;
  std::ofstream(folder.File("x.bin"), std::ios::binary) << AllBytes();
  FileLink dut(folder.File("x.bin"));
  EXPECT_EQ(ReadText(dut, 100), AllBytes().substr(0, 100));
  EXPECT_EQ(ReadText(dut, 1000), AllBytes().substr(100));
  std::uint8_t byte;
  EXPECT_EQ(dut.Read({&byte, 1}).outcome, ReadOutcome::kClosed);
  EXPECT_EQ(dut.counters().bytes_in, 256);
  EXPECT_THROW(FileLink(folder.File("none")), UsageError);
  EXPECT_THROW(FileLink(folder.File("")), UsageError);
}

TEST(CandumpLinkTest, GivesTheFramesOfTheLogAndCountsWhatIsNone) {
  const TestFolder folder;
  std::ofstream(folder.File("x.log")) << "(1436509052.249713) vcan0 044#2A366C2BBA\n"
                                         "no frame\n(1436509053.000000) vcan0 12345678##1AABB\n";
  CandumpLink dut(folder.File("x.log"));
  const CanRead first = dut.Read(), second = dut.Read();
  EXPECT_EQ(first.frame.id, 0x44u);
  EXPECT_EQ(ToUtime(first.frame.time), 1436509052249713);
  EXPECT_TRUE(second.frame.fd && second.frame.extended);
  EXPECT_EQ(dut.Read().outcome, ReadOutcome::kClosed);
  EXPECT_EQ(dut.counters().errors, 1);
  EXPECT_EQ(dut.counters().bytes_in, 7);
}

TEST(LoopbackTest, BytesPassBothWaysUpToABound) {
  auto [a, b] = MakeLoopback();
  WriteText(*a, "to b");
  WriteText(*b, "to a");
  EXPECT_EQ(ReadText(*b), "to b");
  EXPECT_EQ(ReadText(*a), "to a");
  EXPECT_EQ(ReadText(*a), "");
  for (int i = 0; i < 100; ++i) WriteText(*a, std::string(1000, 'x'));
  EXPECT_EQ(a->counters().dropped, 100 - 65);
  a.reset();
  std::string text;
  for (std::string part = ReadText(*b); !part.empty(); part = ReadText(*b)) text += part;
  EXPECT_EQ(text.size(), 65'000u);
  std::uint8_t byte;
  EXPECT_EQ(b->Read({&byte, 1}).outcome, ReadOutcome::kClosed);
  WriteText(*b, "lost");
  EXPECT_EQ(b->counters().dropped, 1);
}

TEST(LoopbackTest, FramesPassBothWaysUpToABound) {
  auto [a, b] = MakeCanLoopback();
  EXPECT_EQ(b->Read().outcome, ReadOutcome::kNothing);
  for (std::size_t i = 0; i < kMaxLoopbackFrames + 5; ++i) a->Write(FrameOf(i, 8));
  EXPECT_EQ(a->counters().dropped, 5);
  EXPECT_EQ(b->Read().frame, FrameOf(0, 8));
  EXPECT_EQ(b->Read().frame, FrameOf(1, 8));
  b->Write(FrameOf(7, 3));
  EXPECT_EQ(a->Read().frame, FrameOf(7, 3));
}

TEST(OpenLinkTest, OpensWhatTheUrlSays) {
  const TestFolder folder;
  std::ofstream(folder.File("x")) << "abc";
  EXPECT_EQ(ReadText(*OpenByteLink({"file:" + folder.File("x")})), "abc");
  EXPECT_EQ(OpenCanLink({"candump:" + folder.File("x")})->Read().outcome, ReadOutcome::kClosed);
  EXPECT_EQ(OpenByteLink({"serial:" + folder.File("none") + "?baud=250000"})->fd(), -1);
  EXPECT_EQ(OpenByteLink({"tcp:127.0.0.1:1"})->fd(), -1);
}

TEST(OpenLinkTest, RefusesAllElseOnOneLine) {
  for (const char* url :
       {"", "serial", "serial:", "serial:/dev/null?", "nonsense:x",
        "serial:/dev/null?baud=", "serial:/dev/null?baud=fast", "serial:/dev/null?baud=1",
        "serial:/dev/null?parity=odd", "tcp:host", "tcp:127.0.0.1:1?baud=9600", "udp:x", "udp:0",
        "udp:1?peer=x", "file:/none", "can:can0", "candump:/none"}) {
    try {
      OpenByteLink({url});
      ADD_FAILURE() << url;
    } catch (const UsageError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    } catch (const SystemError& error) {  // "?" alone is no setting: /dev/null is no serial line.
      EXPECT_EQ(std::string(url), "serial:/dev/null?") << error.what();
    }
  }
  for (const char* url : {"tcp:127.0.0.1:1", "candump:/none", "can:can0?filter=1", "can:can0?x=1",
                          "can:can0?filter=xyz:7FF", "can:"})
    EXPECT_THROW(OpenCanLink({url}), UsageError) << url;
}

TEST(OpenLinkTest, OptionsAreReadFromAConfiguration) {
  const Config config = Config::Parse("[dvl]\nurl = \"udp:5000\"\n", "test");
  EXPECT_EQ(config.Read<LinkOptions>("dvl").url, "udp:5000");
}

}  // namespace
}  // namespace vog
