#include "lib/submap/scan_inserter.h"

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include <stdexcept>

#include "lib/scan/sonar.h"
#include "lib/submap/scans_testing.h"
#include "lib/submap/submaps_testing.h"

namespace vog {
namespace {

constexpr double kVoxel_m = 0.095;
constexpr int kKeyOrigin = 32768;

/// OctoMap itself, with our rounded log-odds to the last bit.
class RoundedOcTree : public octomap::OcTree {
 public:
  explicit RoundedOcTree(const SensorModel& model) : OcTree(kVoxel_m) {
    prob_hit_log = ToLogOdds(model.hit);
    prob_miss_log = ToLogOdds(model.miss);
    clamping_thres_min = ToLogOdds(model.min);
    clamping_thres_max = ToLogOdds(model.max);
  }
};

octomap::point3d ToOctomap(const Vec3& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

void ExpectSameVoxels(octomap::OcTree& tree, const BrickGrid& grid) {
  tree.expand();
  std::size_t leaves = 0;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf, ++leaves) {
    const octomap::OcTreeKey key = leaf.getKey();
    const LogOddsUnits units =
        grid.Get({key[0] - kKeyOrigin, key[1] - kKeyOrigin, key[2] - kKeyOrigin});
    ASSERT_NE(units, kUnknownUnits);
    ASSERT_EQ(ToLogOdds(units), leaf->getLogOdds());
  }
  EXPECT_EQ(TableOf(grid).size(), leaves);
}

class ScanInserterTest : public testing::Test {
 protected:
  /// A scan with one beam straight ahead.
  static Scan OneBeam(BeamStatus status, double range_m) {
    Scan scan{Time{}, 0, Pose3::Identity(), 0.5, 4, {}};
    scan.beams.push_back({0, static_cast<float>(range_m), 1, status});
    return scan;
  }

  int UnitsAt(double x_m) const { return grid_.Get(grid_.grid().KeyOf({x_m, 0.01, 0.01})); }

  // A little off the voxels' borders.
  const Pose3 X_MB_ = MakePose({0, 0.01, 0.01});
  Random random_{1, testing::UnitTest::GetInstance()->current_test_info()->name()};
  SensorModel model_{SensorModelOptions{}};
  ScanInserter dut_{model_, kVoxel_m};
  BrickGrid grid_{kVoxel_m};
};

TEST_F(ScanInserterTest, CloudsDoBitForBitWhatOctomapDoes) {
  RoundedOcTree tree(model_);
  for (int scan = 0; scan < 40; ++scan) {
    const Vec3 origin_M = RandomPoint(0.5, random_);
    std::vector<Vec3> points_M;
    octomap::Pointcloud cloud;
    for (int i = 0; i < 60; ++i) {
      points_M.push_back(RandomPoint(2, random_));
      cloud.push_back(ToOctomap(points_M.back()));
    }
    dut_.Insert(points_M, origin_M, grid_);
    tree.insertPointCloud(cloud, ToOctomap(origin_M));
  }
  ExpectSameVoxels(tree, grid_);
}

TEST_F(ScanInserterTest, ScansOfEchoesAloneDoWhatOctomapDoesWithTheirEndPoints) {
  RoundedOcTree tree(model_);
  for (int step = 0; step < 60; ++step) {
    Scan scan = RandomScan(FromUtime(step), random_);
    scan.min_range_m = 0;
    for (Beam& beam : scan.beams)
      if (beam.status == BeamStatus::kClear) beam.status = BeamStatus::kUncertain;
    const Pose3 X_MB = RandomPose(1, random_);
    dut_.Insert(scan, X_MB, grid_);
    octomap::Pointcloud cloud;
    const Pose3 X_MS = X_MB * scan.X_BS;
    for (const Beam& beam : scan.beams)
      if (beam.status == BeamStatus::kReturn)
        cloud.push_back(ToOctomap(X_MS * (beam.range_m * BeamDirection(beam.bearing_rad))));
    tree.insertPointCloud(cloud, ToOctomap(X_MS.translation()));
  }
  ExpectSameVoxels(tree, grid_);
}

TEST_F(ScanInserterTest, FormsDoTheSameOverManyScans) {
  if (!Supports(WalkForm::kAvx2)) GTEST_SKIP() << "not on this processor";
  ScanInserter baseline(model_, kVoxel_m, WalkForm::kBaseline);
  ScanInserter avx2(model_, kVoxel_m, WalkForm::kAvx2);
  BrickGrid other(kVoxel_m);
  for (int step = 0; step < 600; ++step) {  // The inserter's numbers of scans go round.
    const Scan scan = RandomScan(FromUtime(step), random_);
    const Pose3 X_MB = RandomPose(1, random_);
    baseline.Insert(scan, X_MB, grid_);
    avx2.Insert(scan, X_MB, other);
  }
  EXPECT_EQ(TableOf(grid_), TableOf(other));
}

TEST_F(ScanInserterTest, DoesWhatOctomapDoesOverMoreScansThanItHasNumbersFor) {
  RoundedOcTree tree(model_);
  for (int scan = 0; scan < 600; ++scan) {
    const Vec3 origin_M = RandomPoint(0.3, random_), point_M = RandomPoint(0.6, random_);
    dut_.Insert({point_M, -point_M}, origin_M, grid_);
    octomap::Pointcloud cloud;
    cloud.push_back(ToOctomap(point_M));
    cloud.push_back(ToOctomap(-point_M));
    tree.insertPointCloud(cloud, ToOctomap(origin_M), -1, /*lazy_eval=*/true);
  }
  tree.updateInnerOccupancy();
  ExpectSameVoxels(tree, grid_);
}

TEST_F(ScanInserterTest, GoesOnAfterAScanThatWasTooLarge) {
  dut_.Insert(OneBeam(BeamStatus::kReturn, 2), X_MB_, grid_);
  // In OctoMap's range, but no table holds it.
  EXPECT_THROW(dut_.Insert({{3000, 3000, 3000}}, {-3000, -3000, -3000}, grid_), std::length_error);
  EXPECT_EQ(UnitsAt(2), model_.hit);
  EXPECT_EQ(UnitsAt(1), model_.miss);
  dut_.Insert(OneBeam(BeamStatus::kReturn, 2), X_MB_, grid_);
  EXPECT_EQ(UnitsAt(2), 2 * model_.hit);
  EXPECT_EQ(UnitsAt(1), 2 * model_.miss);
}

TEST_F(ScanInserterTest, AnEchoHitsItsVoxelAndClearsTheWayFromTheWindowsStart) {
  dut_.Insert(OneBeam(BeamStatus::kReturn, 2), X_MB_, grid_);
  EXPECT_EQ(UnitsAt(2), model_.hit);
  EXPECT_EQ(UnitsAt(1), model_.miss);
  EXPECT_EQ(UnitsAt(0.55), model_.miss);
  EXPECT_EQ(UnitsAt(0.3), kUnknownUnits);
  EXPECT_EQ(UnitsAt(2.2), kUnknownUnits);
}

TEST_F(ScanInserterTest, AClearBeamClearsUpToTheWindowsEnd) {
  dut_.Insert(OneBeam(BeamStatus::kClear, 0), X_MB_, grid_);
  for (double x_m = 0.6; x_m < 3.9; x_m += 0.1) EXPECT_EQ(UnitsAt(x_m), model_.miss) << x_m;
  EXPECT_EQ(UnitsAt(0.3), kUnknownUnits);
  EXPECT_EQ(UnitsAt(4.1), kUnknownUnits);
}

TEST_F(ScanInserterTest, UncertainBeamsAndEchoesBeforeTheWindowSayNothing) {
  dut_.Insert(OneBeam(BeamStatus::kUncertain, 0), X_MB_, grid_);
  dut_.Insert(OneBeam(BeamStatus::kReturn, 0.4), X_MB_, grid_);
  dut_.Insert(Scan{}, X_MB_, grid_);
  EXPECT_EQ(grid_.bricks(), 0u);
}

TEST_F(ScanInserterTest, NothingNearerThanTheWindowChanges) {
  for (int step = 0; step < 50; ++step)
    dut_.Insert(RandomScan(FromUtime(step), random_), MakePose({0, 0, 0}, {0, 0, 0.1 * step}),
                grid_);
  const double reach_m = 0.375 - 0.15 - kVoxel_m * std::sqrt(3);  // 0.15: the sonar's place.
  ASSERT_GT(reach_m, 0.05);
  for (const auto& [key, units] : TableOf(grid_))
    EXPECT_GT(grid_.grid().CenterOf(key).norm(), reach_m);
  EXPECT_GT(grid_.bricks(), 100u);
}

TEST_F(ScanInserterTest, OneScanTouchesAVoxelOnceAndAHitWins) {
  // Beams so close that they share voxels; the second passes where the first has ended.
  Scan scan = OneBeam(BeamStatus::kReturn, 2);
  scan.beams.push_back({1e-4f, 3, 1, BeamStatus::kReturn});
  scan.beams.push_back({-1e-4f, 3, 1, BeamStatus::kReturn});
  dut_.Insert(scan, X_MB_, grid_);
  EXPECT_EQ(UnitsAt(2), model_.hit);
  EXPECT_EQ(UnitsAt(3), model_.hit);
  EXPECT_EQ(UnitsAt(1), model_.miss);
  dut_.Insert(scan, X_MB_, grid_);
  EXPECT_EQ(UnitsAt(2), 2 * model_.hit);
  EXPECT_EQ(UnitsAt(1), 2 * model_.miss);
}

TEST_F(ScanInserterTest, LogOddsStayWithinTheClamps) {
  for (int i = 0; i < 50; ++i) {
    dut_.Insert(OneBeam(BeamStatus::kReturn, 2), X_MB_, grid_);
    EXPECT_EQ(UnitsAt(2), std::min<int>(model_.max, (i + 1) * model_.hit));
    EXPECT_EQ(UnitsAt(1), std::max<int>(model_.min, (i + 1) * model_.miss));
  }
}

TEST_F(ScanInserterTest, HitsAloneClearNothing) {
  std::vector<Vec3> points_M;
  VoxelTable expected;
  for (int i = 0; i < 200; ++i) {
    points_M.push_back(RandomPoint(1, random_));
    expected[grid_.grid().KeyOf(points_M.back())] = model_.hit;
  }
  dut_.InsertHits(points_M, grid_);
  EXPECT_EQ(TableOf(grid_), expected);
}

TEST_F(ScanInserterTest, PointsBeyondAnOctreeAreLeftOut) {
  const std::vector<Vec3> points_M = {{1e5, 0, 0}, {0, -1e30, 0}, {1, 0, 0}};
  dut_.Insert(points_M, Vec3::Zero(), grid_);
  EXPECT_EQ(UnitsAt(1), model_.hit);
  EXPECT_LT(TableOf(grid_).size(), 20u);
}

}  // namespace
}  // namespace vog
