#include "hardware/nav_payload/pd6.h"

#include <gtest/gtest.h>

#include <numbers>

#include "hardware/nav_payload/line_splitter.h"
#include "hardware/nav_payload/random_formats_testing.h"

namespace vog {
namespace {

constexpr double kDeg = std::numbers::pi / 180;

std::vector<Pd6Ensemble> ReadAll(const std::string& text) {
  LineSplitter splitter;
  Pd6Reader reader;
  std::vector<Pd6Ensemble> ensembles;
  for (const std::string& line :
       splitter.Add({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()})) {
    if (const auto ensemble = reader.Add(line)) ensembles.push_back(*ensemble);
  }
  return ensembles;
}

TEST(Pd6Test, ReadsLinesPaddedWithBlanks) {
  const auto ensembles = ReadAll(
      ":SA, -2.31, +0.92,271.20\r\n:TS,16071922122717,35.0,+14.7,   3.4,1478.9,  0\r\n"
      ":WI,-32768,-32768,-32768,-32768,V\r\n:BI,    +5,  -120,   +18,    +2,A\r\n"
      ":BS,   -12,   +13,   +18,A\r\n:BE,    -2,    +9,   +18,V\r\n"
      ":BD,     +0.15,     -1.20,     +0.04,   2.51,  0.00\r\n");
  ASSERT_EQ(ensembles.size(), 1u);
  const Pd6Ensemble& e = ensembles[0];
  EXPECT_NEAR(e.attitude.value().heading_rad, 271.2 * kDeg, 1e-12);
  EXPECT_NEAR(e.attitude->pitch_rad, -2.31 * kDeg, 1e-12);
  EXPECT_NEAR(e.attitude->roll_rad, 0.92 * kDeg, 1e-12);
  EXPECT_EQ(ToUtime(e.time.value()), 1'468'966'347'170'000);
  EXPECT_EQ(e.sound_speed_m_s, 1478.9);
  EXPECT_FALSE(e.water_instrument.value().velocity_m_s[0]);
  EXPECT_TRUE(e.bottom_instrument.value().good);
  EXPECT_NEAR(e.bottom_instrument->velocity_m_s[1].value(), -0.12, 1e-12);
  EXPECT_FALSE(e.bottom_earth.value().good);
  EXPECT_EQ(e.bottom_distance.value().range_m, 2.51);
  const auto sample = ToDopplerSample(e);
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->frame, DopplerFrame::kInstrument);
  EXPECT_EQ(sample->range_m[0], 2.51);
}

TEST(Pd6Test, AnEnsembleWithoutItsLastLineEndsWithTheNext) {
  const std::string text = ":TS,16071922122717,35.0,+14.7,0.0,1478.9,0\n:BI,+5,-120,+18,+2,A\n";
  EXPECT_EQ(ReadAll(text).size(), 0u);
  EXPECT_EQ(ReadAll(text + text).size(), 1u);
}

TEST(Pd6Test, BadLinesAreLeftOutAndCounted) {
  for (const char* line : {":BI,+5,-120,+18,A", ":BI,+5,-120,+18,+2,X", ":BI,+5,x,+18,+2,A",
                           ":XX,1", ":TS,16130022122717,35.0,+14.7,0.0,1478.9,0", ":SA,1,2", ":"}) {
    Pd6Reader dut;
    EXPECT_FALSE(dut.Add(line));
    EXPECT_EQ(dut.bad_lines(), 1) << line;
  }
  Pd6Reader dut;
  EXPECT_FALSE(dut.Add("no line of it"));
  EXPECT_EQ(dut.bad_lines(), 0);
}

TEST(Pd6Test, WithoutAGoodVelocityThereIsNoLock) {
  Pd6Ensemble e;
  e.time = Time{};
  e.bottom_instrument = Pd6Velocity{{0.1, 0.1, 0.1, 0.0}, false};
  EXPECT_FALSE(ToDopplerSample(e)->velocity_m_s[0]);
  e.bottom_earth = Pd6Velocity{{0.1, 0.2, 0.3}, true};
  EXPECT_EQ(ToDopplerSample(e)->frame, DopplerFrame::kEarth);
  e.time.reset();
  EXPECT_FALSE(ToDopplerSample(e));
}

TEST(Pd6Test, WhatIsWrittenIsReadBack) {
  for (int i = 0; i < 1000; ++i) {
    const std::string text = FormatPd6(RandomPd6(i));
    const auto ensembles = ReadAll(text);
    ASSERT_EQ(ensembles.size(), 1u) << text;
    EXPECT_EQ(FormatPd6(ensembles[0]), text);
    EXPECT_EQ(ensembles[0].time, RandomPd6(i).time);
  }
}

}  // namespace
}  // namespace vog
