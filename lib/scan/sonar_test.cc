#include "lib/scan/sonar.h"

#include <gtest/gtest.h>

#include "lib/base/random.h"
#include "lib/scan/scan.h"

namespace vog {
namespace {

TEST(SonarTest, BeamsShareTheFanEvenly) {
  SonarOptions options;
  for (const int beams : {2, 3, 96, 512}) {
    options.beams = beams;
    const std::vector<double> bearings = BeamBearings(options);
    ASSERT_EQ(bearings.size(), static_cast<std::size_t>(beams));
    const double pitch = ToRadians(options.fov_deg) / beams;
    // Half a beam is left at either edge; right to left.
    EXPECT_NEAR(bearings.front(), -ToRadians(options.fov_deg) / 2 + pitch / 2, 1e-12);
    for (int i = 0; i < beams; ++i) {
      EXPECT_NEAR(bearings[i], -bearings[beams - 1 - i], 1e-12);
      if (i > 0) {
        EXPECT_NEAR(bearings[i] - bearings[i - 1], pitch, 1e-12);
      }
    }
  }
}

TEST(SonarTest, BearingsAreToTheLeftInTheFansPlane) {
  EXPECT_TRUE(BeamDirection(0).isApprox(Vec3::UnitX(), 1e-12));
  EXPECT_GT(BeamDirection(0.2).y(), 0);
  for (double bearing = -1; bearing < 1; bearing += 0.1) {
    EXPECT_NEAR(BeamDirection(bearing).norm(), 1, 1e-12);
    EXPECT_EQ(BeamDirection(bearing).z(), 0);
  }
}

TEST(SonarTest, APositiveTiltPointsUp) {
  const SonarOptions options;
  const Pose3 X_BS = SonarPose(options, 0.3);
  EXPECT_EQ(X_BS.translation(), options.mount_m);
  const Vec3 ahead_B = X_BS.linear() * BeamDirection(0);
  EXPECT_NEAR(ahead_B.z(), std::sin(0.3), 1e-12);
  EXPECT_NEAR(ahead_B.x(), std::cos(0.3), 1e-12);
  EXPECT_NEAR(ahead_B.y(), 0, 1e-12);
}

TEST(SonarTest, TheSweepIsATriangleWave) {
  SonarOptions options;
  const double amplitude = ToRadians(options.tilt_amplitude_deg);
  const double rate = ToRadians(options.tilt_rate_deg_s);
  const double period_s = 4 * amplitude / rate;
  EXPECT_EQ(TiltAt(options, Time{}), 0);
  EXPECT_NEAR(TiltAt(options, Time(FromSeconds(period_s / 4))), amplitude, 1e-5);
  EXPECT_NEAR(TiltAt(options, Time(FromSeconds(3 * period_s / 4))), -amplitude, 1e-5);
  double before = 0;
  for (double s = 0; s < 3 * period_s; s += 0.01) {
    const double tilt = TiltAt(options, Time(FromSeconds(s)));
    EXPECT_LE(std::abs(tilt), amplitude + 1e-12);
    EXPECT_LE(std::abs(tilt - before), 0.01 * rate + 1e-6);
    EXPECT_NEAR(TiltAt(options, Time(FromSeconds(s + period_s))), tilt, 1e-5);
    before = tilt;
  }
}

TEST(SonarTest, AFixedSonarStaysLevel) {
  SonarOptions options;
  options.tilt = TiltMode::kFixed;
  SonarOptions flat;
  flat.tilt_amplitude_deg = 0;
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(TiltAt(options, FromUtime(777'777 * i)), 0);
    EXPECT_EQ(TiltAt(flat, FromUtime(777'777 * i)), 0);
  }
}

TEST(SonarTest, AnEmptyWindowIsRefused) {
  SonarOptions options;
  options.Validate();
  options.min_range_m = options.max_range_m;
  EXPECT_THROW(options.Validate(), UsageError);
}

TEST(ScanTest, EndPointsAreWhereTheEchoesAre) {
  Random random(1, "scan");
  Scan scan;
  scan.X_BS = MakePose({0.1, -0.2, 0.3}, {0, -0.4, 0});
  std::vector<Vec3> expected_B;
  for (int i = 0; i < 60; ++i) {
    Beam beam{static_cast<float>(random.Uniform(-0.3, 0.3)),
              static_cast<float>(random.Uniform(1, 9)), 1,
              static_cast<BeamStatus>(random.Index(3))};
    scan.beams.push_back(beam);
    if (beam.status == BeamStatus::kReturn)
      expected_B.push_back(scan.X_BS * Vec3(beam.range_m * std::cos(beam.bearing_rad),
                                            beam.range_m * std::sin(beam.bearing_rad), 0));
  }
  const std::vector<Vec3> points_B = EndPoints_B(scan);
  ASSERT_EQ(points_B.size(), expected_B.size());
  for (std::size_t i = 0; i < points_B.size(); ++i)
    EXPECT_TRUE(points_B[i].isApprox(expected_B[i], 1e-6));
}

TEST(ScanTest, SilentBeamsAreSureAwayFromEchoes) {
  Random random(2, "scan");
  for (int round = 0; round < 100; ++round) {
    std::vector<Beam> beams(40);
    for (Beam& beam : beams)
      beam.status =
          random.Chance(0.05) ? BeamStatus::kReturn : static_cast<BeamStatus>(1 + random.Index(2));
    const std::vector<Beam> before = beams;
    const int guard = random.Index(6);
    ClassifySilentBeams(guard, beams);
    for (int i = 0; i < 40; ++i) {
      bool near_echo = false;
      for (int k = std::max(0, i - guard); k <= std::min(39, i + guard); ++k)
        near_echo |= before[k].status == BeamStatus::kReturn;
      const BeamStatus expected = before[i].status == BeamStatus::kReturn ? BeamStatus::kReturn
                                  : near_echo                             ? BeamStatus::kUncertain
                                                                          : BeamStatus::kClear;
      EXPECT_EQ(beams[i].status, expected) << i;
    }
  }
  std::vector<Beam> none;
  ClassifySilentBeams(5, none);
}

}  // namespace
}  // namespace vog
