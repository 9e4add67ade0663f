#include "lib/posegraph/robust_closures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "lib/posegraph/garage_testing.h"

namespace vog {
namespace {

double RmseOfPositions(const PoseGraph& a, const PoseGraph& b) {
  double sum = 0;
  for (const auto& [id, X_W] : a.nodes())
    sum += (X_W.translation() - b.X_W(id).translation()).squaredNorm();
  return std::sqrt(sum / static_cast<double>(a.nodes().size()));
}

constexpr int kRight = 100;

/// A garage with right closures and as many wrong ones as make `share` of all; solved robustly, and
/// plainly without the wrong ones.
struct Outcome {
  int right_kept = 0, wrong_kept = 0;
  double rmse_m = 0;
};

Outcome Run(double share, int seed, double pessimism) {
  Garage garage(5, static_cast<std::uint64_t>(seed));
  PoseGraph clean = garage.Odometry(pessimism);
  std::set<int> right;
  for (int i = 0; i < kRight; ++i) right.insert(clean.AddConstraint(garage.RightClosure()));
  PoseGraph dut = clean;
  const int wrong = static_cast<int>(std::lround(kRight * share / (1 - share)));
  for (int i = 0; i < wrong; ++i) dut.AddConstraint(garage.WrongClosure());
  EXPECT_TRUE(clean.Solve().usable);
  const RobustSummary summary = SolveRobustly(dut);
  EXPECT_TRUE(summary.solve.usable);
  Outcome outcome{kRight, wrong, RmseOfPositions(clean, dut)};
  for (const int number : summary.rejected)
    --(right.count(number) > 0 ? outcome.right_kept : outcome.wrong_kept);
  return outcome;
}

void ExpectOnlyRightClosures(double pessimism) {
  for (const double share : {0.0, 0.1, 0.5, 0.8}) {
    for (int seed = 1; seed <= 4; ++seed) {
      const Outcome outcome = Run(share, seed, pessimism);
      EXPECT_EQ(outcome.wrong_kept, 0) << share << " " << seed;
      // The gate takes one in a hundred, and closures that share odometry share its luck.
      EXPECT_GE(outcome.right_kept, 0.94 * kRight) << share << " " << seed;
      EXPECT_LT(outcome.rmse_m, 0.1) << share << " " << seed;
    }
  }
}

TEST(RobustClosuresTest, KeepsTheRightOnesAlone) { ExpectOnlyRightClosures(1); }

TEST(RobustClosuresTest, SeesThroughCovariancesThatAreFarTooLarge) { ExpectOnlyRightClosures(1e4); }

TEST(RobustClosuresTest, OfNoClosuresIsOdometry) {
  Garage garage(1, 1);
  PoseGraph dut = garage.Odometry();
  const std::map<NodeId, Pose3> odometry = dut.nodes();
  for (const auto& [id, X_W] : odometry)
    if (id != 0) dut.SetPose(id, MakePose({5, 5, 5}));
  EXPECT_TRUE(SolveRobustly(dut).rejected.empty());
  for (const auto& [id, X_W] : odometry) EXPECT_TRUE(dut.X_W(id).isApprox(X_W, 1e-6));
}

TEST(RobustClosuresTest, TakesGapsInOdometryAsTheyAre) {
  const Whitening W = WhiteningOf(0.01 * Mat6::Identity());
  PoseGraph dut({});
  for (const NodeId id : {0, 1, 5, 6}) dut.AddNode(id, MakePose({1.0 * id, 0, 0}));
  dut.AddConstraint({0, 1, ConstraintKind::kOdometry, MakePose({1, 0, 0}), W});
  dut.AddConstraint({6, 5, ConstraintKind::kOdometry, MakePose({-1, 0, 0}), W});
  dut.AddConstraint({0, 5, ConstraintKind::kFullClosure, MakePose({5, 0, 0}), W});
  dut.AddConstraint({1, 6, ConstraintKind::kFullClosure, MakePose({5, 0, 0}), W});
  EXPECT_TRUE(SolveRobustly(dut).rejected.empty());
  EXPECT_NEAR(dut.X_W(6).translation().x(), 6, 1e-6);
}

}  // namespace
}  // namespace vog
