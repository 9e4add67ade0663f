#include "hardware/nav_payload/pd0.h"

#include <gtest/gtest.h>

#include "hardware/nav_payload/random_formats_testing.h"
#include "lib/base/files.h"

namespace vog {
namespace {

constexpr double kAngleStep = 0.0001746;  // 0.01 degrees.

ByteSpan AsBytes(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

void ExpectNear(const std::array<std::optional<double>, 4>& a,
                const std::array<std::optional<double>, 4>& b, double step) {
  for (std::size_t i = 0; i < 4; ++i) {
    ASSERT_EQ(a[i].has_value(), b[i].has_value());
    if (a[i]) {
      EXPECT_NEAR(*a[i], *b[i], 0.51 * step);
    }
  }
}

TEST(Pd0Test, WhatIsEncodedIsDecoded) {
  for (int i = 0; i < 1000; ++i) {
    const Pd0Ensemble e = RandomPd0(i);
    const auto back = DecodePd0(EncodePd0(e));
    ASSERT_TRUE(back);
    EXPECT_EQ(back->fixed, e.fixed);
    EXPECT_EQ(back->variable.time, e.variable.time);
    EXPECT_EQ(back->variable.ensemble, e.variable.ensemble);
    EXPECT_NEAR(back->variable.heading_rad, e.variable.heading_rad, kAngleStep);
    EXPECT_NEAR(back->variable.pitch_rad, e.variable.pitch_rad, kAngleStep);
    EXPECT_NEAR(back->variable.roll_rad, e.variable.roll_rad, kAngleStep);
    EXPECT_NEAR(back->variable.transducer_depth_m, e.variable.transducer_depth_m, 0.051);
    EXPECT_NEAR(back->variable.temperature_degc, e.variable.temperature_degc, 0.0051);
    ASSERT_EQ(back->bottom_track.has_value(), e.bottom_track.has_value());
    if (!e.bottom_track) continue;
    ExpectNear(back->bottom_track->range_m, e.bottom_track->range_m, 0.01);
    ExpectNear(back->bottom_track->velocity_m_s, e.bottom_track->velocity_m_s, 1e-3);
    EXPECT_EQ(back->bottom_track->correlation, e.bottom_track->correlation);
    EXPECT_EQ(back->bottom_track->percent_good, e.bottom_track->percent_good);
  }
}

TEST(Pd0Test, TheBottomMovesOppositeToTheVehicle) {
  Pd0Ensemble e;
  e.bottom_track.emplace();
  e.bottom_track->velocity_m_s = {0.1, -0.2, 0.3, std::nullopt};
  const DopplerSample sample = ToDopplerSample(e);
  EXPECT_EQ(sample.velocity_m_s[0], -0.1);
  EXPECT_EQ(sample.velocity_m_s[1], 0.2);
  EXPECT_FALSE(sample.velocity_m_s[3]);
  EXPECT_EQ(ToPd0BottomTrack(sample).velocity_m_s, e.bottom_track->velocity_m_s);
}

TEST(Pd0Test, NoTruncationIsTaken) {
  const ByteVector bytes = EncodePd0(RandomPd0(1));
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(DecodePd0(ByteSpan(bytes).first(size)));
}

TEST(Pd0Test, NoFlippedBitIsTaken) {
  ByteVector bytes = EncodePd0(RandomPd0(2));
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    bytes[bit / 8] ^= 1 << bit % 8;
    EXPECT_FALSE(DecodePd0(bytes)) << bit;
    bytes[bit / 8] ^= 1 << bit % 8;
  }
}

TEST(Pd0Test, TheFramerFindsEnsemblesBehindGarbageInChunksOfAnySize) {
  ByteVector stream;
  for (int i = 0; i < 20; ++i) {
    Random random(1, "garbage", i);
    const ByteVector ensemble = EncodePd0(RandomPd0(i));
    for (int k = random.Index(40); k > 0; --k) stream.push_back(random.Index(256));
    stream.insert(stream.end(), ensemble.begin(), ensemble.end());
  }
  // A head that promises more than there is holds the stream up for so long at most.
  stream.insert(stream.end(), kMaxPd0Size, 0);
  for (const std::size_t chunk : {1, 7, 1000, 100'000}) {
    ByteFramer dut = MakePd0Framer();
    int frames = 0;
    for (std::size_t at = 0; at < stream.size(); at += chunk) {
      const auto part = ByteSpan(stream).subspan(at, std::min(chunk, stream.size() - at));
      for (const ByteVector& frame : dut.Add(part)) frames += DecodePd0(frame).has_value();
      EXPECT_LT(dut.buffered_bytes(), kMaxPd0Size);
    }
    EXPECT_EQ(frames, 20) << chunk;
  }
}

/// How many of a recording's ensembles have a bottom velocity in four beams, out of all.
std::pair<int, int> CountBottomTracks(const std::filesystem::path& path) {
  ByteFramer framer = MakePd0Framer();
  int good = 0, all = 0;
  for (const ByteVector& frame : framer.Add(AsBytes(ReadFile(path)))) {
    const auto ensemble = DecodePd0(frame);
    EXPECT_TRUE(ensemble);
    if (!ensemble) continue;
    ++all;
    const DopplerSample sample = ToDopplerSample(*ensemble);
    const auto& v = sample.velocity_m_s;
    good += std::count(v.begin(), v.end(), std::nullopt) == 0;
  }
  EXPECT_EQ(framer.garbage_bytes(), 0);
  EXPECT_EQ(framer.buffered_bytes(), 0u);
  return {good, all};
}

TEST(Pd0Test, ReadsRecordingsOfRealLogs) {
  const auto auv_3 = FindRecording("dvl/adcp_auv_3.pd0");
  const auto auv_51 = FindRecording("dvl/adcp_auv_51.pd0");
  const auto moored = FindRecording("dvl/ND072022.PD0");
  if (!auv_3 || !auv_51 || !moored) GTEST_SKIP() << "no recordings";
  EXPECT_EQ(CountBottomTracks(*auv_3), std::pair(3, 3));
  EXPECT_EQ(CountBottomTracks(*auv_51), std::pair(51, 51));
  EXPECT_EQ(CountBottomTracks(*moored), std::pair(0, 1));
}

TEST(Pd0Test, ReadsTheNumbersOfARecording) {
  const auto path = FindRecording("dvl/adcp_auv_3.pd0");
  if (!path) GTEST_SKIP() << "no recordings";
  const auto frames = MakePd0Framer().Add(AsBytes(ReadFile(*path)));
  const auto e = DecodePd0(frames.at(0));
  ASSERT_TRUE(e && e->bottom_track);
  EXPECT_EQ(e->fixed.frame, DopplerFrame::kShip);
  EXPECT_EQ(e->variable.time.time_since_epoch(),
            std::chrono::sys_days(std::chrono::year(2014) / 12 / 19).time_since_epoch() +
                std::chrono::milliseconds(((17 * 60 + 17) * 60 + 55) * 1000 + 940));
  EXPECT_NEAR(e->variable.heading_rad, 260.67 * kAngleStep * 100, 1e-2);
  EXPECT_NEAR(e->bottom_track->range_m[0].value(), 14.23, 1e-9);
  EXPECT_NEAR(ToDopplerSample(*e).velocity_m_s[1].value(), 0.137, 1e-9);  // It goes ahead.
}

}  // namespace
}  // namespace vog
