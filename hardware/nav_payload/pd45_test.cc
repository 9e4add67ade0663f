#include "hardware/nav_payload/pd45.h"

#include <gtest/gtest.h>

#include <numbers>

#include "hardware/nav_payload/random_formats_testing.h"
#include "hardware/nav_payload/text_numbers.h"

namespace vog {
namespace {

constexpr double kDeg = std::numbers::pi / 180;

ByteVector FromHex(std::string_view text) {
  ByteVector bytes;
  for (std::size_t i = 0; i < text.size(); i += 2)
    bytes.push_back(std::stoi(std::string(text.substr(i, 2)), nullptr, 16));
  return bytes;
}

const ByteVector kPd4 = FromHex(
    "7d002d0054640038ff05000000960097009500980000008000800080008000000000000c22384e0000dc05d20463"
    "09");
const ByteVector kPd5 = FromHex(
    "7d01560054640038ff05000000960097009500980000008000800080008000000000000c22384e0000dc05d20423"
    "22006e00d8fff0690000000000000000000000000000000000000000000000000000000000000000700d");

TEST(Pd45Test, ReadsPd4) {
  const auto e = DecodePd45(kPd4);
  ASSERT_TRUE(e);
  EXPECT_EQ(e->frame, DopplerFrame::kInstrument);
  EXPECT_TRUE(e->uses_three_beams);
  EXPECT_NEAR(e->bottom_velocity_m_s[0].value(), 0.1, 1e-12);
  EXPECT_NEAR(e->bottom_velocity_m_s[1].value(), -0.2, 1e-12);
  EXPECT_FALSE(e->water_velocity_m_s[0]);
  EXPECT_NEAR(e->range_m[3].value(), 1.52, 1e-12);
  EXPECT_EQ(e->time_of_first_ping, FromSeconds(45296.78));
  EXPECT_EQ(e->sound_speed_m_s, 1500);
  EXPECT_NEAR(e->temperature_degc, 12.34, 1e-12);
  EXPECT_FALSE(e->extra);
  EXPECT_EQ(EncodePd45(*e), kPd4);
  EXPECT_EQ(ToDopplerSample(*e, Time{}).velocity_m_s, e->bottom_velocity_m_s);
}

TEST(Pd45Test, ReadsPd5WhoseHeadingIsUnsigned) {
  const auto e = DecodePd45(kPd5);
  ASSERT_TRUE(e && e->extra);
  EXPECT_EQ(e->extra->salinity_ppt, 35);
  EXPECT_NEAR(e->extra->depth_m, 3.4, 1e-12);
  EXPECT_NEAR(e->extra->pitch_rad, 1.1 * kDeg, 1e-12);
  EXPECT_NEAR(e->extra->roll_rad, -0.4 * kDeg, 1e-12);
  EXPECT_NEAR(e->extra->heading_rad, 271.2 * kDeg, 1e-12);
  EXPECT_EQ(EncodePd45(*e), kPd5);
  Pd45Ensemble north = *e;
  north.extra->heading_rad = 359 * kDeg;
  EXPECT_NEAR(DecodePd45(EncodePd45(north))->extra->heading_rad, 359 * kDeg, 1e-9);
}

TEST(Pd45Test, WhatIsEncodedIsDecoded) {
  for (int i = 0; i < 1000; ++i) {
    const Pd45Ensemble e = RandomPd45(i);
    const auto back = DecodePd45(EncodePd45(e));
    ASSERT_TRUE(back);
    EXPECT_EQ(EncodePd45(*back), EncodePd45(e));
    EXPECT_EQ(back->frame, e.frame);
    EXPECT_EQ(back->time_of_first_ping, e.time_of_first_ping);
    for (std::size_t k = 0; k < 4; ++k) {
      ASSERT_EQ(back->bottom_velocity_m_s[k].has_value(), e.bottom_velocity_m_s[k].has_value());
      if (e.bottom_velocity_m_s[k]) {
        EXPECT_NEAR(*back->bottom_velocity_m_s[k], *e.bottom_velocity_m_s[k], 5.1e-4);
      }
      ASSERT_EQ(back->range_m[k].has_value(), e.range_m[k].has_value());
      if (e.range_m[k]) {
        EXPECT_NEAR(*back->range_m[k], *e.range_m[k], 5.1e-3);
      }
    }
  }
}

TEST(Pd45Test, NeitherTruncationsNorFlippedBitsAreTaken) {
  for (ByteVector bytes : {kPd4, kPd5}) {
    for (std::size_t size = 0; size < bytes.size(); ++size)
      EXPECT_FALSE(DecodePd45(ByteSpan(bytes).first(size)));
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
      bytes[bit / 8] ^= 1 << bit % 8;
      EXPECT_FALSE(DecodePd45(bytes)) << bit;
      bytes[bit / 8] ^= 1 << bit % 8;
    }
  }
}

TEST(Pd45Test, TheFramerFindsBothKindsBehindGarbage) {
  ByteVector stream = {0x7d, 0x00, 0x2d, 0x00, 0x7d, 0x7d, 0x01};
  for (const ByteVector& ensemble : {kPd4, kPd5, kPd4})
    stream.insert(stream.end(), ensemble.begin(), ensemble.end());
  ByteFramer dut = MakePd45Framer();
  std::vector<ByteVector> frames;
  for (const std::uint8_t byte : stream) {
    for (ByteVector& frame : dut.Add({&byte, 1})) frames.push_back(std::move(frame));
    EXPECT_LT(dut.buffered_bytes(), kMaxPd45Size);
  }
  EXPECT_EQ(frames, (std::vector<ByteVector>{kPd4, kPd5, kPd4}));
  EXPECT_EQ(dut.garbage_bytes(), 7);
}

}  // namespace
}  // namespace vog
