#include "procs/viewer/board.h"

#include <gtest/gtest.h>

#include "procs/viewer/history.h"
#include "procs/viewer/trail.h"

namespace vog {
namespace {

std::vector<std::string> ReadAll(const Board& board, std::int64_t& revision) {
  std::vector<std::string> texts;
  while (const Frame* frame = board.After(revision)) texts.push_back(*frame->bytes);
  return texts;
}

TEST(BoardTest, AReaderGetsEachKeysNewestInTheOrderOfChange) {
  using Texts = std::vector<std::string>;
  Board dut;
  std::int64_t quick = 0, slow = 0;
  dut.Post({FrameKind::kPlan, 0}, TextFrame("plan 1"));
  dut.Post({FrameKind::kSubmap, 7}, TextFrame("submap 7"));
  EXPECT_EQ(ReadAll(dut, quick), (Texts{"plan 1", "submap 7"}));
  EXPECT_EQ(ReadAll(dut, quick), Texts{});
  for (int i = 2; i < 1000; ++i)
    dut.Post({FrameKind::kPlan, 0}, TextFrame("plan " + std::to_string(i)));
  EXPECT_EQ(dut.size(), 2u) << "what was replaced is gone";
  EXPECT_EQ(ReadAll(dut, quick), Texts{"plan 999"});
  EXPECT_EQ(ReadAll(dut, slow), (Texts{"submap 7", "plan 999"}));
  const auto before = dut.generation();
  dut.Clear();
  EXPECT_NE(dut.generation(), before);
  EXPECT_EQ(dut.size(), 0u);
}

std::vector<std::string> TextsAt(const History& history, std::int64_t utime_us) {
  std::vector<std::string> texts;
  for (const Frame& frame : history.At(utime_us)) texts.push_back(*frame.bytes);
  return texts;
}

TEST(HistoryTest, TellsHowThingsWereAtATime) {
  using Texts = std::vector<std::string>;
  History dut(1 << 20);
  dut.Add(FrameKind::kPlan, 10, TextFrame("plan 10"));
  dut.Add(FrameKind::kPoses, 20, TextFrame("poses 20"));
  dut.Add(FrameKind::kPlan, 30, TextFrame("plan 30"));
  dut.Add(FrameKind::kPlan, 25, TextFrame("too late"));
  EXPECT_EQ(TextsAt(dut, 9), Texts{});
  EXPECT_EQ(TextsAt(dut, 10), Texts{"plan 10"});
  EXPECT_EQ(TextsAt(dut, 29), (Texts{"poses 20", "plan 10"}));
  EXPECT_EQ(TextsAt(dut, 1000), (Texts{"poses 20", "plan 30"}));
}

TEST(HistoryTest, WhenFullThePastBecomesCoarseButStaysWhole) {
  constexpr std::size_t kLimit = 100000;
  History dut(kLimit);
  dut.Add(FrameKind::kPlan, 0, TextFrame("the plan"));
  for (int i = 0; i < 20000; ++i)
    dut.Add(FrameKind::kPoses, i, BinaryFrame(std::to_string(i) + std::string(200, ' ')));
  EXPECT_LE(dut.bytes(), kLimit);
  EXPECT_GT(dut.bytes(), kLimit / 4);
  EXPECT_EQ(*dut.At(0).back().bytes, "the plan") << "small kinds keep all";
  EXPECT_EQ(std::stoi(*dut.At(0).front().bytes), 0) << "the beginning stays";
  EXPECT_EQ(std::stoi(*dut.At(19999).front().bytes), 19999);
  int before = -1;
  for (int t = 0; t < 20000; t += 1000) {
    const int shown = std::stoi(*dut.At(t).front().bytes);
    EXPECT_LE(shown, t);
    EXPECT_GE(shown, before);
    before = shown;
  }
}

TEST(TrailTest, KeepsAPointPerStepAndOneForEachPause) {
  Trail dut;
  const auto add = [&](double t_s, double x) {
    return dut.Add({FromUtime(static_cast<std::int64_t>(1e6 * t_s)), -1, Vec3(x, 0, 0)},
                   Vec3(x, 0, 0));
  };
  EXPECT_TRUE(add(0, 0));
  EXPECT_FALSE(add(0.1, 0.04));
  EXPECT_TRUE(add(0.2, 0.06));
  EXPECT_FALSE(add(1, 0.06));
  EXPECT_TRUE(add(6, 0.06));
  EXPECT_EQ(dut.part().size(), 3u);
}

TEST(TrailTest, PartsHangTogether) {
  Trail dut;
  std::vector<double> path;
  for (int i = 0; i < 300; ++i) {
    const int part = dut.part_number();
    const double last = dut.part().empty() ? 0 : dut.part().back().position_m.x();
    ASSERT_TRUE(dut.Add({FromUtime(i), -1, Vec3(i, 0, 0)}, Vec3(i, 0, 0)));
    ASSERT_LE(dut.part().size(), Trail::kPartPoints);
    if (dut.part_number() != part) {
      EXPECT_EQ(dut.part().front().position_m.x(), last);
    }
  }
  EXPECT_EQ(dut.part_number(), 2);
  EXPECT_EQ(dut.part().back().position_m.x(), 299);
}

}  // namespace
}  // namespace vog
