#include "hardware/nav_payload/bluefin_records.h"

#include <gtest/gtest.h>

#include <numbers>

#include "hardware/nav_payload/random_formats_testing.h"
#include "hardware/nav_payload/time_of_day.h"

namespace vog {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr Time kTime = FromUtime(1'468'966'347'175'000);

Mat3 RotationOf(const RollPitchYaw& angles) { return MakePose(Vec3::Zero(), angles).linear(); }

/// A direction of W that a direction of B has at this attitude.
Vec3 InW(const NedAttitude& attitude, const Vec3& v_B) {
  return RotationOf(FromNed(attitude)) * v_B;
}

TEST(NedFramesTest, HeadingsTurnFromNorthToEast) {
  const Vec3 ahead = Vec3::UnitX(), north = Vec3::UnitY(), east = Vec3::UnitX();
  EXPECT_TRUE(InW({0, 0, 0}, ahead).isApprox(north));
  EXPECT_TRUE(InW({kPi / 2, 0, 0}, ahead).isApprox(east));
  EXPECT_TRUE(InW({kPi, 0, 0}, ahead).isApprox(Vec3(-north)));
}

TEST(NedFramesTest, PitchLiftsTheBowAndRollLowersStarboard) {
  EXPECT_GT(InW({1, 0.2, 0}, Vec3::UnitX()).z(), 0.1);
  EXPECT_LT(InW({1, 0, 0.2}, -Vec3::UnitY()).z(), -0.1);
  EXPECT_NEAR(InW({1, 0.2, 0}, -Vec3::UnitY()).z(), 0, 1e-12);
}

TEST(NedFramesTest, AgreesWithTheMatricesOfBothFrames) {
  const Mat3 R_WN = (Mat3() << 0, 1, 0, 1, 0, 0, 0, 0, -1).finished();
  const Mat3 R_FB = Vec3(1, -1, -1).asDiagonal();
  for (int i = 0; i < 200; ++i) {
    Random random(1, "ned", i);
    const NedAttitude attitude{random.Uniform(0, 2 * kPi), random.Uniform(-1.5, 1.5),
                               random.Uniform(-3, 3)};
    const Mat3 R_NF = RotationOf({attitude.roll_rad, attitude.pitch_rad, attitude.heading_rad});
    EXPECT_TRUE(RotationOf(FromNed(attitude)).isApprox(R_WN * R_NF * R_FB, 1e-12));
    const NedAttitude back = ToNed(FromNed(attitude));
    EXPECT_NEAR(back.heading_rad, attitude.heading_rad, 1e-12);
    EXPECT_NEAR(back.pitch_rad, attitude.pitch_rad, 1e-12);
    EXPECT_NEAR(back.roll_rad, attitude.roll_rad, 1e-12);
  }
}

TEST(BluefinRecordsTest, TheDopplerLogTurnsToTheBody) {
  DvlSentence dvl;
  dvl.velocity_m_s = {0.3, 0.2, 0.1};
  const DvlRecord record = ToDvlRecord(dvl, kTime, 7);
  EXPECT_TRUE(record.valid);
  EXPECT_EQ(record.sequence, 7);
  EXPECT_EQ(record.velocity_B_m_s, Vec3(0.3, -0.2, -0.1));
  EXPECT_EQ(ToDvlSentence(record).velocity_m_s, dvl.velocity_m_s);
  dvl.velocity_m_s[1].reset();
  EXPECT_FALSE(ToDvlRecord(dvl, kTime, 7).valid);
  EXPECT_FALSE(ToDvlSentence(ToDvlRecord(dvl, kTime, 7)).velocity_m_s[0]);
}

TEST(BluefinRecordsTest, TheInertialUnitTurnsToTheBody) {
  ImuSentence imu;
  imu.rate_rad_s = {0.1, 0.2, 0.3};  // Starboard sinks, the bow rises, to starboard.
  const ImuRecord record = ToImuRecord(imu, {0.5, 0.02, 0.01}, kTime, 3);
  EXPECT_EQ(record.angular_velocity_B_rad_s, Vec3(0.1, -0.2, -0.3));
  EXPECT_EQ(record.roll_rad, 0.01);
  EXPECT_EQ(record.pitch_rad, -0.02);
  EXPECT_EQ(ToImuSentence(record).rate_rad_s, imu.rate_rad_s);
}

TEST(BluefinRecordsTest, BodyRatesAreTheChangeOfTheAttitude) {
  const NedAttitude before{1, 0, 0};
  for (int axis = 0; axis < 3; ++axis) {
    NedAttitude after = before;
    (axis == 0 ? after.roll_rad : axis == 1 ? after.pitch_rad : after.heading_rad) += 1e-6;
    ImuSentence imu;
    imu.rate_rad_s[axis] = 1e-6;
    const Vec3 rate = ToImuRecord(imu, before, kTime, 0).angular_velocity_B_rad_s;
    const Mat3 turn = RotationOf(FromNed(before)).transpose() * RotationOf(FromNed(after));
    EXPECT_TRUE(turn.isApprox(Mat3::Identity() + SkewOf(rate), 1e-11)) << axis;
  }
}

TEST(BluefinRecordsTest, DepthComesFromTheFixOrThePressure) {
  NvgSentence nvg;
  EXPECT_FALSE(ToDepthRecord(nvg, kTime, 0));
  nvg.depth_m = 3.5;
  EXPECT_EQ(ToDepthRecord(nvg, kTime, 0)->depth_m, 3.5);
  const DepthRecord deep{kTime, 0, 12.25};
  for (const PressureUnit unit : {PressureUnit::kPsi, PressureUnit::kKilopascal}) {
    PressureOptions options;
    options.unit = unit;
    EXPECT_NEAR(ToDepthRecord(ToRdpSentence(deep, options), options, kTime, 0).depth_m, 12.25,
                1e-9);
  }
}

TEST(BluefinRecordsTest, TheReckonedPoseIsTurned) {
  VehicleNavSentences sentences;
  sentences.cnv = {kTime, 1, 2, 3, 0};
  sentences.rnv.absolute = RnvAbsolute{3, kPi / 2, 0.1, 0, kTime};
  sentences.nvr.east_m_s = 0.5;
  sentences.nvr.yaw_rate_rad_s = 0.2;
  const auto record = ToVehicleNavRecord(sentences, 11, 4);
  ASSERT_TRUE(record);
  EXPECT_TRUE(record->X_OB.translation().isApprox(Vec3(2, 1, -3)));
  EXPECT_NEAR(YawOf(record->X_OB), 0, 1e-12);
  EXPECT_TRUE(record->velocity_B_m_s.isApprox(Vec3(0.5, 0, 0), 1e-12));
  EXPECT_EQ(record->yaw_rate_rad_s, -0.2);
  EXPECT_EQ(record->origin, 11);
  sentences.cnv.time_nav += Duration(1);
  EXPECT_FALSE(ToVehicleNavRecord(sentences, 11, 4));
  sentences.rnv.absolute.reset();
  EXPECT_FALSE(ToVehicleNavRecord(sentences, 11, 4));
}

TEST(BluefinRecordsTest, TheReckonedPoseComesBackOverTheWire) {
  for (int i = 0; i < 500; ++i) {
    const VehicleNavRecord record = RandomVehicleNav(i);
    const VehicleNavSentences sent = ToVehicleNavSentences(record);
    const auto over_the_wire = [](const auto& sentence) {
      using Kind = std::decay_t<decltype(sentence)>;
      return std::get<Kind>(std::get<Sentence>(ParseSentence(FormatSentence(sentence))));
    };
    const auto back = ToVehicleNavRecord(
        {over_the_wire(sent.cnv), over_the_wire(sent.rnv), over_the_wire(sent.nvr)}, record.origin,
        0);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->time, record.time);
    EXPECT_LT((back->X_OB.translation() - record.X_OB.translation()).norm(), 1e-4);
    EXPECT_LT(Log(Ominus(back->X_OB, record.X_OB)).tail<3>().norm(), 3e-5);
    EXPECT_LT((back->velocity_B_m_s - record.velocity_B_m_s).norm(), 2e-4);
    EXPECT_NEAR(back->yaw_rate_rad_s, record.yaw_rate_rad_s, 1e-5);
  }
}

}  // namespace
}  // namespace vog
