#include "lib/scan/range_detector.h"

#include <gtest/gtest.h>

#include "lib/base/random.h"
#include "lib/scan/annotated_frames_testing.h"
#include "lib/scan/sonar.h"

namespace vog {
namespace {

/// Frames of 32 beams and 256 bins of 4 cm: an echo of 12 cm is 3 bins long.
class RangeDetectorTest : public testing::Test {
 protected:
  static constexpr int kBeams = 32, kBins = 256;

  SonarFrame Frame(int max_noise) {
    SonarFrame frame;
    frame.min_range_m = 0.5;
    frame.max_range_m = 0.5 + 0.04 * kBins;
    frame.beams = kBeams;
    frame.bins = kBins;
    for (int i = 0; i < kBeams * kBins; ++i)
      frame.samples.push_back(static_cast<std::uint8_t>(random_.Index(max_noise + 1)));
    return frame;
  }

  static void AddEcho(int beam, int bin, int length, int strength, SonarFrame& frame) {
    for (int i = bin; i < std::min(bin + length, kBins); ++i)
      frame.samples[i * kBeams + beam] = static_cast<std::uint8_t>(strength);
  }

  std::vector<Beam> Detect(const SonarFrame& frame) const {
    return DetectRanges(options_, frame, BearingsOf(frame));
  }
  static std::vector<double> BearingsOf(const SonarFrame& frame) {
    SonarOptions sonar;
    sonar.beams = std::max(2, frame.beams);
    return BeamBearings(sonar);
  }

  static double RangeOf(int bin) { return 0.5 + 0.04 * (bin + 0.5); }

  Random random_{1, testing::UnitTest::GetInstance()->current_test_info()->name()};
  RangeDetectorOptions options_;
};

TEST_F(RangeDetectorTest, SilentFramesAreClear) {
  for (const int noise : {0, 1, 20, 60}) {
    const SonarFrame frame = Frame(noise);
    const std::vector<Beam> beams = Detect(frame);
    ASSERT_EQ(beams.size(), static_cast<std::size_t>(kBeams));
    for (int i = 0; i < kBeams; ++i) {
      EXPECT_EQ(beams[i].status, BeamStatus::kClear) << noise;
      EXPECT_EQ(beams[i].range_m, 0);
      EXPECT_EQ(beams[i].bearing_rad, static_cast<float>(BearingsOf(frame)[i]));
    }
  }
}

TEST_F(RangeDetectorTest, FindsEchoesAtTheirRange) {
  for (int round = 0; round < 50; ++round) {
    SonarFrame frame = Frame(10);
    const int beam = random_.Index(kBeams), bin = random_.Index(kBins - 3);
    AddEcho(beam, bin, 3, 180, frame);
    const std::vector<Beam> beams = Detect(frame);
    EXPECT_EQ(beams[beam].status, BeamStatus::kReturn) << bin;
    EXPECT_NEAR(beams[beam].range_m, RangeOf(bin), 1e-4);
    EXPECT_NEAR(beams[beam].strength, 180.0 / 255, 0.05);
    for (int i = 0; i < kBeams; ++i) {
      if (i == beam) continue;
      EXPECT_EQ(beams[i].status, std::abs(i - beam) <= options_.guard_beams ? BeamStatus::kUncertain
                                                                            : BeamStatus::kClear);
    }
  }
}

TEST_F(RangeDetectorTest, TheFirstEchoCounts) {
  SonarFrame frame = Frame(10);
  AddEcho(5, 100, 3, 160, frame);
  AddEcho(5, 150, 3, 250, frame);
  EXPECT_NEAR(Detect(frame)[5].range_m, RangeOf(100), 1e-4);
}

TEST_F(RangeDetectorTest, AWallAcrossTheFanIsNotTakenForNoise) {
  SonarFrame frame = Frame(10);
  for (int beam = 0; beam < kBeams; ++beam) AddEcho(beam, 120 + beam / 8, 4, 200, frame);
  const std::vector<Beam> beams = Detect(frame);
  for (int i = 0; i < kBeams; ++i) {
    EXPECT_EQ(beams[i].status, BeamStatus::kReturn);
    EXPECT_NEAR(beams[i].range_m, RangeOf(120 + i / 8), 1e-4);
  }
}

TEST_F(RangeDetectorTest, TheRangeIsWhereTheEchoRisesNotWhereItPeaks) {
  SonarFrame frame = Frame(0);
  const int ramp[] = {40, 110, 160, 200};  // Half of 200 is crossed at the second bin.
  for (int i = 0; i < 4; ++i) AddEcho(7, 90 + i, 1, ramp[i], frame);
  EXPECT_NEAR(Detect(frame)[7].range_m, RangeOf(91), 1e-4);
}

TEST_F(RangeDetectorTest, CrosstalkIsLeftOut) {
  options_.lone_loudness = 5;
  SonarFrame frame = Frame(10);
  AddEcho(4, 100, 3, 240, frame);
  AddEcho(12, 100, 3, 80, frame);  // One group away: crosstalk of beam 4.
  AddEcho(20, 150, 3, 80, frame);  // Two groups away, but at another range.
  AddEcho(29, 100, 3, 80, frame);  // At the same range, but not of the group.
  const std::vector<Beam> beams = Detect(frame);
  EXPECT_EQ(beams[4].status, BeamStatus::kReturn);
  EXPECT_NE(beams[12].status, BeamStatus::kReturn);
  EXPECT_EQ(beams[20].status, BeamStatus::kReturn);
  EXPECT_EQ(beams[29].status, BeamStatus::kReturn);
  options_.crosstalk_fraction = options_.copy_fraction = 0;
  EXPECT_EQ(Detect(frame)[12].status, BeamStatus::kReturn);
}

TEST_F(RangeDetectorTest, AnEchoBehindCrosstalkIsFound) {
  options_.lone_loudness = 5;
  SonarFrame frame = Frame(10);
  AddEcho(4, 100, 3, 240, frame);
  AddEcho(12, 100, 3, 80, frame);
  AddEcho(12, 140, 3, 200, frame);
  EXPECT_NEAR(Detect(frame)[12].range_m, RangeOf(140), 1e-4);
}

TEST_F(RangeDetectorTest, AWeakBeamOfAWallIsNotTakenForCrosstalk) {
  SonarFrame frame = Frame(10);
  for (int beam = 0; beam < kBeams; ++beam) AddEcho(beam, 120, 3, 220, frame);
  // Speckle of its own.
  AddEcho(12, 120, 1, 95, frame);
  AddEcho(12, 121, 1, 40, frame);
  AddEcho(12, 122, 1, 90, frame);
  EXPECT_NEAR(Detect(frame)[12].range_m, RangeOf(120), 1e-4);
}

TEST_F(RangeDetectorTest, CopiesOfAnEchoAreLeftOut) {
  options_.lone_loudness = 5;
  SonarFrame frame = Frame(4);
  const int levels[] = {200, 90, 170, 60, 120};
  for (int i = 0; i < 5; ++i) {
    AddEcho(4, 100 + i, 1, levels[i], frame);
    AddEcho(12, 100 + i, 1, levels[i] * 7 / 10, frame);
    AddEcho(20, 100 + i, 1, levels[(i + 1) % 5], frame);
  }
  EXPECT_EQ(Detect(frame)[4].status, BeamStatus::kReturn);
  EXPECT_NE(Detect(frame)[12].status, BeamStatus::kReturn);
  EXPECT_EQ(Detect(frame)[20].status, BeamStatus::kReturn);
}

TEST_F(RangeDetectorTest, WeakEchoesCountBesideOthers) {
  SonarFrame frame = Frame(10);
  AddEcho(10, 100, 3, 70, frame);
  EXPECT_NE(Detect(frame)[10].status, BeamStatus::kReturn);
  for (int beam = 8; beam < 14; ++beam) AddEcho(beam, 100, 3, 70, frame);
  for (int beam = 8; beam < 14; ++beam)
    EXPECT_EQ(Detect(frame)[beam].status, BeamStatus::kReturn) << beam;
}

TEST_F(RangeDetectorTest, PointsAtAnyRangeAreNoSurface) {
  SonarFrame frame = Frame(10);
  for (int beam = 0; beam < kBeams; ++beam) AddEcho(beam, random_.Index(kBins), 1, 170, frame);
  int returns = 0;
  for (const Beam& beam : Detect(frame)) returns += beam.status == BeamStatus::kReturn;
  EXPECT_LE(returns, 2);
}

TEST(RangeDetectorScoreTest, FramesLikeRealOnes) {
  Score score = Measure({}, 2, Detected);
  EXPECT_GT(score.recall(), 0.9);
  EXPECT_GT(score.precision(), 0.95);
  EXPECT_LE(score.Error90_bins(), 4);
  EXPECT_LE(score.false_in_empty, 2 * 5);
}

TEST(RangeDetectorScoreTest, FramesUnlikeRealOnes) {
  for (const FrameStyle& style : {FrameStyle{.name = "quiet", .gain = 0.5},
                                  {.name = "loud", .gain = 2},
                                  {.name = "noisy", .noise_gain = 2},
                                  {.name = "weak", .echo_level = 69},
                                  {.name = "uneven", .beam_gain_spread = 6},
                                  {.name = "short", .echo_length_m = 0.06},
                                  {.name = "full of fish", .clutter_gain = 1.3}}) {
    Score score = Measure(style, 4, Detected);
    EXPECT_GT(score.recall(), 0.85) << style.name;
    EXPECT_GT(score.precision(), 0.93) << style.name;
    EXPECT_LE(score.Error90_bins(), 4) << style.name;
    EXPECT_LE(score.false_in_empty, 4 * 10) << style.name;
  }
}

TEST_F(RangeDetectorTest, SmallFramesAndWideWindowsDoNoHarm) {
  for (const auto& [beams, bins] : {std::pair(1, 1), {2, 1}, {1, 5}, {3, 17}, {2, 300}}) {
    SonarFrame frame;
    frame.max_range_m = 2;
    frame.beams = beams;
    frame.bins = bins;
    frame.samples.assign(beams * bins, 255);
    EXPECT_EQ(Detect(frame).size(), static_cast<std::size_t>(beams));
    options_.echo_length_m = 2;
    EXPECT_EQ(Detect(frame).size(), static_cast<std::size_t>(beams));
  }
}

TEST_F(RangeDetectorTest, NoiseOfAnyKindGivesRangesWithinTheWindow) {
  for (int round = 0; round < 20; ++round) {
    SonarFrame frame = Frame(255);
    for (int spikes = random_.Index(200); spikes > 0; --spikes)
      frame.samples[random_.Index(kBeams * kBins)] = 255;
    for (const Beam& beam : Detect(frame)) {
      if (beam.status != BeamStatus::kReturn) continue;
      EXPECT_GE(beam.range_m, frame.min_range_m);
      EXPECT_LE(beam.range_m, frame.max_range_m);
      EXPECT_GE(beam.strength, 0);
      EXPECT_LE(beam.strength, 1);
    }
  }
}

}  // namespace
}  // namespace vog
