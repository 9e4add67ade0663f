#include "lib/scan/scan_synchronizer.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "lib/base/random.h"

namespace vog {
namespace {

Time At(int ms) { return Time(std::chrono::milliseconds(ms)); }

OdometrySample Odometry(int ms, std::int64_t segment = 1) {
  OdometrySample sample;
  sample.time = At(ms);
  sample.segment = segment;
  sample.X_OB = MakePose({0.001 * ms, 0, 0});
  return sample;
}

Scan ScanAt(int ms) {
  Scan scan;
  scan.time = At(ms);
  scan.sequence = ms;
  return scan;
}

class ScanSynchronizerTest : public testing::Test {
 protected:
  /// The times [ms] of all scans that are ready.
  std::vector<int> Ready() {
    std::vector<int> times_ms;
    while (const auto registered = dut_.Next()) {
      EXPECT_EQ(registered->odometry.time, registered->scan.time);
      EXPECT_NEAR(registered->odometry.X_OB.translation().x(), ToSeconds(registered->scan.time),
                  1e-12);
      times_ms.push_back(static_cast<int>(ToUtime(registered->scan.time) / 1000));
    }
    return times_ms;
  }

  ScanSynchronizer dut_;
};

TEST_F(ScanSynchronizerTest, AScanWaitsForOdometryOnBothSides) {
  dut_.Add(ScanAt(150));
  EXPECT_TRUE(Ready().empty());
  dut_.Add(Odometry(100));
  EXPECT_TRUE(Ready().empty());
  dut_.Add(Odometry(140));
  EXPECT_TRUE(Ready().empty());
  EXPECT_EQ(dut_.waiting(), 1);
  dut_.Add(Odometry(160));
  EXPECT_EQ(Ready(), (std::vector<int>{150}));
  EXPECT_EQ(dut_.waiting(), 0);
  EXPECT_EQ(dut_.dropped(), 0);
}

TEST_F(ScanSynchronizerTest, OdometryOfTheSameMomentWillDo) {
  dut_.Add(Odometry(100));
  dut_.Add(ScanAt(100));
  EXPECT_EQ(Ready(), (std::vector<int>{100}));
}

TEST_F(ScanSynchronizerTest, ScansOlderThanAllOdometryAreDropped) {
  dut_.Add(Odometry(100));
  dut_.Add(ScanAt(50));
  dut_.Add(ScanAt(120));
  dut_.Add(Odometry(200));
  EXPECT_EQ(Ready(), (std::vector<int>{120}));
  EXPECT_EQ(dut_.dropped(), 1);
}

TEST_F(ScanSynchronizerTest, RepeatedAndLateScansAreDropped) {
  dut_.Add(Odometry(0));
  for (const int ms : {100, 100, 90, 110, 100}) dut_.Add(ScanAt(ms));
  dut_.Add(Odometry(200));
  EXPECT_EQ(Ready(), (std::vector<int>{100, 110}));
  EXPECT_EQ(dut_.dropped(), 3);
}

TEST_F(ScanSynchronizerTest, RepeatedAndLateOdometryIsPassedOver) {
  for (const int ms : {0, 100, 50, 100, 200}) dut_.Add(Odometry(ms));
  OdometrySample liar = Odometry(150);
  liar.X_OB = MakePose({77, 0, 0});
  dut_.Add(liar);
  dut_.Add(Odometry(300, 0));  // Of a segment before.
  for (const int ms : {20, 175, 200}) dut_.Add(ScanAt(ms));
  EXPECT_EQ(Ready(), (std::vector<int>{20, 175, 200}));
}

TEST_F(ScanSynchronizerTest, ScansBetweenTwoSegmentsAreDropped) {
  dut_.Add(Odometry(0, 1));
  dut_.Add(Odometry(100, 1));
  for (const int ms : {50, 150, 250, 350}) dut_.Add(ScanAt(ms));
  EXPECT_EQ(Ready(), (std::vector<int>{50}));
  dut_.Add(Odometry(200, 2));
  EXPECT_TRUE(Ready().empty());
  dut_.Add(Odometry(300, 2));
  dut_.Add(Odometry(400, 2));
  EXPECT_EQ(Ready(), (std::vector<int>{250, 350}));
  EXPECT_EQ(dut_.dropped(), 1);
}

TEST_F(ScanSynchronizerTest, TheOldestOfTooManyWaitingScansIsDropped) {
  dut_.Add(Odometry(0));
  for (int i = 1; i <= 300; ++i) dut_.Add(ScanAt(i));
  EXPECT_EQ(dut_.waiting(), 256);
  EXPECT_EQ(dut_.dropped(), 44);
  dut_.Add(Odometry(1000));
  EXPECT_EQ(Ready().size(), 256u);
}

TEST(ScanSynchronizerOrderTest, WhichStreamComesFirstDoesNotMatter) {
  Random random(1, "synchronizer");
  std::vector<OdometrySample> odometry;
  std::vector<Scan> scans;
  for (int ms = 0; ms < 4000; ms += 1 + random.Index(40)) odometry.push_back(Odometry(ms));
  for (int ms = 1; ms < 4000; ms += 1 + random.Index(60)) scans.push_back(ScanAt(ms));
  const auto run = [&](double odometry_first) {
    ScanSynchronizer dut;
    std::vector<std::pair<std::int64_t, double>> registered;
    std::size_t o = 0, s = 0;
    // The streams keep their own order, and neither runs away from the other.
    while (o < odometry.size() || s < scans.size()) {
      const bool may_o =
          o < odometry.size() &&
          (s == scans.size() || odometry[o].time <= scans[s].time + std::chrono::milliseconds(500));
      const bool may_s =
          s < scans.size() && (o == odometry.size() || scans[s].time <= odometry[o].time);
      if (may_o && (!may_s || random.Chance(odometry_first))) {
        dut.Add(odometry[o++]);
      } else {
        dut.Add(scans[s++]);
      }
      while (const auto next = dut.Next())
        registered.emplace_back(next->scan.sequence, next->odometry.X_OB.translation().x());
    }
    return registered;
  };
  const auto expected = run(0);
  EXPECT_GT(expected.size(), 100u);
  for (const double odometry_first : {0.2, 0.5, 0.9, 1.0}) EXPECT_EQ(run(odometry_first), expected);
}

}  // namespace
}  // namespace vog
