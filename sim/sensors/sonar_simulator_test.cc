#include "sim/sensors/sonar_simulator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "lib/scan/range_detector.h"
#include "sim/scene/shapes.h"

namespace vog {
namespace {

SonarOptions LevelSonar() {
  SonarOptions options;
  options.tilt = TiltMode::kFixed;
  options.mount_m = {0.2, -0.1, 0.05};
  return options;
}

/// Beams without noise.
SonarModelOptions CleanModel() {
  SonarModelOptions model;
  model.range_noise_m = model.miss_probability = model.false_return_probability = 0;
  model.double_bounce_probability = model.crosstalk_probability = 0;
  return model;
}

/// A thick wall whose face is the plane x = `distance_m`.
TriangleMesh Wall(double distance_m) {
  return Box(MakePose({distance_m + 1, 0, 0}), {2, 100, 100});
}

struct Fixture {
  Fixture(const SonarOptions& options, const SonarModelOptions& model, const TriangleMesh& mesh,
          std::uint64_t seed = 1)
      : scene(mesh), sonar(options, model, scene, seed) {}
  SonarReturns Ping(std::int64_t sequence = 0, const Pose3& X_WB = Pose3::Identity()) const {
    return sonar.Returns(Time{}, sequence, X_WB);
  }
  RayCaster scene;
  SonarSimulator sonar;
};

int CountReturns(const SonarReturns& returns) {
  return static_cast<int>(std::count_if(returns.range_m.begin(), returns.range_m.end(),
                                        [](float range) { return range > 0; }));
}

TEST(SonarSimulatorTest, SeesAWallWhereItStands) {
  const SonarOptions options = LevelSonar();
  const Fixture dut(options, CleanModel(), Wall(6));
  const double yaw = 0.3;
  const Pose3 X_WB = MakePose({1, 0.5, -2}, {0, 0, yaw});
  const SonarReturns returns = dut.Ping(7, X_WB);
  EXPECT_EQ(returns.sequence, 7);
  EXPECT_EQ(returns.min_range_m, options.min_range_m);
  EXPECT_EQ(returns.max_range_m, options.max_range_m);
  ASSERT_EQ(returns.range_m.size(), 96u);
  ASSERT_EQ(returns.strength.size(), 96u);
  const std::vector<double> bearings = BeamBearings(options);
  const double distance_m = 6 - (X_WB * options.mount_m).x();
  for (std::size_t i = 0; i < bearings.size(); ++i) {
    EXPECT_NEAR(returns.range_m[i], distance_m / std::cos(bearings[i] + yaw), 0.01) << i;
    EXPECT_GT(returns.strength[i], 0);
    EXPECT_LE(returns.strength[i], 1);
  }
}

TEST(SonarSimulatorTest, PointsTheFanAsTheServoStands) {
  SonarOptions options = LevelSonar();
  options.tilt = TiltMode::kSweep;
  options.mount_m.setZero();
  const Fixture dut(options, CleanModel(), Wall(5));
  const Time time{Duration(2000000)};  // 20 degrees up.
  const SonarReturns returns = dut.sonar.Returns(time, 10, Pose3::Identity());
  EXPECT_NEAR(returns.tilt_rad, ToRadians(20), 1e-9);
  const double bearing = BeamBearings(options)[48];
  EXPECT_NEAR(returns.range_m[48], 5 / std::cos(ToRadians(20)) / std::cos(bearing), 0.02);
  EXPECT_EQ(returns.time, time);
}

TEST(SonarSimulatorTest, ReturnsNothingOutsideTheWindow) {
  SonarOptions options = LevelSonar();
  options.mount_m.setZero();
  options.min_range_m = 2;
  options.max_range_m = 5;
  SonarModelOptions model;
  model.range_noise_m = 0.1;
  for (const double distance_m : {1.0, 1.95, 2.05, 3.0, 4.9, 5.1, 8.0}) {
    const Fixture dut(options, model, Wall(distance_m));
    for (int i = 0; i < 20; ++i) {
      for (const float range_m : dut.Ping(i).range_m)
        EXPECT_TRUE(range_m == 0 || (range_m >= 2 && range_m <= 5)) << distance_m;
    }
  }
  EXPECT_EQ(CountReturns(Fixture(options, CleanModel(), Wall(1.5)).Ping()), 0);
  EXPECT_EQ(CountReturns(Fixture(options, CleanModel(), Wall(5.5)).Ping()), 0);
}

// A plate nearer than the window hides the wall behind it.
TEST(SonarSimulatorTest, WhatIsTooNearHidesWhatIsBehind) {
  SonarOptions options = LevelSonar();
  options.min_range_m = 2;
  TriangleMesh mesh = Wall(6);
  mesh.Append(Box(MakePose({1, 0, 0}), {0.1, 5, 5}));
  EXPECT_EQ(CountReturns(Fixture(options, CleanModel(), mesh).Ping()), 0);
}

TEST(SonarSimulatorTest, NearestSurfaceWins) {
  TriangleMesh mesh = Wall(6);
  mesh.Append(Box(MakePose({3, 5, 0}), {0.2, 10, 1}));  // Left half of the view.
  const SonarOptions options = LevelSonar();
  const SonarReturns returns = Fixture(options, CleanModel(), mesh).Ping();
  EXPECT_NEAR(returns.range_m.front(), 5.8 / std::cos(BeamBearings(options).front()), 0.02);
  EXPECT_NEAR(returns.range_m.back(), 2.7 / std::cos(BeamBearings(options).back()), 0.02);
}

// At 4 m a beam is 7 cm tall: a thin rod fills it in part, and is seen now and then.
TEST(SonarSimulatorTest, SurfacesThatFillLittleOfABeamAreSeenLessOften) {
  SonarOptions options = LevelSonar();
  options.mount_m.setZero();
  SonarModelOptions model = CleanModel();
  model.rays_per_beam = 100;
  const auto seen = [&](double rod_m) {
    const Fixture dut(options, model, Box(MakePose({4, 0, 0}), {0.02, 10, rod_m}));
    int returns = 0;
    for (int i = 0; i < 50; ++i) returns += CountReturns(dut.Ping(i));
    return returns / (50.0 * 96);
  };
  EXPECT_EQ(seen(0.2), 1);
  EXPECT_NEAR(seen(0.0089), 0.16 / 0.4, 0.04) << "0.16 of the ellipse";
  EXPECT_NEAR(seen(0.0044), 0.08 / 0.4, 0.04);
}

TEST(SonarSimulatorTest, MissesAsOftenAsTheOptionsSay) {
  SonarModelOptions model = CleanModel();
  model.miss_probability = 0.1;
  const Fixture dut(LevelSonar(), model, Wall(5));
  int returns = 0;
  for (int i = 0; i < 200; ++i) returns += CountReturns(dut.Ping(i));
  EXPECT_NEAR(returns / (200.0 * 96), 0.9, 0.01);
}

TEST(SonarSimulatorTest, RangeNoiseHasItsSigma) {
  SonarModelOptions clean = CleanModel(), noisy = CleanModel();
  noisy.range_noise_m = 0.03;
  const Fixture truth(LevelSonar(), clean, Wall(5)), dut(LevelSonar(), noisy, Wall(5));
  double sum = 0, squares = 0;
  constexpr int kPings = 100;
  for (int i = 0; i < kPings; ++i) {
    const SonarReturns a = truth.Ping(i), b = dut.Ping(i);
    for (int k = 0; k < 96; ++k) {
      const double error = b.range_m[k] - a.range_m[k];
      sum += error / (kPings * 96);
      squares += error * error / (kPings * 96);
    }
  }
  EXPECT_NEAR(sum, 0, 0.001);
  EXPECT_NEAR(std::sqrt(squares), 0.03, 0.001);
}

TEST(SonarSimulatorTest, DetectionFallsOffAtGrazingAngles) {
  const auto seen = [](double grazing_deg) {
    SonarOptions options = LevelSonar();
    options.fov_deg = 1;
    options.max_range_m = 20;
    options.mount_m.setZero();
    SonarModelOptions model = CleanModel();
    model.range_cell_m = 1;
    const Pose3 X_WB = MakePose({4, 0, 0}, {0, 0, ToRadians(90 - grazing_deg)});
    const Fixture dut(options, model, Wall(4.6));
    int returns = 0;
    for (int i = 0; i < 50; ++i) returns += CountReturns(dut.Ping(i, X_WB));
    return returns / (50.0 * 96);
  };
  EXPECT_EQ(seen(60), 1);
  EXPECT_EQ(seen(20), 1);
  // (sin 6 / sin 15)^2 = 0.16 of a full echo, and 0.4 is enough.
  EXPECT_NEAR(seen(6), 0.4, 0.08);
  EXPECT_LT(seen(3), 0.15);
}

TEST(SonarSimulatorTest, FalseReturnsComeAtTheirRate) {
  SonarModelOptions model = CleanModel();
  model.false_return_probability = 0.05;
  const SonarOptions options = LevelSonar();
  const Fixture dut(options, model, Wall(100));
  int returns = 0;
  double sum_m = 0;
  for (int i = 0; i < 300; ++i) {
    for (const float range_m : dut.Ping(i).range_m) {
      returns += range_m > 0;
      sum_m += range_m;
    }
  }
  EXPECT_NEAR(returns / (300.0 * 96), 0.05, 0.005);
  EXPECT_NEAR(sum_m / returns, 0.5 * (options.min_range_m + options.max_range_m), 0.3);
}

TEST(SonarSimulatorTest, DoubleBouncesComeAtTwiceTheRange) {
  SonarOptions options = LevelSonar();
  options.mount_m.setZero();
  SonarModelOptions model = CleanModel();
  model.double_bounce_probability = 1;
  const SonarReturns returns = Fixture(options, model, Wall(4)).Ping();
  const std::vector<double> bearings = BeamBearings(options);
  for (std::size_t i = 0; i < bearings.size(); ++i)
    EXPECT_NEAR(returns.range_m[i], 8 / std::cos(bearings[i]), 0.02);
}

TEST(SonarSimulatorTest, CrosstalkIsTheEchoOfABeamThatFiresToo) {
  SonarModelOptions model = CleanModel();
  model.crosstalk_probability = 1;
  // Only a strip in the middle of the view.
  const TriangleMesh strip = Box(MakePose({5, 0, 0}), {0.1, 0.06, 5});
  const Fixture plain(LevelSonar(), CleanModel(), strip), dut(LevelSonar(), model, strip);
  const SonarReturns real = plain.Ping();
  std::vector<int> ghosts(96);
  for (int i = 0; i < 50; ++i) {
    const SonarReturns returns = dut.Ping(i);
    for (int k = 0; k < 96; ++k) {
      if (returns.range_m[k] == 0 || real.range_m[k] > 0) continue;
      ++ghosts[k];
      const bool from_right = k >= 8 && returns.range_m[k] == real.range_m[k - 8];
      const bool from_left = k < 88 && returns.range_m[k] == real.range_m[k + 8];
      EXPECT_TRUE(from_right || from_left) << k;
    }
  }
  EXPECT_GT(std::count_if(ghosts.begin(), ghosts.end(), [](int n) { return n > 10; }), 2);
}

TEST(SonarSimulatorTest, IsAFunctionOfSeedAndSequence) {
  const Fixture a(LevelSonar(), {}, Wall(5), 1), b(LevelSonar(), {}, Wall(5), 1),
      c(LevelSonar(), {}, Wall(5), 2);
  EXPECT_EQ(a.Ping(3).range_m, b.Ping(3).range_m);
  EXPECT_EQ(a.Ping(3).strength, b.Ping(3).strength);
  EXPECT_NE(a.Ping(3).range_m, a.Ping(4).range_m);
  EXPECT_NE(a.Ping(3).range_m, c.Ping(3).range_m);
  EXPECT_EQ(a.sonar.Frame({}, 3, Pose3::Identity()).samples,
            b.sonar.Frame({}, 3, Pose3::Identity()).samples);
}

TEST(SonarSimulatorTest, RefusesContradictions) {
  const RayCaster scene(Wall(5));
  SonarOptions options;
  options.min_range_m = options.max_range_m;
  EXPECT_THROW(SonarSimulator(options, {}, scene, 1), UsageError);
  SonarModelOptions model;
  model.crosstalk_min_db = 20;
  EXPECT_THROW(SonarSimulator({}, model, scene, 1), UsageError);
}

/// The window of recorded frames.
SonarOptions FrameSonar() {
  SonarOptions options = LevelSonar();
  options.mount_m.setZero();
  options.min_range_m = 2.25;
  options.max_range_m = 11.25;
  return options;
}

TEST(SonarFrameTest, IsLaidOutFromNearToFar) {
  SonarModelOptions model = CleanModel();
  model.background_zero_probability = 1;
  const SonarOptions options = FrameSonar();
  const Fixture dut(options, model, Wall(5));
  const SonarFrame frame = dut.sonar.Frame(Time{}, 4, Pose3::Identity());
  EXPECT_EQ(frame.beams, 96);
  EXPECT_EQ(frame.bins, 512);
  EXPECT_EQ(frame.sequence, 4);
  ASSERT_EQ(frame.samples.size(), 96u * 512);
  const double bin_m = 9.0 / 512;
  const std::vector<double> bearings = BeamBearings(options);
  for (int beam = 0; beam < 96; ++beam) {
    double weighted_m = 0, sum = 0;
    for (int bin = 0; bin < 512; ++bin) {
      const double sample = frame.samples[bin * 96 + beam];
      weighted_m += sample * (2.25 + (bin + 0.5) * bin_m);
      sum += sample;
    }
    const double range_m = 5 / std::cos(bearings[beam]);
    EXPECT_NEAR(weighted_m / sum, range_m + 0.5 * model.echo_length_m, 0.04) << beam;
  }
}

// Measured on recorded frames: P(0) = 0.623, mean of the others 5.9, 99 % at 18, 99.9 % at 29,
// 99.99 % at 38; and a mean level of 0.0186 near, 0.0057 far.
TEST(SonarFrameTest, BackgroundIsLikeTheRecordedOne) {
  SonarModelOptions model;
  model.false_return_probability = 0;
  const Fixture dut(FrameSonar(), model, Wall(100));
  std::vector<int> samples;
  std::vector<double> rows(16);
  constexpr int kFrames = 20;
  for (int i = 0; i < kFrames; ++i) {
    const SonarFrame frame = dut.sonar.Frame({}, i, Pose3::Identity());
    samples.insert(samples.end(), frame.samples.begin(), frame.samples.end());
    for (std::size_t k = 0; k < frame.samples.size(); ++k)
      rows[k / (96 * 32)] += frame.samples[k] / (255.0 * kFrames * 96 * 32);
  }
  std::sort(samples.begin(), samples.end());
  const auto zeros = std::upper_bound(samples.begin(), samples.end(), 0) - samples.begin();
  const double count = static_cast<double>(samples.size());
  double sum = 0;
  for (const int sample : samples) sum += sample;
  const auto quantile = [&](double share) {
    return samples[static_cast<std::size_t>(share * count)];
  };
  EXPECT_NEAR(zeros / count, 0.623, 0.025);
  EXPECT_NEAR(sum / (count - zeros), 5.9, 0.2);
  EXPECT_NEAR(quantile(0.99), 18, 4);
  EXPECT_NEAR(quantile(0.999), 29, 5);
  EXPECT_NEAR(quantile(0.9999), 38, 8);
  EXPECT_NEAR(rows[0], 0.0186, 0.003);
  EXPECT_NEAR(rows[2], 0.0096, 0.002);
  EXPECT_NEAR(rows[15], 0.0057, 0.002);
}

TEST(SonarFrameTest, EchoesAreAsStrongAsTheRecordedOnes) {
  const Fixture dut(FrameSonar(), CleanModel(), Wall(5));
  std::vector<int> peaks;
  for (int i = 0; i < 10; ++i) {
    const SonarFrame frame = dut.sonar.Frame({}, i, Pose3::Identity());
    for (int beam = 0; beam < 96; ++beam) {
      int peak = 0;
      for (int bin = 0; bin < 512; ++bin)
        peak = std::max<int>(peak, frame.samples[bin * 96 + beam]);
      peaks.push_back(peak);
    }
  }
  std::sort(peaks.begin(), peaks.end());
  EXPECT_GT(peaks[peaks.size() / 10], 110);
  EXPECT_LT(peaks[peaks.size() * 9 / 10], 235);
}

TEST(SonarFrameTest, CrosstalkShowsInTheBeamsThatFireToo) {
  SonarModelOptions model = CleanModel();
  model.background_zero_probability = 1;
  const TriangleMesh strip = Box(MakePose({5, 0, 0}), {0.1, 0.06, 5});  // Beams 47 and 48.
  const Fixture dut(FrameSonar(), model, strip);
  const SonarFrame frame = dut.sonar.Frame({}, 0, Pose3::Identity());
  const auto energy = [&](int beam) {
    double sum = 0;
    for (int bin = 0; bin < frame.bins; ++bin) sum += frame.samples[bin * 96 + beam];
    return sum;
  };
  for (const int offset : {-16, -8, 8, 16}) {
    const double db = -20 * std::log10(energy(47 + offset) / energy(47));
    EXPECT_GT(db, 8.5) << offset;
    EXPECT_LT(db, 15) << offset;
  }
  EXPECT_EQ(energy(47 + 4), 0);
  EXPECT_EQ(energy(47 + 24), 0);
}

TEST(SonarFrameTest, DetectorFindsASlantedWall) {
  const SonarOptions options = FrameSonar();
  const Fixture dut(options, {}, Wall(5));
  const double yaw = 0.25;
  const std::vector<double> bearings = BeamBearings(options);
  int near = 0;
  for (int i = 0; i < 10; ++i) {
    const SonarFrame frame = dut.sonar.Frame({}, i, MakePose({0, 0, 0}, {0, 0, yaw}));
    const std::vector<Beam> beams = DetectRanges({}, frame, bearings);
    for (std::size_t k = 0; k < beams.size(); ++k)
      near += std::abs(beams[k].range_m - 5 / std::cos(bearings[k] + yaw)) < 0.1;
  }
  EXPECT_GT(near, 0.8 * 10 * 96);
}

}  // namespace
}  // namespace vog
