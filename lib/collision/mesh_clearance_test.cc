#include "lib/collision/mesh_clearance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "lib/base/random.h"

namespace vog {
namespace {

const Vec3 kHull_m(1, 1, 0.5);

TriangleMesh Triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
  return {.vertices = {a, b, c}, .triangles = {{0, 1, 2}}};
}

TriangleMesh RandomMesh(int triangles, Random& random) {
  TriangleMesh mesh;
  for (int i = 0; i < triangles; ++i) {
    const Vec3 middle = random.GaussianVector({3, 3, 1.5});
    const auto corner = [&] { return Vec3(middle + random.GaussianVector(Vec3::Constant(0.7))); };
    mesh.Append(Triangle(corner(), corner(), corner()));
  }
  return mesh;
}

/// Distance of a point from the box at the origin.
double DistanceFromHull(const Vec3& p_B) {
  return (p_B.cwiseAbs() - kHull_m / 2).cwiseMax(0).norm();
}

/// The distance by looking at many points of each triangle: never too small.
double SampledDistance(const TriangleMesh& mesh, const Pose3& X_WB) {
  const Pose3 X_BW = X_WB.inverse();
  double least_m = 1e9;
  constexpr int kSteps = 40;
  for (const auto& t : mesh.triangles) {
    const Vec3 a = X_BW * mesh.vertices[t[0]], b = X_BW * mesh.vertices[t[1]],
               c = X_BW * mesh.vertices[t[2]];
    for (int i = 0; i <= kSteps; ++i)
      for (int k = 0; k <= kSteps - i; ++k)
        least_m =
            std::min(least_m, DistanceFromHull(a + (b - a) * i / kSteps + (c - a) * k / kSteps));
  }
  return least_m;
}

Pose3 RandomPose(Random& random) {
  return MakePose(random.GaussianVector({3, 3, 1.5}),
                  {random.Gaussian(0.2), random.Gaussian(0.2), random.Uniform(-3, 3)});
}

TEST(MeshClearanceTest, DistanceIsThatOfTheNearestSample) {
  Random random(1, "clearance");
  const TriangleMesh mesh = RandomMesh(12, random);
  const MeshClearance dut(mesh, kHull_m);
  int apart = 0, touching = 0;
  for (int i = 0; i < 50; ++i) {
    const Pose3 X_WB = RandomPose(random);
    const double sampled_m = SampledDistance(mesh, X_WB);
    const double distance_m = dut.DistanceAt(X_WB);
    EXPECT_LE(distance_m, sampled_m + 1e-9);
    EXPECT_GE(distance_m, sampled_m - 0.05);  // The samples' spacing.
    if (sampled_m == 0) {
      EXPECT_TRUE(dut.Collides(X_WB));
    }
    EXPECT_EQ(dut.Collides(X_WB), distance_m == 0);
    ++(distance_m > 0 ? apart : touching);
  }
  EXPECT_GT(apart, 10);
  EXPECT_GT(touching, 3);
}

TEST(MeshClearanceTest, IsExactAtAWall) {
  const MeshClearance dut(Triangle({2, -50, -50}, {2, 50, -50}, {2, 0, 50}), kHull_m);
  EXPECT_NEAR(dut.DistanceAt(Pose3::Identity()), 1.5, 1e-9);
  EXPECT_NEAR(dut.DistanceAt(MakePose({3.75, 0, 0})), 1.25, 1e-9);
  const double half_diagonal_m = std::numbers::sqrt2 / 2;
  EXPECT_NEAR(dut.DistanceAt(MakePose({0, 0, 0}, {0, 0, std::numbers::pi / 4})),
              2 - half_diagonal_m, 1e-9);
  EXPECT_FALSE(dut.Collides(MakePose({1.499, 0, 0})));
  EXPECT_TRUE(dut.Collides(MakePose({1.501, 0, 0})));
  EXPECT_EQ(dut.DistanceAt(MakePose({1.8, 0, 0})), 0);
}

TEST(MeshClearanceTest, TouchesATriangleInsideTheHullButNoSolidAroundIt) {
  const TriangleMesh inside = Triangle({0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0});
  const MeshClearance small(inside, kHull_m);
  EXPECT_TRUE(small.Collides(Pose3::Identity()));
  EXPECT_EQ(small.DistanceAt(Pose3::Identity()), 0);
  TriangleMesh around;
  for (const double side : {-1.0, 1.0})
    around.Append(Triangle({5 * side, -50, -50}, {5 * side, 50, -50}, {5 * side, 0, 50}));
  const MeshClearance large(around, kHull_m);
  EXPECT_FALSE(large.Collides(Pose3::Identity()));
  EXPECT_NEAR(large.DistanceAt(Pose3::Identity()), 4.5, 1e-9);
}

TEST(MeshClearanceTest, MovingBothMovesNothing) {
  Random random(2, "clearance");
  const TriangleMesh mesh = RandomMesh(10, random);
  const MeshClearance here(mesh, kHull_m);
  const Pose3 X = RandomPose(random);
  TriangleMesh moved = mesh;
  for (Vec3& vertex : moved.vertices) vertex = X * vertex;
  const MeshClearance there(moved, kHull_m);
  for (int i = 0; i < 50; ++i) {
    const Pose3 X_WB = RandomPose(random);
    EXPECT_NEAR(here.DistanceAt(X_WB), there.DistanceAt(X * X_WB), 1e-6);
  }
}

}  // namespace
}  // namespace vog
