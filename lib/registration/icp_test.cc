#include "lib/registration/icp.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <map>
#include <numbers>

#include "lib/geometry/voxel_grid.h"
#include "lib/registration/clouds_testing.h"

namespace vog {
namespace {

constexpr double kSpacing_m = 0.1, kRadius_m = 0.3;

IcpOptions Options(IcpFreedom freedom = IcpFreedom::kPlanar) {
  IcpOptions options;
  options.freedom = freedom;
  return options;
}

/// Two samplings of one structure: the target in its own frame, the source seen from X_ik.
struct Pair {
  Pair(const std::vector<Rectangle>& structure, const Pose3& X_ik, double sigma_m = 0, int seed = 1)
      : Pair(SampleRectangles(structure, kSpacing_m, Random(seed, "target")),
             SampleRectangles(structure, kSpacing_m, Random(seed, "source")), X_ik, sigma_m, seed) {
  }
  Pair(const std::vector<Vec3>& target_i, const std::vector<Vec3>& source_i, const Pose3& X_ik,
       double sigma_m, int seed)
      : X_ik(X_ik),
        target(WithNoise(target_i, sigma_m, Random(seed, "target noise")), kRadius_m, Vec3::Zero()),
        source(Transformed(X_ik.inverse(), WithNoise(source_i, sigma_m, Random(seed, "noise"))),
               kRadius_m, X_ik.inverse().translation()) {}

  Vec6 ErrorOf(const IcpResult& result) const { return Log(Ominus(X_ik, result.X_ik)); }

  Pose3 X_ik;
  RegistrationCloud target, source;
};

std::vector<Rectangle> CornerBoxAndFloor() {
  std::vector<Rectangle> structure = CornerWithBox();
  structure.push_back(Floor());
  return structure;
}

const Rectangle kWall = {{2, -2, -1.5}, {0, 4, 0}, {0, 0, 3}};
const std::vector<Rectangle> kCorridor = {{{2, -4, -1}, {0, 8, 0}, {0, 0, 2}},
                                          {{-2, -4, -1}, {0, 8, 0}, {0, 0, 2}}};
const Vec3 kPillar(2, 1, 0);

/// The near half of an upright cylinder around kPillar.
std::vector<Vec3> SamplePillar(Random random) {
  std::vector<Vec3> points;
  for (int i = 0; i < 800; ++i) {
    const double angle = std::numbers::pi + std::atan2(1, 2) + random.Uniform(-1.4, 1.4);
    points.push_back(kPillar + Vec3(std::cos(angle), std::sin(angle), random.Uniform(-1, 1)));
  }
  return points;
}

TEST(IcpTest, RecoversRandomPlanarMotions) {
  Random random(1, "icp");
  for (int i = 0; i < 20; ++i) {
    const Pose3 X_ik = RandomMotion(Twist(0.6, 0.6, 0, 0, 0, 0.3), random);
    const Pair pair(CornerWithBox(), X_ik, 0.02, i);
    const Pose3 initial = X_ik * RandomMotion(Twist(0.35, 0.35, 0, 0, 0, 0.1), random);
    const IcpResult result = Register(Options(), pair.target, pair.source, initial);
    ASSERT_TRUE(result.usable);
    EXPECT_EQ(result.degenerate_directions, 0);
    EXPECT_LT(pair.ErrorOf(result).head<3>().norm(), 0.03) << i;
    EXPECT_LT(pair.ErrorOf(result).tail<3>().norm(), 0.01) << i;
    EXPECT_GT(result.overlap, 0.8);
    EXPECT_NEAR(result.rmse_m, 0.03, 0.02);
  }
}

TEST(IcpTest, RecoversRandomFullMotions) {
  Random random(2, "icp");
  for (int i = 0; i < 10; ++i) {
    const Pose3 X_ik = RandomMotion(Twist(0.6, 0.6, 0.3, 0.1, 0.1, 0.3), random);
    const Pair pair(CornerBoxAndFloor(), X_ik, 0.02, i);
    const Pose3 initial = X_ik * RandomMotion(Twist(0.3, 0.3, 0.2, 0.05, 0.05, 0.1), random);
    const IcpResult result =
        Register(Options(IcpFreedom::kFull), pair.target, pair.source, initial);
    ASSERT_TRUE(result.usable);
    EXPECT_EQ(result.degenerate_directions, 0);
    EXPECT_LT(pair.ErrorOf(result).head<3>().norm(), 0.03) << i;
    EXPECT_LT(pair.ErrorOf(result).tail<3>().norm(), 0.01) << i;
  }
}

TEST(IcpTest, PlanarFreedomLeavesHeightAndTiltAlone) {
  Random random(3, "icp");
  const Pose3 X_ik = RandomMotion(Twist(0.3, 0.3, 0.1, 0.05, 0.05, 0.2), random);
  const Pair pair(CornerBoxAndFloor(), X_ik);
  const Pose3 initial = X_ik * Exp(Twist(0.2, -0.1, 0.04, 0.01, -0.02, 0.05));
  const IcpResult result = Register(Options(), pair.target, pair.source, initial);
  const Vec6 moved = Log(Ominus(initial, result.X_ik));
  EXPECT_LT(Vec3(moved[2], moved[3], moved[4]).norm(), 0.02);
  EXPECT_GT(moved.head<2>().norm(), 0.1);
}

TEST(IcpTest, IsGivenNoLevelGroundWhereNothingMovesUpOrTilts) {
  const double sigma_m = 0.02;
  const auto cloud = [&](const Rectangle& rectangle, IcpFreedom freedom) {
    const Random random(6, "cloud");
    return CloudFor(Options(freedom),
                    WithNoise(SampleRectangles({rectangle}, kSpacing_m, random), sigma_m, random),
                    Vec3::Zero())
        .size();
  };
  constexpr double kSide_m = 5;
  constexpr std::size_t kCount = 2500;
  for (const double slope_deg : {0, 2, 30, 90}) {
    const double slope_rad = slope_deg * std::numbers::pi / 180;
    const Rectangle surface{
        {2, 1, -1}, {0, kSide_m, 0}, kSide_m * Vec3(std::cos(slope_rad), 0, std::sin(slope_rad))};
    const auto kept = cloud(surface, IcpFreedom::kPlanar);
    if (slope_deg < 5)
      EXPECT_LT(kept, kCount / 20) << slope_deg;
    else
      EXPECT_GT(kept, kCount - kCount / 50) << slope_deg;
    EXPECT_EQ(cloud(surface, IcpFreedom::kFull), kCount) << slope_deg;
  }
}

TEST(IcpTest, BackwardsIsTheInverse) {
  Random random(4, "icp");
  const Pose3 X_ik = RandomMotion(Twist(0.5, 0.5, 0, 0, 0, 0.3), random);
  const Pair pair(CornerWithBox(), X_ik, 0.01);
  const Pose3 initial = X_ik * Exp(Twist(0.2, 0.1, 0, 0, 0, -0.08));
  const IcpResult forward = Register(Options(), pair.target, pair.source, initial);
  const IcpResult backward = Register(Options(), pair.source, pair.target, initial.inverse());
  EXPECT_LT(Log(forward.X_ik * backward.X_ik).norm(), 0.02);
}

TEST(IcpTest, DoesNotCareWhereTheTargetsFrameIs) {
  Random random(5, "icp");
  const Pose3 X_ik = RandomMotion(Twist(0.5, 0.5, 0, 0, 0, 0.3), random);
  const Pose3 X_ji = MakePose({20, -10, 3}, {0, 0, 2});
  const auto target = SampleRectangles(CornerWithBox(), kSpacing_m, Random(1, "a"));
  const auto source = SampleRectangles(CornerWithBox(), kSpacing_m, Random(1, "b"));
  const Pair here(target, source, X_ik, 0, 1);
  const RegistrationCloud there(Transformed(X_ji, target), kRadius_m, X_ji.translation());
  const Pose3 initial = X_ik * Exp(Twist(0.2, 0.1, 0, 0, 0, -0.08));
  const IcpResult a = Register(Options(), here.target, here.source, initial);
  const IcpResult b = Register(Options(), there, here.source, X_ji * initial);
  EXPECT_LT(Log(Ominus(X_ji * a.X_ik, b.X_ik)).norm(), 1e-6);
  EXPECT_LT((a.covariance - b.covariance).norm(), 1e-6 * a.covariance.norm());
}

/// A structure, and the motions in (x, y, z, roll, pitch, yaw) of a body at the origin that leave
/// what is seen of it unchanged.
struct Degenerate {
  const char* name;
  IcpFreedom freedom;
  std::vector<Vec3> (*sample)(Random random);
  std::vector<Vec6> unseen;
};

class DegenerateIcpTest : public testing::TestWithParam<Degenerate> {};

TEST_P(DegenerateIcpTest, IsReportedAndNotMovedAlong) {
  const Degenerate& p = GetParam();
  const int free = p.freedom == IcpFreedom::kPlanar ? 3 : 6;
  const Pair pair(p.sample(Random(1, "target")), p.sample(Random(1, "source")), Pose3::Identity(),
                  0.005, 1);
  const Pose3 initial =
      Exp(p.freedom == IcpFreedom::kPlanar ? Twist(0.15, 0.12, 0, 0, 0, 0.06)
                                           : Twist(0.15, 0.12, 0.1, 0.03, 0.04, 0.05));
  const IcpResult result = Register(Options(p.freedom), pair.target, pair.source, initial);
  ASSERT_TRUE(result.usable);
  const int unseen = static_cast<int>(p.unseen.size());
  EXPECT_EQ(result.degenerate_directions, unseen);
  ASSERT_EQ(result.basis.cols(), free - unseen);
  EXPECT_TRUE((result.basis.transpose() * result.basis).isIdentity(1e-9));
  const Vec6 moved = Log(Ominus(initial, result.X_ik));
  for (const Vec6& xi : p.unseen) {
    EXPECT_LT((result.basis.transpose() * xi.normalized()).norm(), 0.08);
    // Of no less variance than what nothing is known of.
    EXPECT_GT(xi.normalized().dot(result.covariance * xi.normalized()), 1e3);
  }
  // What was seen is corrected.
  EXPECT_GT(moved.norm(), 0.05);
  EXPECT_LT((result.basis.transpose() * Log(result.X_ik)).norm(), 0.03);
  // The rest stays: with all motions that are unseen, in the metric of the registration.
  Eigen::MatrixXd N(6, unseen);
  for (int i = 0; i < unseen; ++i) N.col(i) = p.unseen[i];
  double squares = 0;
  for (const Vec3& point : pair.source.points()) squares += point.squaredNorm();
  Vec6 scale = Vec6::Ones();
  scale.tail<3>() *= std::sqrt(squares / static_cast<double>(pair.source.size()));
  const Eigen::MatrixXd scaled = scale.asDiagonal() * N;
  const Eigen::MatrixXd Q =
      scaled.householderQr().householderQ() * Eigen::MatrixXd::Identity(6, unseen);
  EXPECT_LT((Q.transpose() * scale.asDiagonal() * moved).norm(), 0.02);
}

INSTANTIATE_TEST_SUITE_P(
    Structures, DegenerateIcpTest,
    testing::Values(
        Degenerate{"Wall",
                   IcpFreedom::kPlanar,
                   [](Random random) { return SampleRectangles({kWall}, kSpacing_m, random); },
                   {Vec6::Unit(1)}},
        Degenerate{"Corridor",
                   IcpFreedom::kPlanar,
                   [](Random random) { return SampleRectangles(kCorridor, kSpacing_m, random); },
                   {Vec6::Unit(1)}},
        // A turn around the pillar's axis.
        Degenerate{"Pillar",
                   IcpFreedom::kPlanar,
                   SamplePillar,
                   {Twist(kPillar.y(), -kPillar.x(), 0, 0, 0, 1)}},
        Degenerate{"WallFull",
                   IcpFreedom::kFull,
                   [](Random random) { return SampleRectangles({kWall}, kSpacing_m, random); },
                   // Along the wall, and turns around its normal.
                   {Vec6::Unit(1), Vec6::Unit(2), Vec6::Unit(3)}},
        Degenerate{"CorridorFull",
                   IcpFreedom::kFull,
                   [](Random random) { return SampleRectangles(kCorridor, kSpacing_m, random); },
                   {Vec6::Unit(1), Vec6::Unit(2), Vec6::Unit(3)}}),
    [](const auto& info) { return info.param.name; });

// Sums over all correspondences, found one by one, with numeric derivatives.
TEST(IcpTest, CovarianceIsThatOfTheBruteForceSums) {
  const Pose3 X_ik = Exp(Twist(0.3, -0.2, 0, 0, 0, 0.4));
  const Pair pair(CornerWithBox(), X_ik, 0.02);
  const IcpOptions options = Options();
  const IcpResult result = Register(options, pair.target, pair.source, X_ik);
  ASSERT_EQ(result.degenerate_directions, 0);
  const std::vector<Vec3>& source = pair.source.points();
  const int used = std::min<int>(options.max_points, static_cast<int>(source.size()));
  struct Patch {
    Vec3 row = Vec3::Zero();
    double residual = 0;
    int count = 0;
  };
  std::map<VoxelKey, Patch> cells, columns;
  Mat3 H = Mat3::Zero();
  double squares = 0;
  int count = 0;
  for (int u = 0; u < used; ++u) {
    const std::size_t s = static_cast<std::size_t>(u) * source.size() / used;
    const Vec3 p_i = result.X_ik * source[s];
    std::size_t best = 0;
    for (std::size_t t = 0; t < pair.target.size(); ++t)
      if ((pair.target.points()[t] - p_i).norm() < (pair.target.points()[best] - p_i).norm())
        best = t;
    const Vec3 normal = pair.target.planes()[best].normal;
    if ((pair.target.points()[best] - p_i).norm() > options.end_distance_m || normal.isZero() ||
        normal.dot(result.X_ik.linear() * pair.source.planes()[s].normal) <
            options.min_normal_cosine)
      continue;
    const double residual = normal.dot(p_i - pair.target.points()[best]);
    Vec3 J;  // By x, y and yaw on the right.
    for (int i = 0; i < 3; ++i) {
      const Vec6 step = 1e-6 * Vec6::Unit(i < 2 ? i : 5);
      J[i] = (normal.dot(result.X_ik * Exp(step) * source[s] - pair.target.points()[best]) -
              residual) /
             1e-6;
    }
    H += J * J.transpose();
    squares += residual * residual;
    ++count;
    const VoxelKey cell = VoxelGrid(options.correlation_m).KeyOf(p_i);
    for (Patch* patch : {&cells[cell], &columns[{cell.x, cell.y, 0}]}) {
      patch->row += J;
      patch->residual += residual;
      ++patch->count;
    }
  }
  EXPECT_NEAR(result.correspondences, count, 0.02 * count);
  EXPECT_NEAR(result.overlap, count / static_cast<double>(used), 0.02);
  EXPECT_NEAR(result.rmse_m, std::sqrt(squares / count), 0.005);
  Mat3 M = options.point_sigma_m * options.point_sigma_m * H;
  for (const auto* patches : {&cells, &columns}) {
    Mat3 rows = Mat3::Zero();
    double shared = 0;
    for (const auto& [key, patch] : *patches) {
      rows += patch.row * patch.row.transpose();
      shared += patch.residual * patch.residual / patch.count;
    }
    const auto n = static_cast<double>(patches->size());
    const double least = patches == &cells ? options.least_shared_error_m : 0;
    M += std::max(least * least, shared / count * n / (n - 3)) * rows;
  }
  const Mat3 expected = H.inverse() * M * H.inverse();
  Mat3 found;
  constexpr int kIndex[3] = {0, 1, 5};
  for (int row = 0; row < 3; ++row)
    for (int col = 0; col < 3; ++col) found(row, col) = result.covariance(kIndex[row], kIndex[col]);
  EXPECT_LT((found - expected).norm(), 0.05 * expected.norm());
}

// One shared error says nothing of the second direction.
TEST(IcpTest, CovarianceIsPositiveDefiniteWhereAllIsOnePatch) {
  const std::vector<Rectangle> corner = {{{2.45, 1.85, -0.2}, {0, 0.5, 0}, {0, 0, 1}},
                                         {{2.45, 1.85, -0.2}, {0.5, 0, 0}, {0, 0, 1}}};
  const auto sample = [&](const char* name) {
    return SampleRectangles(corner, 0.02, Random(1, name));
  };
  const Pair pair(sample("target"), sample("source"), Pose3::Identity(), 0.001, 1);
  IcpOptions options = Options();
  options.correlation_m = 20;
  const IcpResult result = Register(options, pair.target, pair.source, Pose3::Identity());
  ASSERT_TRUE(result.usable);
  ASSERT_GE(result.basis.cols(), 2);
  const Eigen::MatrixXd measured = result.basis.transpose() * result.covariance * result.basis;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(measured);
  EXPECT_GT(solver.eigenvalues()[0], 1e-8);
}

TEST(IcpTest, ErrorsAreNotLargerThanTheCovarianceSays) {
  Random random(6, "icp");
  double normalised = 0;
  constexpr int kRuns = 20;
  for (int i = 0; i < kRuns; ++i) {
    const Pair pair(CornerWithBox(), Exp(Twist(0.3, -0.2, 0, 0, 0, 0.4)), 0.03, i);
    const Pose3 initial = pair.X_ik * RandomMotion(Twist(0.1, 0.1, 0, 0, 0, 0.05), random);
    const IcpResult result = Register(Options(), pair.target, pair.source, initial);
    const Vec6 error = pair.ErrorOf(result);
    const Eigen::VectorXd seen = result.basis.transpose() * error;
    const Eigen::MatrixXd P = result.basis.transpose() * result.covariance * result.basis;
    normalised += seen.dot(P.inverse() * seen) / 3 / kRuns;
  }
  EXPECT_LT(normalised, 1);
  EXPECT_GT(normalised, 0.001);
}

TEST(IcpTest, OverlapIsTheShareOfTheSourceThatHasAPartner) {
  const auto target =
      SampleRectangles({CornerWithBox()[0], CornerWithBox()[1]}, kSpacing_m, Random(1, "a"));
  auto source =
      SampleRectangles({CornerWithBox()[0], CornerWithBox()[1]}, kSpacing_m, Random(1, "b"));
  const auto elsewhere =
      SampleRectangles({{{-8, -3, -1}, {0, 12, 0}, {0, 0, 2}}}, kSpacing_m, Random(1, "c"));
  source.insert(source.end(), elsewhere.begin(), elsewhere.end());
  const Pair pair(target, source, Pose3::Identity(), 0, 1);
  for (const int iterations : {1, Options().iterations}) {
    IcpOptions options = Options();
    options.iterations = iterations;
    const IcpResult result = Register(options, pair.target, pair.source, Pose3::Identity());
    ASSERT_TRUE(result.usable);
    EXPECT_NEAR(result.overlap, 0.5, 0.05) << iterations;
  }
}

TEST(IcpTest, DoesNotPutAWallOnItsOwnBack) {
  const auto points =
      SampleRectangles({CornerWithBox()[0], CornerWithBox()[1]}, kSpacing_m, Random(1, "a"));
  const RegistrationCloud front(points, kRadius_m, Vec3::Zero());
  const RegistrationCloud back(points, kRadius_m, Vec3(50, 40, 0));
  EXPECT_FALSE(Register(Options(), front, back, Pose3::Identity()).usable);
  EXPECT_TRUE(Register(Options(), front, front, Pose3::Identity()).usable);
}

TEST(IcpTest, SaysWhenThereIsNothingToRegister) {
  const Pair pair(CornerWithBox(), Pose3::Identity());
  const RegistrationCloud empty({}, kRadius_m, Vec3::Zero());
  const RegistrationCloud few({{1, 1, 1}, {1, 2, 1}, {2, 2, 1}}, kRadius_m, Vec3::Zero());
  const Pose3 far = MakePose({100, 0, 0});
  for (const RegistrationCloud* cloud : {&empty, &few}) {
    const IcpResult a = Register(Options(), pair.target, *cloud, far);
    const IcpResult b = Register(Options(), *cloud, pair.source, far);
    EXPECT_FALSE(a.usable);
    EXPECT_FALSE(b.usable);
    EXPECT_EQ(a.X_ik.matrix(), far.matrix());
  }
  const IcpResult apart = Register(Options(), pair.target, pair.source, far);
  EXPECT_FALSE(apart.usable);
  EXPECT_EQ(apart.X_ik.matrix(), far.matrix());
}

TEST(IcpTest, GivesTheSameBitsEachTime) {
  const Pair pair(CornerWithBox(), Exp(Twist(0.3, -0.2, 0, 0, 0, 0.4)), 0.02);
  const IcpResult a = Register(Options(), pair.target, pair.source, Pose3::Identity());
  const IcpResult b = Register(Options(), pair.target, pair.source, Pose3::Identity());
  EXPECT_EQ(a.X_ik.matrix(), b.X_ik.matrix());
  EXPECT_EQ(a.covariance, b.covariance);
}

}  // namespace
}  // namespace vog
