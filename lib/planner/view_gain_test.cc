#include "lib/planner/view_gain.h"

#include <gtest/gtest.h>

#include <unordered_set>

#include "lib/base/random.h"
#include "lib/planner/chamber_testing.h"

namespace vog {
namespace {

constexpr double kRange_m = 3, kStep_deg = 6;

/// Walks each ray by the millimetre.
int VisibleByHand(const GridMap& map, const SonarOptions& sonar, const Eigen::AlignedBox3d& box_W,
                  const Waypoint& at, const OccupancyMap::EndsRay& ends) {
  const auto angles = [](double half_deg) {
    const int steps = static_cast<int>(std::ceil(2 * half_deg / kStep_deg));
    std::vector<double> all;
    for (int i = 0; i <= steps; ++i)
      all.push_back(steps == 0 ? 0 : ToRadians(half_deg * (2.0 * i / steps - 1)));
    return all;
  };
  const VoxelBox counted = VoxelsOf(map.grid(), box_W);
  std::unordered_set<VoxelKey> seen;
  for (const double tilt : angles(sonar.tilt == TiltMode::kSweep ? sonar.tilt_amplitude_deg : 0)) {
    const Pose3 X_WS = at.X_WB() * SonarPose(sonar, tilt);
    for (const double bearing : angles(sonar.fov_deg / 2)) {
      VoxelKey last{1 << 20, 0, 0};
      for (double s = 0; s <= std::min(kRange_m, sonar.max_range_m); s += 1e-3) {
        const VoxelKey key = map.grid().KeyOf(X_WS * (s * BeamDirection(bearing)));
        const bool is_new = !(key == last);
        last = key;
        if (map.IsOccupied(map.Get(key))) break;
        // Voxels that begin in front of the window do not count.
        if (!is_new || IsKnown(map.Get(key)) || s < sonar.min_range_m) continue;
        if (counted.Contains(key)) seen.insert(key);
        if (ends(key)) break;
      }
    }
  }
  return static_cast<int>(seen.size());
}

GridMap RandomMap(Random& random) {
  GridMap map(0.2);
  ForEachVoxel({{-20, -20, -20}, {20, 20, 20}}, [&](const VoxelKey& key) {
    if (random.Chance(0.5)) map.Set(key, random.Chance(0.01) ? GridMap::kOccupied : GridMap::kFree);
  });
  return map;
}

TEST(ViewGainTest, CountsTheUnknownVoxelsThatRaysMeet) {
  Random random(1, "view");
  int sum = 0, ended_early = 0;
  for (int i = 0; i < 12; ++i) {
    const GridMap map = RandomMap(random);
    SonarOptions sonar = WideSonar();
    sonar.min_range_m = random.Uniform(0, 0.8);
    if (i % 4 == 0) sonar.tilt = TiltMode::kFixed;
    if (i % 3 == 0) sonar.max_range_m = 2;
    const Eigen::AlignedBox3d box_W(Vec3(-2, -1, -1.5), Vec3(3, 2.5, 1));
    const Waypoint at{random.GaussianVector(Vec3::Constant(0.5)), random.Uniform(-3, 3)};
    const ViewGain dut(sonar, kRange_m, kStep_deg, box_W);
    const int expected =
        VisibleByHand(map, sonar, box_W, at, [](const VoxelKey&) { return false; });
    // Steps of a millimetre miss a corner now and then.
    EXPECT_NEAR(dut.Visible(map, at), expected, 3 + 0.02 * expected);
    const auto ends = [](const VoxelKey& key) { return (key.x + key.y + key.z) % 7 == 0; };
    const int ended = VisibleByHand(map, sonar, box_W, at, ends);
    EXPECT_NEAR(static_cast<int>(dut.See(map, at, ends).size()), ended, 3 + 0.02 * ended);
    EXPECT_LE(ended, expected);
    sum += ended;
    ended_early += expected - ended;
  }
  EXPECT_GT(sum, 1000);
  EXPECT_GT(ended_early, 500);
}

TEST(ViewGainTest, TheSameViewAgainIsTheSame) {
  Random random(2, "view");
  const GridMap map = RandomMap(random);
  const ViewGain dut(WideSonar(), kRange_m, kStep_deg, {Vec3(-3, -3, -3), Vec3(3, 3, 3)});
  const Waypoint here{{0.1, 0.2, 0.3}, 1}, there{{1, 0, 0}, -2};
  const int first = dut.Visible(map, here), other = dut.Visible(map, there);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(dut.Visible(map, here), first);
    EXPECT_EQ(dut.Visible(map, there), other);
  }
}

TEST(ViewGainTest, AWallHidesWhatIsBehind) {
  GridMap map(0.2);
  const ViewGain dut(WideSonar(), kRange_m, 2, {Vec3(1, -5, -5), Vec3(5, 5, 5)});
  const int open = dut.Visible(map, {});
  EXPECT_GT(open, 500);
  map.Fill({{4, -40, -40}, {4, 40, 40}}, GridMap::kOccupied);  // x from 0.8 to 1.0.
  EXPECT_EQ(dut.Visible(map, {}), 0);
  EXPECT_EQ(dut.Visible(map, {Vec3::Zero(), 3}), 0);
  EXPECT_GT(dut.Visible(map, {{1.1, 0, 0}, 0}), 400);
}

TEST(ViewGainTest, FarFromTheBoxSeesNothing) {
  const GridMap map(0.2);
  const ViewGain dut(WideSonar(), kRange_m, 2, {Vec3(1, -5, -5), Vec3(5, 5, 5)});
  EXPECT_EQ(dut.Visible(map, {{-20, 0, 0}, 0}), 0);
  EXPECT_EQ(dut.Visible(map, {{-0.5, 0, 0}, 3.14159}), 0) << "turned away";
}

TEST(ViewGainTest, AKnownSpaceHasNothingToGain) {
  GridMap map(0.2);
  map.Fill({{-30, -30, -30}, {30, 30, 30}}, GridMap::kFree);
  const ViewGain dut(WideSonar(), kRange_m, 2, {Vec3(-3, -3, -3), Vec3(3, 3, 3)});
  EXPECT_EQ(dut.Visible(map, {}), 0);
  map.Set({7, 0, 0}, kUnknownLogOdds);
  EXPECT_EQ(dut.Visible(map, {}), 1);
}

}  // namespace
}  // namespace vog
