#include "hardware/nav_payload/doppler.h"

#include <gtest/gtest.h>

#include <numbers>

#include "lib/base/random.h"

namespace vog {
namespace {

constexpr double kAngle = std::numbers::pi / 6;
const double kS = std::sin(kAngle), kC = std::cos(kAngle);
using Beams = std::array<std::optional<double>, 4>;

Beams BeamsOf(const Vec3& v_I) {
  Beams beams;
  const auto values = ToBeams(v_I, kAngle);
  std::copy(values.begin(), values.end(), beams.begin());
  return beams;
}

TEST(DopplerTest, BeamsPointWhereTheManualSays) {
  const std::array<Vec3, 4> directions_I = {Vec3(-kS, 0, -kC), Vec3(kS, 0, -kC), Vec3(0, kS, -kC),
                                            Vec3(0, -kS, -kC)};
  const Vec3 v_I(0.3, -0.2, 0.1);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(BeamsOf(v_I)[i].value(), -directions_I[i].dot(v_I), 1e-12);
}

TEST(DopplerTest, FourBeamsOrThreeGiveTheVelocityTwoDoNot) {
  Random random(1, "beams");
  for (int i = 0; i < 100; ++i) {
    const Vec3 v_I = random.GaussianVector(Vec3(1, 1, 1));
    const Beams all = BeamsOf(v_I);
    EXPECT_TRUE(FromBeams(all, kAngle)->isApprox(v_I, 1e-9));
    for (std::size_t bad = 0; bad < 4; ++bad) {
      Beams three = all;
      three[bad].reset();
      EXPECT_TRUE(FromBeams(three, kAngle)->isApprox(v_I, 1e-9));
      three[(bad + 1) % 4].reset();
      EXPECT_FALSE(FromBeams(three, kAngle));
    }
  }
}

TEST(DopplerTest, TheDefaultMountingLooksDownWithBeam3Ahead) {
  const Mat3 R_BI = DopplerRotation(DopplerOptions{});
  EXPECT_TRUE(Vec3(R_BI * Vec3::UnitX()).isApprox(-Vec3::UnitY()));  // To beam 2: starboard.
  EXPECT_TRUE(Vec3(R_BI * Vec3::UnitY()).isApprox(Vec3::UnitX()));   // To beam 3: ahead.
}

TEST(DopplerTest, TheServoTiltsTheLog) {
  const Mat3 R_BI = DopplerRotation(DopplerOptions{}, std::numbers::pi / 2);
  EXPECT_TRUE(Vec3(R_BI * -Vec3::UnitZ()).isApprox(Vec3::UnitX()));  // Bow up: down becomes ahead.
}

TEST(DopplerTest, AllFramesGiveTheSameVelocityOfTheBody) {
  const DopplerOptions options;
  for (int i = 0; i < 200; ++i) {
    Random random(1, "frames", i);
    const DvlRecord record{Time{}, 5, random.GaussianVector(Vec3(1, 1, 1)), true};
    const NedAttitude attitude{random.Uniform(0, 6), random.Uniform(-1, 1), random.Uniform(-1, 1)};
    const Mat3 R_BI = DopplerRotation(options, random.Uniform(-1, 1));
    for (int frame = 0; frame < 4; ++frame) {
      const auto sample =
          ToDopplerSample(record, static_cast<DopplerFrame>(frame), attitude, options, R_BI);
      const DvlRecord back = ToDvlRecord(sample, options, R_BI, 5);
      EXPECT_TRUE(back.valid);
      EXPECT_TRUE(back.velocity_B_m_s.isApprox(record.velocity_B_m_s, 1e-9)) << frame;
    }
  }
}

TEST(DopplerTest, ALevelledShipsFrameIsTiltedBack) {
  DopplerSample sample;
  sample.frame = DopplerFrame::kShip;
  sample.is_levelled = true;
  sample.attitude = {0, 0.3, 0};  // The bow is up, and it moves level ahead:
  sample.velocity_m_s = {0.0, 1.0, 0.0, 0.0};
  const DvlRecord record = ToDvlRecord(sample, DopplerOptions{}, Mat3::Identity(), 0);
  EXPECT_TRUE(record.velocity_B_m_s.isApprox(Vec3(std::cos(0.3), 0, -std::sin(0.3)), 1e-12));
}

TEST(DopplerTest, WithoutLockTheRecordIsNotValid) {
  DopplerSample sample;
  for (int frame = 0; frame < 4; ++frame) {
    sample.frame = static_cast<DopplerFrame>(frame);
    const DvlRecord record = ToDvlRecord(sample, DopplerOptions{}, Mat3::Identity(), 0);
    EXPECT_FALSE(record.valid);
    EXPECT_TRUE(record.velocity_B_m_s.isZero());
  }
}

}  // namespace
}  // namespace vog
