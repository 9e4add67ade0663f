#include "lib/slam/revisits.h"

#include <gtest/gtest.h>

#include <cmath>

#include "lib/base/random.h"
#include "lib/geometry/odometry.h"

namespace vog {
namespace {

constexpr double kBody_m2 = 0.01;

Mat6 PlanarCovariance(double sigma_m, double sigma_yaw_rad) {
  Mat6 covariance = Mat6::Zero();
  covariance.diagonal() << sigma_m * sigma_m, sigma_m * sigma_m, 1e-6, 1e-8, 1e-8,
      sigma_yaw_rad * sigma_yaw_rad;
  return covariance;
}

void Join(PoseGraph& graph, NodeId i, NodeId k, ConstraintKind kind, const Mat6& covariance) {
  graph.AddConstraint({i, k, kind, Ominus(graph.X_W(i), graph.X_W(k)), WhiteningOf(covariance)});
}

/// A walk with some closures, at its own solution.
PoseGraph Walk(int seed, int count) {
  Random random(static_cast<std::uint64_t>(seed), "walk");
  PoseGraph graph{PoseGraphOptions{}};
  Pose3 X_W = Pose3::Identity();
  for (NodeId id = 0; id < count; ++id) {
    graph.AddNode(id, X_W);
    graph.SetPrior(id, {0, 0, 0, 0.02, 0.005});
    X_W = X_W *
          MakePose({random.Uniform(0, 3), random.Uniform(-1, 1), 0}, {0, 0, random.Uniform(-1, 1)});
    if (id > 0) Join(graph, id - 1, id, ConstraintKind::kOdometry, PlanarCovariance(0.08, 0.001));
    if (id > 5 && random.Index(6) == 0)
      Join(graph, id - 5, id, ConstraintKind::kFullClosure, PlanarCovariance(0.05, 0.01));
  }
  return graph;
}

double MeanSigma(const PoseGraph& graph, int count) {
  double sum_m = 0;
  for (NodeId k = 0; k < count; ++k)
    sum_m +=
        std::sqrt(graph.RelativeCovariances({{0, k}})[0].topLeftCorner<2, 2>().trace() + kBody_m2);
  return sum_m / count;
}

/// What the closure does: it is made.
double Gain(PoseGraph graph, NodeId target, const Mat6& closure) {
  const int count = static_cast<int>(graph.nodes().size());
  const double before_m = MeanSigma(graph, count);
  graph.AddNode(count, graph.X_W(target));
  Join(graph, count - 1, count, ConstraintKind::kOdometry, PlanarCovariance(1e-4, 1e-6));
  Join(graph, target, count, ConstraintKind::kFullClosure, closure);
  return 1 - MeanSigma(graph, count) / before_m;
}

TEST(RevisitsTest, TellWhatAClosureDoesWhenItIsMade) {
  constexpr int kCount = 12;  // All are in the sample.
  double most = 0;
  for (int seed = 1; seed <= 8; ++seed) {
    const PoseGraph graph = Walk(seed, kCount);
    const Mat6 closure = PlanarCovariance(0.02 * seed, 0.01);
    std::map<SubmapId, Mat3> targets;
    for (NodeId id = 0; id < kCount; ++id) targets[id] = PlanarOf(closure).inverse();
    const auto gains = ExpectRevisits(graph, targets, kBody_m2);
    EXPECT_EQ(gains.count(kCount - 1), 0u) << "it is there";
    EXPECT_GE(gains.size(), 1u);
    for (const auto& [id, gain] : gains) {
      EXPECT_NEAR(gain, Gain(graph, id, closure), 0.02 + 0.1 * gain) << seed << " " << id;
      most = std::max(most, gain);
    }
  }
  EXPECT_GT(most, 0.2);
}

TEST(RevisitsTest, AskOfAPartOfALongWalk) {
  const PoseGraph graph = Walk(2, 200);
  const Mat6 closure = PlanarCovariance(0.03, 0.01);
  const auto revisits = ExpectRevisits(graph, {{3, PlanarOf(closure).inverse()}}, kBody_m2);
  ASSERT_EQ(revisits.size(), 1u);
  // Over so long a way headings matter, too.
  EXPECT_NEAR(revisits.at(3), Gain(graph, 3, closure), 0.1);
}

TEST(RevisitsTest, GainNothingWithoutInformationNorWhatNothingReduces) {
  const PoseGraph graph = Walk(3, 11);
  const Mat3 information = PlanarOf(PlanarCovariance(0.03, 0.01)).inverse();
  EXPECT_TRUE(ExpectRevisits(graph, {}, 0).empty());
  EXPECT_TRUE(ExpectRevisits(graph, {{0, Mat3::Zero()}}, 0).empty());
  EXPECT_TRUE(ExpectRevisits(graph, {{0, information}}, 1e4).empty());
  EXPECT_FALSE(ExpectRevisits(graph, {{0, information}}, 0).empty());
  EXPECT_TRUE(ExpectRevisits(Walk(3, 1), {{0, information}}, 0).empty());
}

// A closure that holds one direction only.
TEST(RevisitsTest, GainLessByPartialClosures) {
  const PoseGraph graph = Walk(4, 12);
  const Mat3 full = PlanarOf(PlanarCovariance(0.03, 0.01)).inverse();
  Mat3 partial = Mat3::Zero();
  partial(0, 0) = full(0, 0);
  const auto gain = [&](const Mat3& information) {
    return ExpectRevisits(graph, {{0, information}}, kBody_m2).at(0);
  };
  EXPECT_LT(gain(partial), 0.8 * gain(full));
  EXPECT_GT(gain(partial), 0.1 * gain(full));
}

}  // namespace
}  // namespace vog
