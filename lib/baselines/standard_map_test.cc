#include "lib/baselines/standard_map.h"

#include <gtest/gtest.h>

#include "lib/scan/sonar.h"
#include "lib/submap/scan_inserter.h"
#include "lib/submap/scans_testing.h"
#include "lib/submap/submaps_testing.h"

namespace vog {
namespace {

constexpr double kVoxel_m = 0.095;

class StandardMapTest : public testing::Test {
 protected:
  float LogOddsOf(const VoxelKey& voxel) const {
    float log_odds;
    dut_.LogOddsOf({&voxel, 1}, {&log_odds, 1});
    return log_odds;
  }

  void InsertRandomScans(int count) {
    for (int i = 0; i < count; ++i) {
      const Scan scan = RandomScan(FromUtime(i), random_);
      const Pose3 X_WB = RandomPose(1, random_);
      dut_.Insert(scan, X_WB);
      inserter_.Insert(scan, X_WB, grid_);
    }
  }

  Random random_{1, testing::UnitTest::GetInstance()->current_test_info()->name()};
  SensorModelOptions model_;
  StandardMap dut_{kVoxel_m, model_};
  // Another way to the same numbers.
  ScanInserter inserter_{SensorModel(model_), kVoxel_m};
  BrickGrid grid_{kVoxel_m};
};

TEST_F(StandardMapTest, IsOctomapsOwnInsertionForEchoesWithoutAWindow) {
  octomap::OcTree tree(kVoxel_m);
  tree.setProbHit(ProbabilityOfLogOdds(ToLogOdds(SensorModel(model_).hit)));
  tree.setProbMiss(ProbabilityOfLogOdds(ToLogOdds(SensorModel(model_).miss)));
  tree.setClampingThresMin(ProbabilityOfLogOdds(ToLogOdds(SensorModel(model_).min)));
  tree.setClampingThresMax(ProbabilityOfLogOdds(ToLogOdds(SensorModel(model_).max)));
  const auto to_octomap = [](const Vec3& p) {
    return octomap::point3d(static_cast<float>(p.x()), static_cast<float>(p.y()),
                            static_cast<float>(p.z()));
  };
  for (int i = 0; i < 40; ++i) {
    Scan scan = RandomScan(FromUtime(i), random_);
    scan.min_range_m = 0;
    for (Beam& beam : scan.beams)
      if (beam.status == BeamStatus::kClear) beam.status = BeamStatus::kUncertain;
    const Pose3 X_WB = RandomPose(1, random_), X_WS = X_WB * scan.X_BS;
    dut_.Insert(scan, X_WB);
    octomap::Pointcloud cloud;
    for (const Beam& beam : scan.beams)
      if (beam.status == BeamStatus::kReturn)
        cloud.push_back(to_octomap(X_WS * (beam.range_m * BeamDirection(beam.bearing_rad))));
    tree.insertPointCloud(cloud, to_octomap(X_WS.translation()));
  }
  tree.expand();
  std::size_t leaves = 0;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf, ++leaves) {
    const octomap::OcTreeKey key = leaf.getKey();
    ASSERT_EQ(LogOddsOf({key[0] - 32768, key[1] - 32768, key[2] - 32768}), leaf->getLogOdds());
  }
  octomap::OcTree own = dut_.tree();
  own.expand();
  EXPECT_EQ(own.getNumLeafNodes(), leaves);
}

TEST_F(StandardMapTest, KnowsWhatAGridOfTheSameScansKnows) {
  InsertRandomScans(50);
  const VoxelTable table = TableOf(grid_);
  EXPECT_GT(table.size(), 5000u);
  for (const auto& [key, units] : table) ASSERT_NEAR(LogOddsOf(key), ToLogOdds(units), 1e-4);
  octomap::OcTree own = dut_.tree();
  own.expand();
  EXPECT_EQ(own.getNumLeafNodes(), table.size());
}

TEST_F(StandardMapTest, AllQueriesAgree) {
  InsertRandomScans(30);
  const VoxelBox box{{-20, -20, -2}, {20, 20, 2}};
  std::vector<float> box_answers;
  dut_.LogOddsIn(box, box_answers);
  const auto same = [](float a, float b) { return a == b || (!IsKnown(a) && !IsKnown(b)); };
  ForEachVoxel(box, [&](const VoxelKey& voxel) {
    const Vec3 center_W = dut_.grid().CenterOf(voxel);
    float at_point;
    dut_.LogOddsAt({&center_W, 1}, {&at_point, 1});
    ASSERT_PRED2(same, at_point, LogOddsOf(voxel));
    ASSERT_PRED2(same, box_answers[box.IndexOf(voxel)], at_point);
  });
  std::vector<RayVoxel> ray;
  for (int i = 0; i < 100; ++i) {
    dut_.CastRay(RandomPoint(1, random_), RandomPoint(1, random_).normalized(), 3, ray);
    for (const RayVoxel& step : ray) {
      EXPECT_PRED2(same, step.log_odds, LogOddsOf(step.key));
      EXPECT_TRUE(&step == &ray.back() || !dut_.IsOccupied(step.log_odds));
    }
  }
}

TEST_F(StandardMapTest, PlacesBeyondAnOctreeAreUnknown) {
  InsertRandomScans(5);
  for (const auto& [key, units] : TableOf(grid_)) {
    EXPECT_FALSE(IsKnown(LogOddsOf({key.x + 65536, key.y, key.z})));
    EXPECT_FALSE(IsKnown(LogOddsOf({key.x, key.y - 65536, key.z + 65536})));
  }
}

TEST_F(StandardMapTest, ItsRevisionGrowsWithEachScan) {
  const std::int64_t revision = dut_.revision();
  InsertRandomScans(3);
  EXPECT_EQ(dut_.revision(), revision + 3);
}

}  // namespace
}  // namespace vog
