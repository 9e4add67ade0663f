#include "sim/scene/overlap.h"

#include <gtest/gtest.h>

#include <numbers>

#include "sim/scene/shapes.h"

namespace vog {
namespace {

const Vec3 kHull_m(1, 1, 0.5);

TriangleMesh Triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
  return {.vertices = {a, b, c}, .triangles = {{0, 1, 2}}};
}

TEST(OverlapTest, TouchesAWallThatItReaches) {
  const TriangleMesh wall = Triangle({1, -50, -50}, {1, 50, -50}, {1, 0, 50});
  EXPECT_FALSE(BoxTouches(wall, MakePose({0.499, 0, 0}), kHull_m));
  EXPECT_TRUE(BoxTouches(wall, MakePose({0.501, 0, 0}), kHull_m));
  EXPECT_TRUE(BoxTouches(wall, MakePose({1.499, 0, 0}), kHull_m));
  EXPECT_FALSE(BoxTouches(wall, MakePose({1.501, 0, 0}), kHull_m));
}

TEST(OverlapTest, ATurnedBoxReachesWithItsCorner) {
  const TriangleMesh wall = Triangle({1, -50, -50}, {1, 50, -50}, {1, 0, 50});
  const double half_diagonal_m = std::numbers::sqrt2 / 2;
  const RollPitchYaw turned{0, 0, std::numbers::pi / 4};
  EXPECT_FALSE(BoxTouches(wall, MakePose({0.999 - half_diagonal_m, 0, 0}, turned), kHull_m));
  EXPECT_TRUE(BoxTouches(wall, MakePose({1.001 - half_diagonal_m, 0, 0}, turned), kHull_m));
}

TEST(OverlapTest, FindsATriangleThatOnlyAnEdgePairSeparates) {
  // Passes the box's vertical edge at (0.5, 0.5) diagonally, rising: its bounds overlap the box's.
  const auto rod = [](double distance_m) {
    const Vec3 middle = Vec3(0.5, 0.5, 0) + distance_m * Vec3(1, 1, 0).normalized();
    const Vec3 along(1, -1, 0.2);
    return Triangle(middle + along, middle - along, middle + 1.001 * along);
  };
  EXPECT_FALSE(BoxTouches(rod(0.001), Pose3::Identity(), kHull_m));
  EXPECT_TRUE(BoxTouches(rod(-0.001), Pose3::Identity(), kHull_m));
}

TEST(OverlapTest, HoldsATriangleInside) {
  const TriangleMesh small = Triangle({0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0});
  EXPECT_TRUE(BoxTouches(small, Pose3::Identity(), kHull_m));
}

TEST(OverlapTest, DoesNotTouchFromInsideAHollow) {
  EXPECT_FALSE(BoxTouches(Box(Pose3::Identity(), {5, 5, 5}), Pose3::Identity(), kHull_m));
}

TEST(OverlapTest, TouchesNothingInAnEmptyMesh) {
  EXPECT_FALSE(BoxTouches(TriangleMesh{}, Pose3::Identity(), kHull_m));
}

}  // namespace
}  // namespace vog
