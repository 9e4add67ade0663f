#include "lib/registration/kd_tree.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "lib/base/random.h"

namespace vog {
namespace {

std::vector<Vec3> RandomPoints(int count, Random& random) {
  std::vector<Vec3> points;
  for (int i = 0; i < count; ++i) points.push_back(random.GaussianVector({3, 1, 0.2}));
  return points;
}

std::vector<std::size_t> WithinByBruteForce(const std::vector<Vec3>& points, const Vec3& p,
                                            double radius_m) {
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if ((points[i] - p).norm() < radius_m) indices.push_back(i);
  }
  std::sort(indices.begin(), indices.end(), [&](std::size_t a, std::size_t b) {
    return (points[a] - p).squaredNorm() < (points[b] - p).squaredNorm();
  });
  return indices;
}

TEST(KdTreeTest, FindsTheNearestPointOfAll) {
  Random random(1, "kd_tree");
  for (const int count : {1, 2, 9, 10, 11, 1000}) {
    const std::vector<Vec3> points = RandomPoints(count, random);
    const KdTree dut(points);
    for (const Vec3& p : RandomPoints(200, random)) {
      const auto nearest = dut.NearestTo(p);
      double least_m = std::numeric_limits<double>::max();
      for (const Vec3& q : points) least_m = std::min(least_m, (p - q).norm());
      EXPECT_DOUBLE_EQ(nearest.distance_m, least_m);
      EXPECT_DOUBLE_EQ((points[nearest.index] - p).norm(), least_m);
      const auto within = dut.NearestWithin(p, 1.001 * least_m);
      ASSERT_TRUE(within);
      EXPECT_EQ(within->index, nearest.index);
      EXPECT_EQ(within->distance_m, nearest.distance_m);
      EXPECT_FALSE(dut.NearestWithin(p, 0.999 * least_m));
    }
  }
}

TEST(KdTreeTest, FindsAllPointsWithinARadiusNearestFirst) {
  Random random(2, "kd_tree");
  const std::vector<Vec3> points = RandomPoints(2000, random);
  const KdTree dut(points);
  std::vector<std::size_t> found = {7, 7, 7};  // What was there is replaced.
  for (const double radius_m : {0.01, 0.3, 1.0, 20.0}) {
    for (const Vec3& p : RandomPoints(30, random)) {
      dut.Within(p, radius_m, found);
      EXPECT_EQ(found, WithinByBruteForce(points, p, radius_m));
    }
  }
}

TEST(KdTreeTest, FindsEachOfSeveralEqualPoints) {
  const std::vector<Vec3> points(50, Vec3(1, 2, 3));
  const KdTree dut(points);
  std::vector<std::size_t> found;
  dut.Within(points[0], 0.1, found);
  std::sort(found.begin(), found.end());
  ASSERT_EQ(found.size(), points.size());
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i], i);
}

TEST(KdTreeTest, FindsNothingAmongNoPoints) {
  const std::vector<Vec3> points;
  const KdTree dut(points);
  std::vector<std::size_t> found = {1};
  dut.Within(Vec3::Zero(), 1, found);
  EXPECT_TRUE(found.empty());
}

}  // namespace
}  // namespace vog
