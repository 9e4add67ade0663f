#include "lib/occupancy/clearance_field.h"

#include <gtest/gtest.h>

#include "lib/base/random.h"
#include "lib/occupancy/grid_map_testing.h"

namespace vog {
namespace {

constexpr double kSide_m = 0.1;

double LiteralDistance(const GridMap& map, const VoxelKey& from, double max_m,
                       ClearanceField::Obstacles obstacles) {
  double least_m = max_m;
  const Vec3 center_W = map.grid().CenterOf(from), half = Vec3::Constant(kSide_m / 2);
  ForEachVoxel({{-20, -20, -20}, {20, 20, 20}}, [&](const VoxelKey& voxel) {
    const float log_odds = map.Get(voxel);
    const bool blocks = obstacles == ClearanceField::Obstacles::kOccupied ? map.IsOccupied(log_odds)
                                                                          : !map.IsFree(log_odds);
    if (!blocks) return;
    const Vec3 obstacle_W = map.grid().CenterOf(voxel);
    const Eigen::AlignedBox3d cube(obstacle_W - half, obstacle_W + half);
    least_m = std::min(least_m, cube.exteriorDistance(center_W));
  });
  return least_m;
}

TEST(ClearanceFieldTest, IsTheDistanceToTheNearestObstacle) {
  Random random(1, "clearance");
  GridMap map(kSide_m);
  map.Fill({{-20, -20, -20}, {20, 20, 20}}, GridMap::kFree);
  const auto index = [&] { return random.Index(24) - 12; };
  using Obstacles = ClearanceField::Obstacles;
  ClearanceField occupied(map, 0.75, Obstacles::kOccupied);
  ClearanceField both(map, 0.75, Obstacles::kOccupiedAndUnknown);
  for (int round = 0; round < 15; ++round) {
    map.Set({index(), index(), index()}, GridMap::kOccupied);
    map.Set({index(), index(), index()}, kUnknownLogOdds);
    map.Set({index(), index(), index()}, GridMap::kFree);
    for (int i = 0; i < 15; ++i) {
      const VoxelKey from{index(), index(), index()};
      EXPECT_NEAR(occupied.DistanceFrom(from),
                  LiteralDistance(map, from, 0.75, Obstacles::kOccupied), 1e-9);
      EXPECT_NEAR(both.DistanceFrom(from),
                  LiteralDistance(map, from, 0.75, Obstacles::kOccupiedAndUnknown), 1e-9);
    }
  }
}

/// A map that can tell where it has changed.
class TellingMap final : public OccupancyMap {
 public:
  TellingMap() : OccupancyMap(kSide_m, 0) {}
  void PutObstacle(const VoxelKey& voxel) {
    obstacle_ = voxel;
    ++revision_;
  }
  void LogOddsAt(std::span<const Vec3>, std::span<float>) const override {}
  void LogOddsOf(std::span<const VoxelKey> voxels, std::span<float> log_odds) const override {
    ReadVoxels(voxels, log_odds, [this](const VoxelKey& v) { return v == obstacle_ ? 1.f : -1.f; });
  }
  void LogOddsIn(const VoxelBox& box, std::vector<float>& log_odds) const override {
    ReadBox(box, log_odds, [this](const VoxelKey& v) { return v == obstacle_ ? 1.f : -1.f; });
  }
  void CastRay(const Vec3&, const Vec3&, double, std::vector<RayVoxel>&) const override {}
  std::int64_t revision() const override { return revision_; }
  std::optional<std::vector<Eigen::AlignedBox3d>> ChangedSince(std::int64_t) const override {
    const Vec3 center_W = grid().CenterOf(obstacle_);
    return std::vector<Eigen::AlignedBox3d>{{center_W, center_W}};
  }

 private:
  VoxelKey obstacle_{1000, 1000, 1000};
  std::int64_t revision_ = 0;
};

TEST(ClearanceFieldTest, ForgetsOnlyWhatIsNearAChange) {
  TellingMap map;
  ClearanceField dut(map, 0.5, ClearanceField::Obstacles::kOccupied);
  for (int x = 0; x < 40; ++x) EXPECT_EQ(dut.DistanceFrom({x, 0, 0}), 0.5);
  EXPECT_EQ(dut.remembered(), 40u);
  map.PutObstacle({2, 0, 0});
  EXPECT_NEAR(dut.DistanceFrom({5, 0, 0}), 0.25, 1e-9);
  EXPECT_GT(dut.remembered(), 25u);
  EXPECT_LT(dut.remembered(), 40u);
  EXPECT_EQ(dut.DistanceFrom({39, 0, 0}), 0.5);
}

}  // namespace
}  // namespace vog
