#include "lib/evaluation/cloud_error.h"

#include <gtest/gtest.h>

#include <set>
#include <tuple>

#include "lib/base/parallel.h"
#include "lib/registration/clouds_testing.h"

namespace vog {
namespace {

std::vector<Vec3> Room(int seed, double spacing_m = 0.08) {
  auto structure = CornerWithBox();
  structure.push_back(Floor());
  return SampleRectangles(structure, spacing_m, Random(seed, "room"));
}

double NearestByBruteForce(const std::vector<Vec3>& points, const Vec3& p) {
  double least_m = 1e9;
  for (const Vec3& q : points) least_m = std::min(least_m, (p - q).norm());
  return least_m;
}

TEST(AlignPointsTest, FindsAnyRigidMotion) {
  Random random(1, "align");
  for (int i = 0; i < 20; ++i) {
    const Pose3 X = RandomMotion(Twist(5, 5, 5, 2, 2, 2), random);
    std::vector<Vec3> from;
    for (int k = 0; k < 10; ++k) from.push_back(random.GaussianVector({1, 2, 3}));
    EXPECT_TRUE(AlignPoints(from, Transformed(X, from)).isApprox(X, 1e-9));
  }
}

TEST(AlignPointsTest, IsTheLeastSquaresAndNeverAMirror) {
  Random random(2, "align");
  std::vector<Vec3> from, to;
  for (int k = 0; k < 30; ++k) {
    const Vec3 p = random.GaussianVector({1, 1, 0.01});
    from.push_back(p);
    to.push_back(Vec3(p.x(), p.y(), -p.z()) + random.GaussianVector(Vec3::Constant(0.05)));
  }
  const Pose3 X = AlignPoints(from, to);
  EXPECT_NEAR(X.linear().determinant(), 1, 1e-9);
  const auto cost = [&](const Pose3& at) {
    double sum = 0;
    for (std::size_t k = 0; k < from.size(); ++k) sum += (at * from[k] - to[k]).squaredNorm();
    return sum;
  };
  for (int i = 0; i < 200; ++i)
    EXPECT_LE(cost(X), cost(X * RandomMotion(Vec6::Constant(0.1), random)) + 1e-12);
}

TEST(AlignPointsTest, OfOnePointIsAShift) {
  EXPECT_TRUE((AlignPoints({{1, 2, 3}}, {{2, 2, 2}}) * Vec3(1, 2, 3)).isApprox(Vec3(2, 2, 2)));
}

TEST(MeasureCloudTest, DistancesAreThoseOfTheBruteForce) {
  const auto truth = Room(1, 0.15);
  const auto cloud = Transformed(Exp(Twist(0.03, 0.02, -0.02, 0.005, 0, 0.01)),
                                 WithNoise(Room(2, 0.2), 0.05, Random(3, "noise")));
  const CloudError error = MeasureCloud(cloud, truth);
  ASSERT_EQ(error.distance_m.size(), cloud.size());
  double squares = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const double expected = NearestByBruteForce(truth, error.X_truth_cloud * cloud[i]);
    EXPECT_NEAR(error.distance_m[i], expected, 1e-6);
    squares += expected * expected;
  }
  EXPECT_NEAR(error.rmse_m, std::sqrt(squares / static_cast<double>(cloud.size())), 1e-6);
}

TEST(MeasureCloudTest, UndoesASmallMotion) {
  Random random(4, "cloud");
  for (int i = 0; i < 5; ++i) {
    const Pose3 X = RandomMotion(Twist(0.1, 0.1, 0.05, 0.01, 0.01, 0.03), random);
    const auto truth = Room(i);
    const CloudError error = MeasureCloud(Transformed(X.inverse(), truth), truth);
    EXPECT_LT(Log(Ominus(X, error.X_truth_cloud)).norm(), 0.01) << i;
    EXPECT_LT(error.rmse_m, 0.01);
  }
}

// Around the middle of the cloud: no translation tells that the alignment goes on.
TEST(MeasureCloudTest, UndoesATurnAroundTheMiddle) {
  std::vector<Vec3> truth;
  Random random(5, "cloud");
  for (int i = 0; i < 3000; ++i) {
    const Vec3 p(random.Uniform(-3, 3), random.Uniform(-1, 1), 0);
    truth.push_back(p);
    truth.push_back(-p);
  }
  const Pose3 X = MakePose(Vec3::Zero(), {0, 0, 0.06});
  const CloudError error = MeasureCloud(Transformed(X.inverse(), truth), truth);
  EXPECT_LT(std::abs(YawOf(error.X_truth_cloud) - 0.06), 0.005);
}

TEST(MeasureCloudTest, OfItselfIsNothing) {
  const auto truth = Room(6);
  const CloudError error = MeasureCloud(truth, truth);
  EXPECT_LT(error.rmse_m, 1e-9);
  EXPECT_TRUE(error.X_truth_cloud.isApprox(Pose3::Identity(), 1e-9));
}

TEST(MeasureCloudTest, SeesNoiseAtItsSize) {
  const auto truth = Room(7, 0.02);
  const auto cloud = WithNoise(Room(8, 0.1), 0.05, Random(9, "noise"));
  // Across the surface alone: along it there is always a neighbour.
  EXPECT_NEAR(MeasureCloud(cloud, truth).rmse_m, 0.05, 0.008);
}

TEST(MeasureCloudTest, IsTheSameForAnyNumberOfThreads) {
  const auto truth = Room(1);
  const auto cloud = WithNoise(Room(2), 0.05, Random(3, "noise"));
  SetParallelThreads(1);
  const CloudError one = MeasureCloud(cloud, truth);
  SetParallelThreads(3);
  const CloudError three = MeasureCloud(cloud, truth);
  SetParallelThreads(0);
  EXPECT_EQ(one.rmse_m, three.rmse_m);
  EXPECT_EQ(one.distance_m, three.distance_m);
  EXPECT_EQ(one.X_truth_cloud.matrix(), three.X_truth_cloud.matrix());
}

TEST(DownsampleTest, KeepsTheFirstPointOfEachCell) {
  Random random(10, "downsample");
  std::vector<Vec3> points, expected;
  for (int i = 0; i < 5000; ++i) points.push_back(random.GaussianVector(Vec3::Ones()));
  std::set<std::tuple<double, double, double>> cells;
  for (const Vec3& p : points) {
    const auto cell = [](double x) { return std::floor(x / 0.5); };
    if (cells.emplace(cell(p.x()), cell(p.y()), cell(p.z())).second) expected.push_back(p);
  }
  EXPECT_EQ(Downsample(points, 0.5), expected);
  EXPECT_TRUE(Downsample({}, 0.5).empty());
}

}  // namespace
}  // namespace vog
