#include "sim/scene/shapes.h"

#include <gtest/gtest.h>

#include <numbers>

#include "sim/scene/mesh_testing.h"

namespace vog {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(ShapesTest, BoxIsClosedAndOfItsVolume) {
  const TriangleMesh box = Box(MakePose({1, 2, 3}, {0.1, 0.2, 0.3}), {1, 2, 3});
  EXPECT_TRUE(IsClosed(box));
  EXPECT_EQ(box.triangles.size(), 12u);
  EXPECT_NEAR(SignedVolume(box), 6, 1e-12);
}

TEST(ShapesTest, CylinderIsClosedAndOfItsVolume) {
  constexpr int kPoints = 50;
  const TriangleMesh cylinder = Cylinder({0, 0, 1}, {3, 0, 1}, 0.5, kPoints, 0.2);
  EXPECT_TRUE(IsClosed(cylinder));
  const double disc = 0.5 * kPoints * 0.25 * std::sin(2 * kPi / kPoints);
  EXPECT_NEAR(SignedVolume(cylinder), 3 * disc, 1e-9);
  EXPECT_TRUE(cylinder.Bounds().min().isApprox(Vec3(0, -0.5, 0.5), 0.01));
  EXPECT_TRUE(cylinder.Bounds().max().isApprox(Vec3(3, 0.5, 1.5), 0.01));
}

// Whichever way the rings run and in whichever order they come.
TEST(ShapesTest, LoftPointsOutward) {
  Ring low = Circle({0, 0, 0}, Vec3::UnitZ(), 1, 7), high = Circle({0, 0, 1}, Vec3::UnitZ(), 1, 7);
  EXPECT_GT(SignedVolume(Loft({low, high}, 10)), 2);
  EXPECT_GT(SignedVolume(Loft({high, low}, 10)), 2);
  std::reverse(low.begin(), low.end());
  std::reverse(high.begin(), high.end());
  EXPECT_GT(SignedVolume(Loft({low, high}, 10)), 2);
}

TEST(ShapesTest, LoftOfTrianglesAndSquaresIsClosed) {
  for (const int points : {3, 4, 5, 6}) {
    const TriangleMesh loft = Loft(
        {Circle({0, 0, 0}, Vec3::UnitX(), 1, points), Circle({1, 0, 0}, Vec3::UnitX(), 2, points),
         Circle({2, 0, 0}, Vec3::UnitX(), 1, points)},
        0.5);
    EXPECT_TRUE(IsClosed(loft)) << points;
    EXPECT_GT(SignedVolume(loft), 0) << points;
  }
}

TEST(ShapesTest, TubeIsClosedAndHollow) {
  constexpr int kPoints = 30;
  const TriangleMesh tube = Tube({0, 0, 0}, {0, 2, 1}, 0.5, 0.1, kPoints, 0.3);
  EXPECT_TRUE(IsClosed(tube));
  EXPECT_EQ(EulerNumber(tube), 0) << "one hole through it";
  const double ring = 0.5 * kPoints * (0.25 - 0.16) * std::sin(2 * kPi / kPoints);
  EXPECT_NEAR(SignedVolume(tube), std::sqrt(5) * ring, 1e-9);
}

TEST(ShapesTest, SphereIsClosedAndRound) {
  const Vec3 center(1, -2, 3);
  const TriangleMesh sphere = Sphere(center, 2, 0.3);
  EXPECT_TRUE(IsClosed(sphere));
  EXPECT_EQ(EulerNumber(sphere), 2);
  for (const Vec3& vertex : sphere.vertices) ASSERT_NEAR((vertex - center).norm(), 2, 1e-12);
  EXPECT_LE(LongestEdge(sphere), 0.3);
  EXPECT_NEAR(SignedVolume(sphere), 4.0 / 3 * kPi * 8, 0.3);
}

/// A plate in the x-y plane, a square metre a cell. `open` has a character a cell, a row a line.
TriangleMesh FlatPlate(const std::vector<std::string>& open) {
  PlateGrid grid;
  grid.rows = static_cast<int>(open.size());
  grid.columns = static_cast<int>(open.front().size());
  grid.front = [](int row, int column) { return Vec3(row, column, 0); };
  grid.back = [](int row, int column) { return Vec3(row, column, -0.5); };
  grid.is_open = [&](int row, int column) { return open[row][column] == 'o'; };
  return Plate(grid);
}

TEST(ShapesTest, PlateHasItsOpenings) {
  const TriangleMesh whole = FlatPlate({"...", "..."});
  EXPECT_TRUE(IsClosed(whole));
  EXPECT_NEAR(SignedVolume(whole), 3, 1e-12);
  EXPECT_EQ(EulerNumber(whole), 2);
  const TriangleMesh open = FlatPlate({".....", ".oo..", "...o.", "....o"});
  EXPECT_TRUE(IsClosed(open));
  EXPECT_NEAR(SignedVolume(open), 0.5 * (20 - 6), 1e-12) << "four, and two more at the corners";
  EXPECT_NEAR(SignedVolume(FlatPlate({".o", "o."})), 0.5, 1e-12) << "one corner remains";
}

TEST(ShapesTest, EachOpeningOfAPlateIsAHoleThroughIt) {
  EXPECT_EQ(EulerNumber(FlatPlate({"...", ".o.", "..."})), 0);
  EXPECT_EQ(EulerNumber(FlatPlate({".....", ".o.o.", "....."})), -2);
}

TEST(ShapesTest, RefineShortensEdgesAndKeepsTheSolid) {
  const TriangleMesh coarse = Box(Pose3::Identity(), {3, 0.2, 1});
  const TriangleMesh fine = Refine(coarse, 0.3);
  EXPECT_LE(LongestEdge(fine), 0.3);
  EXPECT_TRUE(IsClosed(fine));
  EXPECT_NEAR(SignedVolume(fine), SignedVolume(coarse), 1e-12);
  EXPECT_LT(fine.triangles.size(), 1000u);
}

TEST(ShapesTest, RefineLeavesAFineMeshAlone) {
  const TriangleMesh box = Box(Pose3::Identity(), {1, 1, 1});
  EXPECT_EQ(Refine(box, 2).triangles, box.triangles);
}

}  // namespace
}  // namespace vog
