// What a pose graph answers must not depend on how it came to be what it is: each answer of a graph
// with a history is compared with that of a graph made anew.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "lib/base/random.h"
#include "lib/posegraph/pose_graph.h"

namespace vog {
namespace {

/// A vehicle that circles, so that each place is passed again and again, as a graph that grows.
class History {
 public:
  explicit History(std::uint64_t seed)
      : random_(seed, "history"), dut_(PoseGraphOptions{200, 1e-8}) {
    dut_.AddNode(0, TruthOf(0));
  }

  PoseGraph& dut() { return dut_; }

  /// The same graph without a past, at the same poses.
  PoseGraph Anew() const {
    PoseGraph anew({200, 1e-14});
    for (const auto& [id, X_W] : dut_.nodes()) anew.AddNode(id, X_W);
    for (const auto& [number, constraint] : dut_.constraints()) anew.AddConstraint(constraint);
    for (const auto& [id, prior] : priors_) anew.SetPrior(id, prior);
    for (const NodeId id : fixed_) anew.Fix(id);
    return anew;
  }

  int size() const { return static_cast<int>(dut_.nodes().size()); }

  void AddNode(bool has_prior) {
    const int id = size();
    const Constraint step = Measure(id - 1, id, ConstraintKind::kOdometry, 1);
    dut_.AddNode(id, dut_.X_W(id - 1) * step.X_ik);
    if (has_prior) {
      priors_[id] = PriorOf(id);
      dut_.SetPrior(id, priors_[id]);
    }
    dut_.AddConstraint(step);
  }

  void AddClosure(double doubt = 1) {
    const int k = random_.Index(size());
    const int i = random_.Chance(0.7) && k >= kRound ? k - kRound : random_.Index(size());
    if (i == k) return;
    Constraint closure = Measure(i, k, ConstraintKind::kFullClosure, doubt);
    if (random_.Chance(0.3)) {
      closure.kind = ConstraintKind::kPartialClosure;
      closure.whitening = closure.whitening.topRows(1 + random_.Index(5)).eval();
    }
    closures_.push_back(dut_.AddConstraint(closure));
  }

  void RemoveClosure() {
    if (closures_.empty()) return;
    const auto at = random_.Index(static_cast<int>(closures_.size()));
    dut_.RemoveConstraint(closures_[static_cast<std::size_t>(at)]);
    closures_.erase(closures_.begin() + at);
  }

  /// One of the things that may happen to a graph.
  void Happen() {
    const double what = random_.Uniform(0, 1);
    if (what < 0.45) return AddNode(random_.Chance(0.5));
    if (what < 0.75) return AddClosure();
    if (what < 0.93) return RemoveClosure();
    const int id = random_.Index(size());
    if (what < 0.96) {
      priors_[id] = PriorOf(id);
      return dut_.SetPrior(id, priors_[id]);
    }
    if (what < 0.98) return dut_.SetPose(id, dut_.X_W(id) * Exp(Noise(0.1)));
    fixed_.push_back(id);
    dut_.Fix(id);
  }

  int Index(int count) { return random_.Index(count); }

 private:
  static constexpr int kRound = 12;

  static Pose3 TruthOf(int id) {
    const double angle = 2 * std::numbers::pi * id / kRound;
    return MakePose({5 * std::cos(angle), 5 * std::sin(angle), 0.02 * id},
                    {0, 0.1, angle + std::numbers::pi / 2});
  }

  AbsolutePrior PriorOf(int id) {
    const Pose3 X_W = TruthOf(id);
    return {X_W.translation().z() + random_.Gaussian(0.02), random_.Gaussian(0.01),
            0.1 + random_.Gaussian(0.01), 0.02, 0.01};
  }

  Vec6 Noise(double scale) {
    Vec6 noise;
    for (double& number : noise) number = random_.Gaussian(scale);
    return noise;
  }

  Constraint Measure(int i, int k, ConstraintKind kind, double doubt) {
    Mat6 A;
    for (double& number : A.reshaped()) number = random_.Gaussian(0.03);
    const Mat6 covariance = A * A.transpose() + 0.0004 * Mat6::Identity();
    return {i, k, kind, Ominus(TruthOf(i), TruthOf(k)) * Exp(doubt * Noise(0.04)),
            WhiteningOf(covariance)};
  }

  Random random_;
  PoseGraph dut_;
  std::vector<int> closures_;
  std::map<NodeId, AbsolutePrior> priors_;
  std::vector<NodeId> fixed_;
};

void ExpectSolvedLikeAnew(History& history) {
  PoseGraph anew = history.Anew();
  ASSERT_NEAR(history.dut().Cost(), anew.Cost(), 1e-9 * anew.Cost());
  const double before = history.dut().Cost();
  const SolveSummary dut = history.dut().Solve(), expected = anew.Solve();
  ASSERT_TRUE(dut.usable && expected.usable);
  EXPECT_NEAR(dut.initial_cost, before, 1e-9 * before);
  EXPECT_NEAR(dut.final_cost, expected.final_cost, 1e-6 * expected.final_cost);
  EXPECT_NEAR(dut.final_cost, history.dut().Cost(), 1e-9 * dut.final_cost);
}

void ExpectCovariancesLikeAnew(History& history, int pairs) {
  std::vector<std::pair<NodeId, NodeId>> asked;
  for (int i = 0; i < pairs; ++i)
    asked.emplace_back(history.Index(history.size()), history.size() - 1);
  const auto dut = history.dut().RelativeCovariances(asked);
  const auto expected = history.Anew().RelativeCovariances(asked);
  ASSERT_EQ(dut.size(), expected.size());
  for (std::size_t i = 0; i < dut.size(); ++i)
    EXPECT_LT((dut[i] - expected[i]).norm(), 1e-7 * expected[i].norm() + 1e-15) << i;
}

TEST(PoseGraphHistoryTest, SolvesAndCovariancesAreThoseOfAGraphWithoutAPast) {
  for (int seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    History history(static_cast<std::uint64_t>(seed));
    for (int i = 0; i < 80; ++i) {
      for (int happened = history.Index(5); happened >= 0; --happened) history.Happen();
      if (i % 3 != 0) ExpectSolvedLikeAnew(history);
      if (i % 4 == 0) ExpectCovariancesLikeAnew(history, i % 8 == 0 ? 1 : history.size());
      ASSERT_FALSE(HasFailure()) << "step " << i;
    }
  }
}

/// As SLAM grows it, large enough that covariances of few nodes come from the kept factor.
TEST(PoseGraphHistoryTest, CovariancesOfFewNodesInALargeGraph) {
  History history(20);
  for (int i = 0; i < 150; ++i) history.AddNode(true);
  for (int i = 0; i < 100; ++i) history.AddClosure();
  for (int i = 0; i < 20; ++i) {
    ExpectSolvedLikeAnew(history);
    history.AddNode(true);
    ExpectCovariancesLikeAnew(history, 3);
    history.AddClosure();
    ExpectCovariancesLikeAnew(history, 3);
    if (i % 5 == 4) history.RemoveClosure();
    ASSERT_FALSE(HasFailure()) << "step " << i;
  }
}

double LargestDifference(const std::vector<Mat6>& dut, const std::vector<Mat6>& expected) {
  double largest = 0;
  for (std::size_t i = 0; i < dut.size(); ++i)
    largest = std::max(largest, (dut[i] - expected[i]).norm() / (expected[i].norm() + 1e-12));
  return largest;
}

/// As SLAM asks: of all nodes relative to the first and the newest, between solves.
TEST(PoseGraphHistoryTest, RoughCovariancesAreRightToSomePercent) {
  History history(60);
  for (int i = 0; i < 60; ++i) history.AddNode(true);
  for (int i = 0; i < 60; ++i) history.AddClosure();
  ExpectSolvedLikeAnew(history);
  double largest = 0;
  for (int i = 0; i < 30; ++i) {
    history.AddNode(true);
    if (i % 2 == 0) history.AddClosure();
    if (i % 7 == 6) history.RemoveClosure();
    history.dut().Solve();
    std::vector<PoseGraph::NodePair> asked = {{3, 3}};
    const int pairs = i % 3 == 0 ? 2 : history.size();
    for (int id = 0; id < pairs; ++id) {
      asked.emplace_back(id, history.size() - 1);
      asked.emplace_back(0, id);
    }
    const auto dut = history.dut().RoughRelativeCovariances(asked);
    ASSERT_EQ(dut.size(), asked.size());
    largest = std::max(largest, LargestDifference(dut, history.Anew().RelativeCovariances(asked)));
  }
  EXPECT_LT(largest, 0.1);
  EXPECT_GT(largest, 1e-9) << "the factor was never that of poses before";
}

/// Closures so far off that steps with the old factor do not get there.
TEST(PoseGraphHistoryTest, LargeCorrections) {
  History history(30);
  for (int i = 0; i < 80; ++i) history.AddNode(true);
  ExpectSolvedLikeAnew(history);
  for (int i = 0; i < 20; ++i) {
    history.AddClosure(10);
    ExpectSolvedLikeAnew(history);
    ASSERT_FALSE(HasFailure()) << "step " << i;
  }
}

TEST(PoseGraphHistoryTest, EqualHistoriesGiveEqualBitsCopiesIncluded) {
  History a(40), b(40);
  for (int i = 0; i < 60; ++i) {
    a.Happen();
    b.Happen();
    a.dut().Solve();
    if (i % 7 == 0) a.dut().RelativeCovariances({{0, a.size() - 1}});
    if (i % 10 == 0) b.dut() = PoseGraph(b.dut());
    b.dut().Solve();
    if (i % 7 == 0) b.dut().RelativeCovariances({{0, b.size() - 1}});
    for (const auto& [id, X_W] : a.dut().nodes())
      ASSERT_EQ(X_W.matrix(), b.dut().X_W(id).matrix()) << i;
  }
}

TEST(PoseGraphHistoryTest, PosesThatNothingHoldsAnyMoreAreTold) {
  History history(50);
  for (int i = 0; i < 40; ++i) history.AddNode(false);
  for (int i = 0; i < 10; ++i) history.AddClosure();
  ASSERT_TRUE(history.dut().Solve().usable);
  ASSERT_TRUE(history.dut().Solve().usable);
  std::vector<int> of_last;
  for (const auto& [number, c] : history.dut().constraints())
    if (c.from == 40 || c.to == 40) of_last.push_back(number);
  for (const int number : of_last) history.dut().RemoveConstraint(number);
  EXPECT_TRUE(history.dut().RelativeCovariances({{0, 40}}).empty());
  history.dut().Solve();
  EXPECT_TRUE(history.dut().RelativeCovariances({{0, 40}}).empty());
  history.dut().AddConstraint({39, 40, ConstraintKind::kOdometry, MakePose({1, 0, 0}),
                               WhiteningOf(0.01 * Mat6::Identity())});
  ExpectSolvedLikeAnew(history);
  ExpectCovariancesLikeAnew(history, 1);
}

}  // namespace
}  // namespace vog
