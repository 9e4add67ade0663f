#include "lib/navigation/dead_reckoning.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>

#include "lib/navigation/dive_testing.h"

namespace vog {
namespace {

constexpr std::int64_t kSegment = 9;

Time At(double s) { return Time(FromSeconds(s)); }

/// Runs a DeadReckoner over instruments without noise that move at `velocity_B_m_s` and
/// `yaw_rate_rad_s`, at `rate_hz`.
class Course {
 public:
  explicit Course(const DeadReckoningOptions& options = {}) : dut_(options, kSegment) {}

  OdometrySample Run(double seconds, double rate_hz) {
    std::optional<OdometrySample> newest;
    const int steps = static_cast<int>(std::lround(seconds * rate_hz));
    for (int i = 0; i <= steps; ++i) {
      const Time time = start_ + FromSeconds(i / rate_hz);
      if (has_dvl) dut_.Add(DvlRecord{time, 0, velocity_B_m_s, true});
      dut_.Add(DepthRecord{time, 0, depth_m});
      if (const auto sample = dut_.Add(ImuRecord{time, 0, roll_rad, pitch_rad, RatesB()}))
        newest = sample;
    }
    start_ = start_ + FromSeconds(seconds);
    return newest.value();
  }

  DeadReckoner& dut() { return dut_; }

  Vec3 velocity_B_m_s = Vec3::Zero();
  double yaw_rate_rad_s = 0, roll_rad = 0, pitch_rad = 0, depth_m = 3;
  bool has_dvl = true;

 private:
  /// Body rates of a turn about the vertical.
  Vec3 RatesB() const {
    return MakePose(Vec3::Zero(), {roll_rad, pitch_rad, 0}).linear().transpose() *
           Vec3(0, 0, yaw_rate_rad_s);
  }

  DeadReckoner dut_;
  Time start_{};
};

TEST(DeadReckonerTest, AStraightCourseIsExact) {
  Course course;
  course.velocity_B_m_s = {0.2, -0.1, 0};
  const OdometrySample end = course.Run(20, 10);
  // But for the first velocity, which is believed less than wholly.
  EXPECT_TRUE(end.X_OB.isApprox(MakePose({4, -2, -3}), 1e-3));
  EXPECT_EQ(end.time, At(20));
  EXPECT_EQ(end.segment, kSegment);
  EXPECT_TRUE(end.velocity_B_m_s.isApprox(course.velocity_B_m_s, 1e-3));
}

TEST(DeadReckonerTest, ACircleComesCloserTheShorterTheSteps) {
  const double v = 0.25, w = 0.15, seconds = 30;
  const Vec3 analytic(v / w * std::sin(w * seconds), v / w * (1 - std::cos(w * seconds)), -3);
  double before_m = 1e9;
  for (const double rate_hz : {5.0, 10.0, 20.0, 40.0}) {
    Course course;
    course.velocity_B_m_s = {v, 0, 0};
    course.yaw_rate_rad_s = w;
    const OdometrySample end = course.Run(seconds, rate_hz);
    const double error_m = (end.X_OB.translation() - analytic).norm();
    EXPECT_LT(error_m, 0.6 * before_m);
    EXPECT_LT(error_m, v * seconds * w / rate_hz);
    EXPECT_NEAR(YawOf(end.X_OB), WrapAngle(w * seconds), 1e-9);
    EXPECT_NEAR(end.yaw_rate_rad_s, w, 1e-12);
    before_m = error_m;
  }
}

TEST(DeadReckonerTest, AGrowingTurnIsExactAtAnyRate) {
  Course course;
  const auto turn_to = [&](double yaw_rate_rad_s) {
    course.yaw_rate_rad_s = yaw_rate_rad_s;
    return YawOf(course.Run(0.1, 10).X_OB);
  };
  course.Run(1, 10);
  // Between two records half of what the rate grew by; Run() says each rate at its own end.
  EXPECT_NEAR(turn_to(0.2), 0.1 * 0.5 * 0.2, 1e-9);
  EXPECT_NEAR(turn_to(0), 0.1 * 0.2, 1e-9);
}

TEST(DeadReckonerTest, ATiltedBodyTurnsAboutTheVertical) {
  Course course;
  course.roll_rad = 0.2;
  course.pitch_rad = -0.3;
  course.yaw_rate_rad_s = 0.1;
  const OdometrySample end = course.Run(10, 20);
  const RollPitchYaw angles = AnglesOf(end.X_OB);
  EXPECT_NEAR(angles.roll, 0.2, 1e-9);
  EXPECT_NEAR(angles.pitch, -0.3, 1e-9);
  EXPECT_NEAR(angles.yaw, 1, 1e-9);
}

TEST(DeadReckonerTest, DepthCorrectsTheHeight) {
  Course course;
  course.Run(1, 10);
  course.depth_m = 4;  // A jump, of which each reading takes its share.
  EXPECT_NEAR(course.Run(0.1, 10).X_OB.translation().z(), -3 - 0.2, 1e-9);
  EXPECT_NEAR(course.Run(20, 10).X_OB.translation().z(), -4, 0.005);
  EXPECT_LT(course.dut().filter().state().tail<4>().norm(), 2e-3);  // No bias is made up for it.
}

TEST(DeadReckonerTest, WithoutLockItStandsStillAndKnowsLessAndLess) {
  Course with_lock, without_lock;
  for (Course* course : {&with_lock, &without_lock}) {
    course->velocity_B_m_s = {0.2, 0, 0};
    course->Run(10, 10);
  }
  without_lock.has_dvl = false;
  const double x_m = without_lock.Run(1, 10).X_OB.translation().x();
  EXPECT_NEAR(x_m, 2.2, 0.03);  // The last velocity holds for a while.
  const OdometrySample lost = without_lock.Run(10, 10);
  EXPECT_NEAR(lost.X_OB.translation().x(), x_m, 0.03);
  EXPECT_TRUE(lost.velocity_B_m_s.isZero());
  EXPECT_GT(lost.covariance(0, 0), 10 * with_lock.Run(11, 10).covariance(0, 0));
  without_lock.dut().Add(DvlRecord{At(21), 0, {5, 5, 5}, false});  // Says of itself it has no lock.
  EXPECT_NEAR(without_lock.Run(1, 10).X_OB.translation().x(), x_m, 0.03);
}

TEST(DeadReckonerTest, VelocitiesThatNoVehicleFliesDoNotMoveIt) {
  Course clean, disturbed;
  for (Course* course : {&clean, &disturbed}) course->velocity_B_m_s = {0.2, 0, 0};
  for (int second = 1; second <= 30; ++second) {
    clean.Run(1, 5);
    disturbed.Run(1, 5);
    // Now and then an echo of something else: each another velocity.
    disturbed.dut().Add(DvlRecord{At(second), 0, {-3.0 + second % 7, 2, 0}, true});
  }
  EXPECT_TRUE(disturbed.Run(1, 5).X_OB.isApprox(clean.Run(1, 5).X_OB, 1e-9));
  EXPECT_EQ(disturbed.dut().outliers(), 30);
  EXPECT_EQ(clean.dut().outliers(), 0);
}

TEST(VelocityGateTest, TakesWhatAVehicleCanFly) {
  const DeadReckoningOptions options;
  VelocityGate dut(options);
  // From standing to 0.3 m/s in a second and back, with noise of two sigma.
  for (int i = 0; i < 100; ++i) {
    const double noise_m_s = (i % 2 == 0 ? 2 : -2) * options.errors.dvl_sigma_m_s;
    const double speed_m_s = 0.15 - 0.15 * std::cos(0.2 * i * std::numbers::pi);
    EXPECT_TRUE(dut.Passes({At(0.2 * i), i, {speed_m_s + noise_m_s, 0, 0}, true})) << i;
  }
  EXPECT_EQ(dut.outliers(), 0);
}

TEST(VelocityGateTest, OutliersThatAgreeForLongAreBelieved) {
  const DeadReckoningOptions options;
  VelocityGate dut(options);
  EXPECT_TRUE(dut.Passes({At(0), 0, {-2, 1, 0}, true})) << "the first: there is no other";
  int refused = 0;
  while (!dut.Passes({At(0.2 * (refused + 1)), 0, {0.2, 0, 0}, true})) ++refused;
  EXPECT_EQ(refused, options.believed_outliers - 1);
  EXPECT_TRUE(dut.Passes({At(2), 0, {0.2, 0, 0}, true}));
  // After a long silence the vehicle may fly any velocity.
  EXPECT_TRUE(dut.Passes({At(30), 0, {-2, 1, 0}, true}));
}

TEST(DeadReckonerTest, TheCovarianceGrowsAsItsOptionsSay) {
  DeadReckoningOptions options;
  InstrumentErrors& errors = options.errors;
  errors.dvl_bias_sigma_m_s = errors.gyro_bias_sigma_rad_s = errors.gyro_bias_walk_rad_s_rt_s = 0;
  Course course(options);
  const OdometrySample end = course.Run(100, 10);  // Standing still: no lever.
  const double moved = std::pow(errors.dvl_sigma_m_s, 2) * options.dvl_period_s * 100;
  const double turned = std::pow(errors.gyro_noise_rad_rt_s, 2) * 100;
  EXPECT_TRUE(end.covariance.isApprox(Mat3(Vec3(moved, moved, turned).asDiagonal()), 1e-9));
  // A faster gyro does not make it smaller or larger.
  EXPECT_TRUE(Course(options).Run(100, 50).covariance.isApprox(end.covariance, 1e-9));
}

TEST(DeadReckonerTest, ABiasThatNothingSeesTurnsWithTheSquareOfTimeUpToItsHorizon) {
  DeadReckoningOptions options;
  InstrumentErrors& errors = options.errors;
  errors = {.dvl_bias_sigma_m_s = 0.002,
            .gyro_noise_rad_rt_s = 0,
            .gyro_bias_sigma_rad_s = 1e-4,
            .gyro_bias_walk_rad_s_rt_s = 0};
  options.bias_horizon_s = 200;
  Course course(options);
  const auto variance = [&](double seconds) { return course.Run(seconds, 5).covariance(2, 2); };
  EXPECT_NEAR(variance(100), 1e-8 * 100 * 100, 1e-7);
  EXPECT_NEAR(variance(100), 1e-8 * 200 * 200, 1e-7);
  EXPECT_NEAR(variance(100), 1e-8 * (200 * 200 + 2 * 200 * 100), 1e-7);
  // The filter itself forgets nothing.
  const auto& P = course.dut().filter().covariance();
  EXPECT_NEAR(P(InstrumentFilter::kYaw, InstrumentFilter::kYaw), 1e-8 * 300 * 300, 1e-6);
}

/// Normalised error squared of a motion's (x, y, yaw), a dimension.
double NeesOf(const Pose3& reckoned, const Pose3& truth, const Mat3& covariance) {
  const Pose3 off = Ominus(reckoned, truth);
  const Vec3 error(off.translation().x(), off.translation().y(), YawOf(off));
  return error.dot(covariance.llt().solve(error)) / 3;
}

TEST(DeadReckonerTest, ItsErrorsAreAsLargeAsItsCovarianceSays) {
  for (const double bias_factor : {1.0, 10.0}) {
    DeadReckoningOptions options;
    options.errors = LargerBiases(options.errors, bias_factor);
    double whole = 0, motion = 0;
    constexpr int kRuns = 40;
    for (int seed = 0; seed < kRuns; ++seed) {
      DeadReckoner dut(options, kSegment);
      Dive dive(options.errors, seed);
      const OdometrySample base = dive.Run(dut, 60);
      const Pose3 X_OM = dive.X_OB();
      const OdometrySample end = dive.Run(dut, 60);
      whole += NeesOf(end.X_OB, dive.X_OB(), end.covariance) / kRuns;
      motion += NeesOf(Ominus(base.X_OB, end.X_OB), Ominus(X_OM, dive.X_OB()),
                       MotionCovariance(base, end)) /
                kRuns;
    }
    EXPECT_GT(whole, 0.5) << bias_factor;
    EXPECT_LT(whole, 2) << bias_factor;
    EXPECT_LT(motion, 2) << bias_factor;
    EXPECT_GT(motion, bias_factor == 1 ? 0.5 : 0.15) << "an upper bound; bias " << bias_factor;
  }
}

TEST(DeadReckonerTest, WithoutLockTheFilterForgetsTheVelocityAndFindsItAgain) {
  const DeadReckoningOptions options;
  DeadReckoner dut(options, kSegment);
  Dive dive(options.errors, 1);
  dive.Run(dut, 100);
  dive.has_lock = false;
  dive.Run(dut, 60);
  EXPECT_FALSE(dut.HasLock(dive.time()));
  EXPECT_NEAR(dut.filter().z_m(), dive.X_OB().translation().z(), 0.1);
  dive.has_lock = true;
  const OdometrySample end = dive.Run(dut, 10);
  EXPECT_LT((end.velocity_B_m_s - dive.velocity_B_m_s()).norm(), 0.1);
  EXPECT_LT(dut.filter().state().tail<4>().norm(), 0.01);  // Biases that never were.
}

TEST(DeadReckonerTest, EqualRecordsGiveEqualBits) {
  const DeadReckoningOptions options;
  DeadReckoner a(options, kSegment), b(options, kSegment);
  const OdometrySample x = Dive(options.errors, 4).Run(a, 30),
                       y = Dive(options.errors, 4).Run(b, 30);
  EXPECT_EQ(x.X_OB.matrix(), y.X_OB.matrix());
  EXPECT_EQ(x.covariance, y.covariance);
}

TEST(DeadReckonerTest, StartsWithADepthAtTheFix) {
  DeadReckoner dut(DeadReckoningOptions{}, kSegment);
  EXPECT_FALSE(dut.Add(ImuRecord{At(0), 0, 0, 0, Vec3::Zero()}));  // No depth yet.
  dut.SetFix(MakePose({10, 20, -5}, {0, 0, 1}));
  dut.Add(DepthRecord{At(0.1), 0, 2});
  EXPECT_FALSE(dut.Add(ImuRecord{At(0.2), 0, 0, 0, Vec3::Zero()}));  // This one starts it.
  dut.SetFix(MakePose({99, 99, 99}));                                // Too late.
  const auto sample = dut.Add(ImuRecord{At(0.3), 0, 0, 0, Vec3::Zero()});
  ASSERT_TRUE(sample);
  EXPECT_TRUE(sample->X_OB.isApprox(MakePose({10, 20, -2}, {0, 0, 1}), 1e-9));
}

TEST(DeadReckonerTest, LateRecordsOfTheGyroAreLeftOut) {
  Course course;
  course.velocity_B_m_s = {0.2, 0, 0};
  course.Run(5, 10);
  for (const double s : {5.0, 4.0, 0.0})
    EXPECT_FALSE(course.dut().Add(ImuRecord{At(s), 0, 0, 0, Vec3(0, 0, 100)}));
  EXPECT_NEAR(YawOf(course.Run(1, 10).X_OB), 0, 1e-12);
}

TEST(VehicleNavTrackerTest, TakesPosesAsTheyAre) {
  VehicleNavTracker dut(DriftOptions{}, 0.2, kSegment);
  const Pose3 X_OB = MakePose({1, 2, -3}, {0.1, 0.2, 0.3});
  const OdometrySample sample = dut.Add({At(5), 0, 11, X_OB, {0.1, 0, 0}, 0.05});
  EXPECT_TRUE(sample.X_OB.isApprox(X_OB, 0));
  EXPECT_TRUE(sample.covariance.isZero());
  EXPECT_EQ(sample.time, At(5));
  EXPECT_EQ(sample.origin, 11);
  EXPECT_EQ(sample.segment, kSegment);
  EXPECT_EQ(sample.velocity_B_m_s, Vec3(0.1, 0, 0));
  EXPECT_EQ(sample.yaw_rate_rad_s, 0.05);
}

TEST(VehicleNavTrackerTest, TheDriftOfAScanIsEquation8sWhateverTheRateOfTheNavigation) {
  for (const DriftScaling scaling : {DriftScaling::kLiteral, DriftScaling::kRandomWalk}) {
    DriftOptions drift;
    drift.scaling = scaling;
    for (const double rate_hz : {2.0, 5.0, 50.0}) {
      VehicleNavTracker dut(drift, 0.2, kSegment);
      OdometrySample end;
      for (int i = 0; i <= 20 * rate_hz; ++i)
        end = dut.Add({At(i / rate_hz), 0, 11, Pose3::Identity(), {}, 0});
      EXPECT_TRUE(end.covariance.isApprox(100 * drift.StepCovariance(0.2), 1e-6)) << rate_hz;
    }
  }
}

TEST(VehicleNavTrackerTest, AReckoningThatBeginsAnewIsANewSegment) {
  VehicleNavTracker dut(DriftOptions{}, 0.2, kSegment);
  for (int i = 0; i < 5; ++i) dut.Add({At(i), 0, 11, MakePose({1.0 * i, 0, 0}), {1, 0, 0}, 0});
  const OdometrySample sample = dut.Add({At(5), 0, 12, Pose3::Identity(), {}, 0});
  EXPECT_EQ(sample.origin, 12);
  EXPECT_EQ(sample.segment, kSegment + 1);
  EXPECT_TRUE(sample.covariance.isZero());
}

/// A circle at 0.2 m/s whose reckoning is moved and turned from `jump_s` on.
OdometrySample Circle(VehicleNavTracker& dut, double seconds, double jump_s, const Pose3& X_jump) {
  OdometrySample sample;
  for (double t = 0; t < seconds + 1e-9; t += 0.1) {
    const double yaw = 0.1 * t;
    const Pose3 X = MakePose({2 * std::sin(yaw), 2 - 2 * std::cos(yaw), -1}, {0, 0, yaw});
    sample = dut.Add({At(t), 0, 11, t < jump_s ? X : X_jump * X, {0.2, 0, 0}, 0.1});
  }
  return sample;
}

TEST(VehicleNavTrackerTest, APoseThatJumpsIsANewSegmentOfAnotherOrigin) {
  for (const Pose3& X_jump : {MakePose({3, 0, 0}), MakePose({0, 0, 0}, {0, 0, 0.5})}) {
    VehicleNavTracker dut(DriftOptions{}, 0.2, kSegment);
    const OdometrySample before = Circle(dut, 4.9, 5, X_jump);
    EXPECT_EQ(before.segment, kSegment);
    EXPECT_EQ(dut.jumps(), 0);
    VehicleNavTracker jumped(DriftOptions{}, 0.2, kSegment);
    const OdometrySample after = Circle(jumped, 30, 5, X_jump);
    EXPECT_EQ(jumped.jumps(), 1);
    EXPECT_EQ(after.segment, kSegment + 1);
    EXPECT_NE(after.origin, before.origin);
    EXPECT_LT(after.covariance(0, 0), 26 / 0.2 * DriftOptions{}.StepCovariance(0.2)(0, 0) + 1e-3);
  }
}

TEST(VehicleNavTrackerTest, DriftAndGapsAreNoJumps) {
  VehicleNavTracker dut(DriftOptions{}, 0.2, kSegment);
  Circle(dut, 30, 5, MakePose({0.4, 0, 0}, {0, 0, 0.05}));
  EXPECT_EQ(dut.jumps(), 0);
  // Half a minute later it is somewhere else, at its usual speed.
  dut.Add({At(60), 0, 11, MakePose({-4, 3, -1}, {0, 0, -2}), {0, 0, 0}, 0});
  EXPECT_EQ(dut.jumps(), 0);
}

TEST(VehicleNavTrackerTest, AnErrorInYawMovesWhatFollows) {
  DriftOptions drift;
  VehicleNavTracker dut(drift, 0.2, kSegment);
  OdometrySample end;
  for (int i = 0; i <= 100; ++i)
    end = dut.Add({At(0.2 * i), 0, 11, MakePose({0.05 * i, 0, 0}), {0.25, 0, 0}, 0});
  // Straight ahead, the yaw noise of step i acts on y over the rest of the way.
  const Mat3 step = drift.StepCovariance(0.2);
  double lever2_m2 = 0;
  for (int i = 1; i <= 100; ++i) lever2_m2 += std::pow(0.05 * (100 - i), 2);
  EXPECT_NEAR(end.covariance(0, 0), 100 * step(0, 0), 1e-12);
  EXPECT_NEAR(end.covariance(1, 1), 100 * step(1, 1) + lever2_m2 * step(2, 2), 1e-12);
  EXPECT_GT(end.covariance(1, 2), 0);
}

}  // namespace
}  // namespace vog
