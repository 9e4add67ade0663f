#include "lib/messages/convert.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "lib/messages/endpoint.h"
#include "lib/submap/octree_file.h"
#include "lib/submap/scans_testing.h"
#include "lib/submap/submaps_testing.h"

namespace vog {
namespace {

header_t Header() {
  header_t header{};
  header.utime_us = 1'700'000'000'123'456;
  header.epoch = 5;
  header.sequence = 42;
  header.sender = "somebody";
  return header;
}

/// What arrives of `value`: its message, encoded, decoded and converted back.
template <class Value>
Value Travelled(const Value& value) {
  auto message = ToMessage(value);
  message.header = Header();
  auto received = decltype(message){};
  EXPECT_TRUE(Decode(Encode(message), received));
  const auto converted = FromMessage(received);
  EXPECT_TRUE(converted.has_value());
  return converted.value_or(Value{});
}

/// Whether a message is refused as soon as the number that `at(message)` names is not finite.
template <class Message, class At>
bool NeedsFinite(Message message, At at) {
  if (!FromMessage(message)) return false;
  for (const double bad : {std::nan(""), double{INFINITY}, -double{INFINITY}}) {
    Message spoilt = message;
    auto& number = at(spoilt);
    number = static_cast<std::remove_reference_t<decltype(number)>>(bad);
    if (FromMessage(spoilt)) return false;
  }
  return true;
}

VehicleNavRecord SomeNav(Random& random) {
  return {{}, 0, 0, RandomPose(100, random), RandomPoint(1, random), random.Uniform(-1, 1)};
}

OdometrySample SomeOdometry(Random& random) {
  OdometrySample sample;
  sample.origin = 17;
  sample.X_OB = RandomPose(100, random);
  const Mat3 root = Mat3::NullaryExpr([&] { return random.Uniform(-1, 1); });
  const Mat3 covariance = root * root.transpose();
  sample.covariance = covariance.selfadjointView<Eigen::Lower>();
  sample.velocity_B_m_s = RandomPoint(1, random);
  sample.yaw_rate_rad_s = 0.25;
  return sample;
}

SonarReturns SomeReturns() { return {{}, 0, 0.1, 0.5, 11, {1.5f, 0, 10.75f}, {0.5f, 0, 1}}; }

SonarFrame SomeFrame() { return {{}, 0, -0.1, 0.5, 11, 3, 4, std::vector<std::uint8_t>(12, 200)}; }

submap_t SubmapMessage(const Submap& submap) {
  return ToMessage(submap, ToOctreeBytes(submap.grid));
}

TEST(ConvertTest, RevisitsSurviveAndSharesBeyondAllAreRefused) {
  const std::map<SubmapId, double> gains = {{0, 0.25}, {7, 1}, {12, 0}};
  EXPECT_EQ(Travelled(gains), gains);
  revisits_t message = ToMessage(gains);
  EXPECT_EQ(FromMessage(revisits_t{}), (std::map<SubmapId, double>{}));
  for (const double gain : {-0.1, 1.1, std::numeric_limits<double>::quiet_NaN()}) {
    message.gain[1] = gain;
    EXPECT_FALSE(FromMessage(message)) << gain;
  }
  message = ToMessage(gains);
  message.submap_id[2] = -1;
  EXPECT_FALSE(FromMessage(message));
}

TEST(ConvertTest, PosesSurvive) {
  Random random(1, "convert");
  for (int i = 0; i < 100; ++i) {
    const Pose3 X = RandomPose(100, random);
    const auto read = FromMessage(ToMessage(X));
    ASSERT_TRUE(read.has_value());
    EXPECT_TRUE(read->isApprox(X, 1e-14));
  }
}

TEST(ConvertTest, PosesWithoutARotationAreRefused) {
  const pose_t good = ToMessage(MakePose({1, 2, 3}, {0.1, 0.2, 0.3}));
  for (int i = 0; i < 3; ++i)
    EXPECT_TRUE(NeedsFinite(good, [i](pose_t& m) -> double& { return m.position_m[i]; }));
  for (int i = 0; i < 4; ++i)
    EXPECT_TRUE(NeedsFinite(good, [i](pose_t& m) -> double& { return m.quaternion_wxyz[i]; }));
  pose_t zero = good, stretched = good;
  for (double& q : zero.quaternion_wxyz) q = 0;
  for (double& q : stretched.quaternion_wxyz) q *= 1.01;
  EXPECT_FALSE(FromMessage(zero));
  EXPECT_FALSE(FromMessage(stretched));
  EXPECT_FALSE(FromMessage(pose_t{}));
}

TEST(ConvertTest, PosesBeyondTheEarthAreRefused) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double far_m : {1.1e7, -1.1e7, 1e18, -1e300}) {
      pose_t message = ToMessage(MakePose({4.6e6, -5e5, 3}));
      EXPECT_TRUE(FromMessage(message));
      message.position_m[axis] = far_m;
      EXPECT_FALSE(FromMessage(message)) << far_m;
    }
  }
}

TEST(ConvertTest, NavigationSurvives) {
  Random random(2, "convert");
  const VehicleNavRecord nav = SomeNav(random), read = Travelled(nav);
  EXPECT_EQ(ToUtime(read.time), Header().utime_us);
  EXPECT_EQ(read.sequence, 42);
  EXPECT_EQ(read.origin, Header().epoch);
  EXPECT_TRUE(read.X_OB.isApprox(nav.X_OB, 1e-14));
  EXPECT_EQ(read.velocity_B_m_s, nav.velocity_B_m_s);
  EXPECT_EQ(read.yaw_rate_rad_s, nav.yaw_rate_rad_s);

  const OdometrySample sample = SomeOdometry(random), sample_read = Travelled(sample);
  EXPECT_EQ(ToUtime(sample_read.time), Header().utime_us);
  EXPECT_EQ(sample_read.origin, sample.origin);
  EXPECT_EQ(sample_read.segment, Header().epoch);
  EXPECT_TRUE(sample_read.X_OB.isApprox(sample.X_OB, 1e-14));
  EXPECT_EQ(sample_read.covariance, sample.covariance);
  EXPECT_EQ(sample_read.velocity_B_m_s, sample.velocity_B_m_s);
  EXPECT_EQ(sample_read.yaw_rate_rad_s, sample.yaw_rate_rad_s);
}

TEST(ConvertTest, InstrumentsSurvive) {
  for (const bool valid : {true, false}) {
    const DvlRecord dvl = Travelled(DvlRecord{{}, 0, {1, 2, 3}, valid});
    EXPECT_EQ(dvl.velocity_B_m_s, Vec3(1, 2, 3));
    EXPECT_EQ(dvl.valid, valid);
    EXPECT_EQ(dvl.sequence, 42);
  }
  const ImuRecord imu = Travelled(ImuRecord{{}, 0, 0.1, 0.2, {1, 2, 3}});
  EXPECT_EQ(imu.roll_rad, 0.1);
  EXPECT_EQ(imu.pitch_rad, 0.2);
  EXPECT_EQ(imu.angular_velocity_B_rad_s, Vec3(1, 2, 3));
  EXPECT_EQ(Travelled(DepthRecord{{}, 0, 7.5}).depth_m, 7.5);
  const VelocityCommand command{{1, 2, 3}, -0.1};
  const auto read = FromMessage(ToMessage(command));
  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(read->velocity_B_m_s, command.velocity_B_m_s);
  EXPECT_EQ(read->yaw_rate_rad_s, command.yaw_rate_rad_s);
}

TEST(ConvertTest, NumbersThatAreNotFiniteAreRefused) {
  Random random(3, "convert");
  const auto nav = ToMessage(SomeNav(random));
  const auto odometry = ToMessage(SomeOdometry(random));
  const auto dvl = ToMessage(DvlRecord{});
  const auto imu = ToMessage(ImuRecord{});
  const auto control = ToMessage(VelocityCommand{});
  for (int i = 0; i < 3; ++i) {
    const auto velocity = [i](auto& m) -> double& { return m.velocity_B_m_s[i]; };
    EXPECT_TRUE(NeedsFinite(nav, velocity));
    EXPECT_TRUE(NeedsFinite(odometry, velocity));
    EXPECT_TRUE(NeedsFinite(dvl, velocity));
    EXPECT_TRUE(NeedsFinite(control, velocity));
    EXPECT_TRUE(
        NeedsFinite(imu, [i](auto& m) -> double& { return m.angular_velocity_B_rad_s[i]; }));
    EXPECT_TRUE(NeedsFinite(nav, [i](auto& m) -> double& { return m.X_OB.position_m[i]; }));
    EXPECT_TRUE(NeedsFinite(odometry, [i](auto& m) -> double& { return m.X_OB.position_m[i]; }));
  }
  for (int i = 0; i < 9; ++i)
    EXPECT_TRUE(NeedsFinite(odometry, [i](auto& m) -> double& { return m.covariance_xyyaw[i]; }));
  const auto yaw_rate = [](auto& m) -> double& { return m.yaw_rate_rad_s; };
  EXPECT_TRUE(NeedsFinite(nav, yaw_rate));
  EXPECT_TRUE(NeedsFinite(odometry, yaw_rate));
  EXPECT_TRUE(NeedsFinite(control, yaw_rate));
  EXPECT_TRUE(NeedsFinite(imu, [](auto& m) -> double& { return m.roll_rad; }));
  EXPECT_TRUE(NeedsFinite(imu, [](auto& m) -> double& { return m.pitch_rad; }));
  EXPECT_TRUE(NeedsFinite(ToMessage(DepthRecord{}), [](auto& m) -> double& { return m.depth_m; }));
}

TEST(ConvertTest, WhatIsNoCovarianceIsRefused) {
  const auto survives = [](const Mat3& covariance) {
    OdometrySample sample;
    sample.covariance = covariance;
    return FromMessage(ToMessage(sample)).has_value();
  };
  EXPECT_TRUE(survives(Mat3::Zero()));
  EXPECT_TRUE(survives(Vec3(4, 1e-9, 0).asDiagonal()));
  EXPECT_FALSE(survives(Vec3(1, 1, -1e-9).asDiagonal()));
  EXPECT_FALSE(survives(Vec3(1, 1, 1e9).asDiagonal())) << "no vehicle is so far off";
  Mat3 covariance = Mat3::Identity();
  covariance(0, 1) = 0.5;
  EXPECT_FALSE(survives(covariance)) << "not symmetric";
  covariance(0, 1) = covariance(1, 0) = 1.1;
  EXPECT_FALSE(survives(covariance)) << "a negative variance in between";
}

TEST(ConvertTest, SonarDataSurvive) {
  const SonarReturns returns = SomeReturns(), returns_read = Travelled(returns);
  EXPECT_EQ(returns_read.range_m, returns.range_m);
  EXPECT_EQ(returns_read.strength, returns.strength);
  EXPECT_EQ(returns_read.tilt_rad, returns.tilt_rad);
  EXPECT_EQ(returns_read.min_range_m, returns.min_range_m);
  EXPECT_EQ(returns_read.max_range_m, returns.max_range_m);
  EXPECT_EQ(returns_read.sequence, 42);

  const SonarFrame frame = SomeFrame(), frame_read = Travelled(frame);
  EXPECT_EQ(frame_read.samples, frame.samples);
  EXPECT_EQ(frame_read.beams, 3);
  EXPECT_EQ(frame_read.bins, 4);
  EXPECT_EQ(frame_read.tilt_rad, frame.tilt_rad);
}

TEST(ConvertTest, ImpossibleSonarDataAreRefused) {
  const auto returns = ToMessage(SomeReturns());
  const auto frame = ToMessage(SomeFrame());
  const auto expect_window = [](const auto& good) {
    const auto with = [&](double min_m, double max_m) {
      auto message = good;
      message.min_range_m = min_m;
      message.max_range_m = max_m;
      return FromMessage(message).has_value();
    };
    EXPECT_TRUE(with(0, 1));
    for (const auto& [min_m, max_m] : {std::pair(-1.0, 1.0), {2.0, 1.0}, {1.0, 1.0}, {0.0, 1e5}})
      EXPECT_FALSE(with(min_m, max_m)) << min_m << " " << max_m;
    EXPECT_TRUE(NeedsFinite(good, [](auto& m) -> double& { return m.min_range_m; }));
    EXPECT_TRUE(NeedsFinite(good, [](auto& m) -> double& { return m.max_range_m; }));
  };
  expect_window(returns);
  expect_window(frame);
  expect_window(ToMessage(Scan{{}, 0, Pose3::Identity(), 0.5, 4, {}}));
  EXPECT_TRUE(NeedsFinite(returns, [](auto& m) -> double& { return m.tilt_rad; }));
  EXPECT_TRUE(NeedsFinite(frame, [](auto& m) -> double& { return m.tilt_rad; }));
  EXPECT_TRUE(NeedsFinite(returns, [](auto& m) -> float& { return m.range_m[1]; }));
  EXPECT_TRUE(NeedsFinite(returns, [](auto& m) -> float& { return m.strength[1]; }));
  for (const auto& [beams, bins] : {std::pair(3, 5), {4, 4}, {-3, -4}, {0, 0}, {12, 0}}) {
    auto message = frame;
    message.beams = beams;
    message.bins = bins;
    EXPECT_FALSE(FromMessage(message)) << beams << " x " << bins;
  }
  auto overflow = frame;
  overflow.beams = overflow.bins = 1 << 16;
  overflow.size = 0;
  overflow.samples.clear();
  EXPECT_FALSE(FromMessage(overflow));
}

TEST(ConvertTest, ScansSurvive) {
  Random random(4, "convert");
  for (int i = 0; i < 20; ++i) {
    const Scan scan = RandomScan(FromUtime(i), random), read = Travelled(scan);
    EXPECT_EQ(ToUtime(read.time), Header().utime_us);
    EXPECT_EQ(read.sequence, 42);
    EXPECT_TRUE(read.X_BS.isApprox(scan.X_BS, 1e-14));
    EXPECT_EQ(read.min_range_m, scan.min_range_m);
    EXPECT_EQ(read.max_range_m, scan.max_range_m);
    ASSERT_EQ(read.beams.size(), scan.beams.size());
    for (std::size_t k = 0; k < scan.beams.size(); ++k) {
      EXPECT_EQ(read.beams[k].bearing_rad, scan.beams[k].bearing_rad);
      EXPECT_EQ(read.beams[k].range_m, scan.beams[k].range_m);
      EXPECT_EQ(read.beams[k].strength, scan.beams[k].strength);
      EXPECT_EQ(read.beams[k].status, scan.beams[k].status);
    }
  }
}

TEST(ConvertTest, ImpossibleScansAreRefused) {
  Random random(5, "convert");
  const scan_t good = ToMessage(RandomScan({}, random));
  EXPECT_TRUE(NeedsFinite(good, [](scan_t& m) -> float& { return m.bearing_rad[3]; }));
  EXPECT_TRUE(NeedsFinite(good, [](scan_t& m) -> float& { return m.range_m[3]; }));
  EXPECT_TRUE(NeedsFinite(good, [](scan_t& m) -> float& { return m.strength[3]; }));
  for (const int status : {-1, 3, 127}) {
    scan_t message = good;
    message.status[5] = static_cast<std::int8_t>(status);
    EXPECT_FALSE(FromMessage(message)) << status;
  }
  for (const float range_m : {-0.1f, 4.1f, 1e30f}) {
    scan_t message = good;
    message.range_m[5] = range_m;
    EXPECT_FALSE(FromMessage(message)) << range_m;
  }
}

TEST(ConvertTest, SubmapsSurvive) {
  Random random(6, "convert");
  for (int id = 0; id < 5; ++id) {
    const SubmapPtr submap = RandomSubmap(id, 0.095, random);
    submap_t message{};
    ASSERT_TRUE(Decode(Encode(SubmapMessage(*submap)), message));
    const auto read = FromMessage(message);
    ASSERT_TRUE(read.has_value());
    EXPECT_EQ((*read)->id(), id);
    EXPECT_EQ((*read)->scans, submap->scans);
    EXPECT_EQ((*read)->first_scan, submap->first_scan);
    EXPECT_EQ((*read)->last_scan, submap->last_scan);
    EXPECT_EQ((*read)->drift, submap->drift);
    EXPECT_EQ((*read)->base.odometry.time, submap->base.odometry.time);
    EXPECT_EQ((*read)->base.odometry.origin, submap->base.odometry.origin);
    EXPECT_EQ((*read)->base.odometry.segment, submap->base.odometry.segment);
    EXPECT_TRUE((*read)->X_ML.isApprox(submap->X_ML, 1e-14));
    EXPECT_EQ((*read)->base.odometry.covariance, submap->base.odometry.covariance);
    EXPECT_TRUE((*read)->base.odometry.X_OB.isApprox(submap->base.odometry.X_OB, 1e-14));
    EXPECT_TRUE((*read)->base.edge.X_PM.isApprox(submap->base.edge.X_PM, 1e-14));
    EXPECT_EQ((*read)->base.edge.covariance, submap->base.edge.covariance);
    EXPECT_EQ(TableOf((*read)->grid), TableOf(submap->grid));
    EXPECT_EQ((*read)->grid.grid().voxel_size_m(), 0.095);
  }
}

TEST(ConvertTest, DamagedSubmapsAreRefused) {
  Random random(7, "convert");
  const submap_t good = SubmapMessage(*RandomSubmap(3, 0.1, random));
  const auto refuses = [&](auto spoil) {
    submap_t message = good;
    spoil(message);
    return !FromMessage(message).has_value();
  };
  EXPECT_FALSE(refuses([](submap_t&) {}));
  for (const int size : {-1, 0, good.octree_bytes - 1, good.octree_bytes + 1, (1 << 28) + 1})
    EXPECT_TRUE(refuses([=](submap_t& m) { m.octree_bytes = size; })) << size;
  for (int size = 0; size < good.size; size += 1 + good.size / 50)
    EXPECT_TRUE(refuses([=](submap_t& m) { m.octree_zlib.resize(size); })) << size;
  EXPECT_TRUE(refuses([](submap_t& m) { m.base.submap_id = -1; }));
  EXPECT_TRUE(NeedsFinite(good, [](submap_t& m) -> double& { return m.drift_xyyaw[4]; }));
  EXPECT_TRUE(NeedsFinite(good, [](submap_t& m) -> double& { return m.base.edge_covariance[7]; }));
  EXPECT_TRUE(NeedsFinite(
      good, [](submap_t& m) -> double& { return m.base.odometry.covariance_xyyaw[8]; }));
  EXPECT_TRUE(
      NeedsFinite(good, [](submap_t& m) -> double& { return m.base.edge_X_PM.position_m[0]; }));
  int refused = 0;
  for (int i = 0; i < 300; ++i)
    refused +=
        refuses([&](submap_t& m) { m.octree_zlib[random.Index(m.size)] ^= 1 << random.Index(8); });
  EXPECT_GE(refused, 299);  // zlib's check sum is of 32 bits.
}

TEST(ConvertTest, FlippedBitsNeverCrash) {
  Random random(8, "convert");
  const auto try_all = [&]<class Message>(const Message& good) {
    const std::vector<std::uint8_t> bytes = Encode(good);
    int decoded = 0;
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
      std::vector<std::uint8_t> damaged = bytes;
      damaged[bit / 8] ^= 1 << bit % 8;
      Message message{};
      if (!Decode(damaged, message)) continue;
      FromMessage(message);
      ++decoded;
    }
    EXPECT_GT(decoded, 0);
  };
  try_all(ToMessage(SomeNav(random)));
  try_all(ToMessage(SomeOdometry(random)));
  try_all(ToMessage(DvlRecord{}));
  try_all(ToMessage(ImuRecord{}));
  try_all(ToMessage(DepthRecord{}));
  try_all(ToMessage(VelocityCommand{}));
}

}  // namespace
}  // namespace vog
