#include "hardware/sonar/didson_stream.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "hardware/sonar/frames_testing.h"

namespace vog {
namespace {

constexpr DidsonPacking kPackings[] = {DidsonPacking::kHuls3, DidsonPacking::kHauv1b};

class DidsonStreamTest : public testing::Test {
 protected:
  /// The datagrams of frames 0 .. frames - 1, one after the other.
  static std::vector<ByteVector> Datagrams(DidsonPacking packing, int beams, int frames,
                                           std::uint16_t sequence = 100) {
    std::vector<ByteVector> all;
    for (int i = 0; i < frames; ++i) {
      for (ByteVector& datagram : EncodeDatagrams(packing, RandomDidsonFrame(beams, i), sequence)) {
        all.push_back(std::move(datagram));
        ++sequence;
      }
    }
    return all;
  }
  /// Adds them; each frame that comes must be one that was sent, whole.
  void Add(const std::vector<ByteVector>& datagrams) {
    for (const ByteVector& datagram : datagrams) {
      const auto frame = dut_.Add(datagram);
      if (!frame) continue;
      const int index = static_cast<int>(frame->header.frame_number);
      EXPECT_EQ(frame->samples, RandomDidsonFrame(BeamsOf(frame->header), index).samples);
      got_.push_back(index);
    }
  }

  DidsonStream dut_;
  std::vector<int> got_;
};

TEST(DidsonDatagramsTest, LookAsOnTheWire) {
  const DidsonFrame frame = RandomDidsonFrame(96, 3);
  const auto huls3 = EncodeDatagrams(DidsonPacking::kHuls3, frame, 65535);
  ASSERT_EQ(huls3.size(), 7u);
  EXPECT_EQ(huls3[0].size(), 8 + 1024u);
  EXPECT_EQ(huls3[0][0], 0x02);
  EXPECT_EQ(huls3[0][1], 0x5a);
  EXPECT_EQ(huls3[0][4], 0x08);
  EXPECT_EQ(LoadLittle<std::uint32_t>(huls3[0], 8), 3u);  // The frame's number is at byte 8.
  for (int i = 1; i <= 6; ++i) {
    EXPECT_EQ(huls3[i].size(), 8200u);
    EXPECT_EQ(huls3[i][4], i == 6 ? 0x30 : 0x10);
    EXPECT_EQ(LoadLittle<std::uint16_t>(huls3[i], 6), i - 1);
    EXPECT_EQ(huls3[i][8], frame.samples[8192 * (i - 1)]);
  }
  const auto hauv1b = EncodeDatagrams(DidsonPacking::kHauv1b, frame, 0);
  ASSERT_EQ(hauv1b.size(), 2u);
  EXPECT_EQ(hauv1b[0].size(), 8 + 1024 + 24576u);
  EXPECT_EQ(hauv1b[1].size(), 8 + 24576u);
  EXPECT_EQ(hauv1b[1][4], 0x22);
}

TEST_F(DidsonStreamTest, FramesOfAnyKindComeTogether) {
  for (const DidsonPacking packing : kPackings) {
    for (const int beams : {96, 48}) {
      dut_ = {};
      got_ = {};
      Add(Datagrams(packing, beams, 5, 65530));
      EXPECT_EQ(got_, (std::vector{0, 1, 2, 3, 4}));
      EXPECT_EQ(dut_.counters().frames, 5);
      EXPECT_EQ(dut_.counters().lost, 0);
      EXPECT_EQ(dut_.counters().restarts, 0);
    }
  }
}

TEST_F(DidsonStreamTest, TheOtherTypeOfHeaderCountsToo) {
  auto datagrams = Datagrams(DidsonPacking::kHuls3, 96, 1);
  datagrams[0][4] = 0x48;
  Add(datagrams);
  EXPECT_EQ(got_, std::vector{0});
}

TEST_F(DidsonStreamTest, AFrameThatLostADatagramIsDroppedAlone) {
  for (const DidsonPacking packing : kPackings) {
    const std::size_t per_frame = packing == DidsonPacking::kHuls3 ? 7 : 2;
    for (std::size_t lost = 0; lost < per_frame; ++lost) {
      dut_ = {};
      got_ = {};
      auto datagrams = Datagrams(packing, 96, 40);
      datagrams.erase(datagrams.begin() + static_cast<std::ptrdiff_t>(per_frame + lost));
      Add(datagrams);
      EXPECT_EQ(got_.size(), 39u);
      EXPECT_EQ(std::count(got_.begin(), got_.end(), 1), 0);
      EXPECT_EQ(dut_.counters().lost, 1);
      EXPECT_EQ(dut_.counters().incomplete, lost == 0 ? 0 : 1);
    }
  }
}

TEST_F(DidsonStreamTest, DuplicatesAndOtherOrdersDoNoHarm) {
  for (const DidsonPacking packing : kPackings) {
    dut_ = {};
    got_ = {};
    auto datagrams = Datagrams(packing, 96, 6);
    for (std::size_t i = 2; i + 3 < datagrams.size(); i += 3)
      std::swap(datagrams[i], datagrams[i + 2]);
    datagrams.insert(datagrams.begin() + 5, datagrams[1]);
    Add(datagrams);
    EXPECT_EQ(dut_.counters().frames, 6);
    EXPECT_EQ(dut_.counters().duplicated, 1);
    EXPECT_GT(dut_.counters().reordered, 0);
    EXPECT_EQ(dut_.counters().lost, 0);
    std::sort(got_.begin(), got_.end());
    EXPECT_EQ(got_, (std::vector{0, 1, 2, 3, 4, 5}));
  }
}

TEST_F(DidsonStreamTest, LateDuplicatesOfAWholeFrameAreDuplicates) {
  auto datagrams = Datagrams(DidsonPacking::kHuls3, 96, 2);
  Add(datagrams);
  Add(datagrams);
  EXPECT_EQ(got_, (std::vector{0, 1}));
  EXPECT_EQ(dut_.counters().duplicated, 14);
}

TEST_F(DidsonStreamTest, ASonarThatStartsAnewIsFollowed) {
  Add(Datagrams(DidsonPacking::kHuls3, 96, 2, 30000));
  Add(Datagrams(DidsonPacking::kHuls3, 96, 2, 0));
  EXPECT_EQ(got_, (std::vector{0, 1, 0, 1}));
  EXPECT_EQ(dut_.counters().restarts, 1);
}

TEST_F(DidsonStreamTest, ASonarThatCountsAnewInEachFrameIsFollowed) {
  for (int i = 0; i < 4; ++i)
    Add(EncodeDatagrams(DidsonPacking::kHuls3, RandomDidsonFrame(96, i), 1));
  EXPECT_EQ(got_, (std::vector{0, 1, 2, 3}));
}

TEST_F(DidsonStreamTest, WhatIsNoDatagramIsCounted) {
  auto datagrams = Datagrams(DidsonPacking::kHuls3, 96, 1);
  datagrams[1].pop_back();
  datagrams[2][0] = 0;
  datagrams[3][4] = 0x77;
  datagrams.push_back({});
  Add(datagrams);
  EXPECT_TRUE(got_.empty());
  EXPECT_EQ(dut_.counters().malformed, 4);
}

TEST_F(DidsonStreamTest, FramesNeverMixWhateverTheNetworkDoes) {
  for (const DidsonPacking packing : kPackings) {
    const auto sent = Datagrams(packing, 96, 60);
    for (int round = 0; round < 10; ++round) {
      Random random(1, "network", static_cast<std::uint64_t>(round));
      std::vector<ByteVector> datagrams;
      for (const ByteVector& datagram : sent) {
        if (random.Chance(0.05)) continue;
        datagrams.push_back(datagram);
        if (random.Chance(0.05)) datagrams.push_back(datagram);
        if (random.Chance(0.2) && datagrams.size() > 3)
          std::swap(datagrams.back(), datagrams[datagrams.size() - 1 - random.Index(3)]);
      }
      dut_ = {};
      got_ = {};
      Add(datagrams);
      EXPECT_GT(got_.size(), 25u);
    }
  }
}

}  // namespace
}  // namespace vog
