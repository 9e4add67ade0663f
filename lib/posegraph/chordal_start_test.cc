#include "lib/posegraph/chordal_start.h"

#include <gtest/gtest.h>

#include "lib/posegraph/garage_testing.h"

namespace vog {
namespace {

PoseGraph GarageWithClosures(std::uint64_t seed) {
  Garage garage(3, seed);
  PoseGraph graph = garage.Odometry();
  for (int i = 0; i < 60; ++i) graph.AddConstraint(garage.RightClosure());
  return graph;
}

TEST(ChordalStartTest, NeedsNoGuessAndIsNearTheOptimum) {
  PoseGraph reference = GarageWithClosures(1), dut = reference;
  ASSERT_TRUE(reference.Solve().usable);
  for (const auto& [id, X_W] : reference.nodes())
    if (id != 0) dut.SetPose(id, Pose3::Identity());
  StartFromTheBetter(dut);
  for (const auto& [id, X_W] : reference.nodes())
    EXPECT_LT((X_W.translation() - dut.X_W(id).translation()).norm(), 0.2) << id;
  EXPECT_NEAR(dut.Solve().final_cost, reference.Cost(), 1e-4 * reference.Cost());
}

TEST(ChordalStartTest, LeavesABetterStartAlone) {
  PoseGraph dut = GarageWithClosures(2);
  ASSERT_TRUE(dut.Solve().usable);
  const std::map<NodeId, Pose3> solved = dut.nodes();
  StartFromTheBetter(dut);
  for (const auto& [id, X_W] : solved) EXPECT_EQ(X_W.matrix(), dut.X_W(id).matrix());
}

TEST(ChordalStartTest, IsExactWithoutNoiseAndKeepsFixedNodes) {
  const Pose3 X_01 = MakePose({1, 2, 3}, {0.3, -0.4, 2}), X_12 = MakePose({3, 0, -1}, {2, 0.1, 1});
  const Whitening W = WhiteningOf(Mat6::Identity());
  PoseGraph graph({});
  graph.AddNode(0, MakePose({7, 8, 9}, {0.1, 0.2, -1}));
  graph.AddNode(1, Pose3::Identity());
  graph.AddNode(2, graph.X_W(0) * X_01 * X_12);
  graph.Fix(2);
  graph.AddConstraint({1, 0, ConstraintKind::kOdometry, X_01.inverse(), W});
  graph.AddConstraint({1, 2, ConstraintKind::kOdometry, X_12, W});
  const auto start = ChordalStart(graph);
  ASSERT_TRUE(start);
  EXPECT_TRUE(start->at(1).isApprox(graph.X_W(0) * X_01, 1e-9));
  EXPECT_EQ(start->at(2).matrix(), graph.X_W(2).matrix());
}

TEST(ChordalStartTest, IsNothingWhenAPoseIsFree) {
  PoseGraph graph({});
  graph.AddNode(0, Pose3::Identity());
  graph.AddNode(1, Pose3::Identity());
  EXPECT_FALSE(ChordalStart(graph));
}

}  // namespace
}  // namespace vog
