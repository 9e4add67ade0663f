#include "lib/posegraph/kept_factor.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "lib/base/random.h"
#include "lib/posegraph/residual.h"

namespace vog {
namespace {

/// A graph of random poses, constraints and priors; node 0 is fixed.
class RandomGraph {
 public:
  explicit RandomGraph(int nodes) : random_(1, "kept factor") {
    data.nodes.emplace(0, AnyPose());
    for (int i = 1; i < nodes; ++i) AddNode();
    for (int i = 0; i < nodes; ++i) AddClosure(6);
  }

  GraphData data;

  void AddNode() {
    const auto id = static_cast<int>(data.nodes.size());
    data.nodes.emplace(id, AnyPose());
    data.priors[id] = {random_.Gaussian(1), 0.1, -0.2, 0.3, 0.2};
    AddConstraint(random_.Index(id), id, 6);
  }

  void AddClosure(int directions) {
    const int size = static_cast<int>(data.nodes.size()), from = random_.Index(size);
    AddConstraint(from, (from + 1 + random_.Index(size - 1)) % size, directions);
  }

  void AddConstraint(int from, int to, int directions) {
    if (random_.Chance(0.5)) std::swap(from, to);
    Mat6 W;
    for (double& number : W.reshaped()) number = random_.Gaussian(1);
    W += 3 * Mat6::Identity();
    data.constraints[next_++] = {from, to, ConstraintKind::kFullClosure, AnyPose(),
                                 W.topRows(directions)};
  }

  void Remove(KeptFactor& dut, int number) {
    dut.Remove(number, data.constraints.at(number));
    data.constraints.erase(number);
  }

  int last() const { return next_ - 1; }

 private:
  Pose3 AnyPose() {
    return MakePose(random_.GaussianVector(Vec3::Ones()),
                    {random_.Gaussian(0.5), random_.Gaussian(0.5), random_.Gaussian(1)});
  }

  Random random_;
  int next_ = 0;
};

/// J^T J from the residuals, by rows.
Eigen::MatrixXd DenseHessian(const GraphData& graph, const NodeRows& rows) {
  const Eigen::Index size = 6 * rows.size();
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(size, size);
  const auto add = [&](const Eigen::MatrixXd& J) { H += J.transpose() * J; };
  for (const auto& [number, c] : graph.constraints) {
    const RelativeError e = ErrorOf(c, graph.nodes.at(c.from), graph.nodes.at(c.to));
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(c.whitening.rows(), size);
    if (const auto i = rows.Of(c.from)) J.middleCols<6>(6 * *i) = c.whitening * e.by_i;
    if (const auto k = rows.Of(c.to)) J.middleCols<6>(6 * *k) = c.whitening * e.by_k;
    add(J);
  }
  for (const auto& [id, prior] : graph.priors) {
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, size);
    if (const auto row = rows.Of(id))
      J.middleCols<6>(6 * *row) = ErrorOf(prior, graph.nodes.at(id)).by_pose;
    add(J);
  }
  return H;
}

void ExpectInverseOf(const GraphData& graph, const KeptFactor& dut) {
  const Eigen::MatrixXd inverse = DenseHessian(graph, dut.rows()).inverse();
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(inverse.rows(), -1, 2);
  std::vector<Pose3> X_W;
  for (const NodeId id : dut.rows().ids()) X_W.push_back(graph.nodes.at(id));
  EXPECT_LT((dut.Solve(b, X_W) - inverse * b).norm(), 1e-8 * (inverse * b).norm());
  const Eigen::MatrixXd B = Eigen::MatrixXd::Random(inverse.rows(), 5);
  const Eigen::MatrixXd expected = B.transpose() * inverse * B;
  EXPECT_LT((dut.InverseOf(B) - expected).norm(), 1e-8 * expected.norm());
}

TEST(ResidualTest, DerivativesAreThoseOfDifferences) {
  RandomGraph graph(6);
  constexpr double kStep = 1e-6;
  for (const auto& [number, c] : graph.data.constraints) {
    const Pose3 &X_i = graph.data.nodes.at(c.from), &X_k = graph.data.nodes.at(c.to);
    const RelativeError e = ErrorOf(c, X_i, X_k);
    for (int d = 0; d < 6; ++d) {
      const Vec6 xi = kStep * Vec6::Unit(d);
      const Vec6 by_i = (ErrorOf(c, Perturbed(X_i, xi), X_k).error - e.error) / kStep;
      const Vec6 by_k = (ErrorOf(c, X_i, Perturbed(X_k, xi)).error - e.error) / kStep;
      EXPECT_LT((e.by_i.col(d) - by_i).norm(), 1e-4) << d;
      EXPECT_LT((e.by_k.col(d) - by_k).norm(), 1e-4) << d;
    }
  }
  for (const auto& [id, prior] : graph.data.priors) {
    const Pose3& X_W = graph.data.nodes.at(id);
    const AbsoluteError e = ErrorOf(prior, X_W);
    for (int d = 0; d < 6; ++d) {
      const Vec3 moved = ErrorOf(prior, Perturbed(X_W, kStep * Vec6::Unit(d))).residual;
      EXPECT_LT((e.by_pose.col(d) - (moved - e.residual) / kStep).norm(), 1e-4) << d;
    }
  }
}

TEST(ResidualTest, PerturbedIsTheExponentialToFirstOrder) {
  const Pose3 X = MakePose({1, 2, 3}, {0.1, -0.4, 2});
  Vec6 xi;
  xi << 3e-4, -2e-4, 1e-4, 2e-4, 1e-4, -3e-4;
  EXPECT_LT(Log(Ominus(X * Exp(xi), Perturbed(X, xi))).norm(), 1e-6);
}

TEST(KeptFactorTest, FollowsWhatComesAndGoes) {
  RandomGraph graph(30);
  auto dut = KeptFactor::Of(graph.data);
  ASSERT_TRUE(dut);
  EXPECT_TRUE(dut->IsPlain());
  ExpectInverseOf(graph.data, *dut);

  graph.AddClosure(6);
  ASSERT_TRUE(dut->Follow(graph.data));
  EXPECT_FALSE(dut->IsPlain());
  ExpectInverseOf(graph.data, *dut);

  const int old = graph.data.constraints.begin()->first + 30;
  graph.AddClosure(2);
  graph.Remove(*dut, old);
  ASSERT_TRUE(dut->Follow(graph.data));
  EXPECT_FALSE(dut->IsExactFor(graph.data)) << "digits may be lost";
  ExpectInverseOf(graph.data, *dut);

  const int short_lived = graph.last();
  graph.Remove(*dut, short_lived);
  ASSERT_TRUE(dut->Follow(graph.data));
  ExpectInverseOf(graph.data, *dut);
}

TEST(KeptFactorTest, NewNodesAreLeaves) {
  RandomGraph graph(30);
  auto dut = KeptFactor::Of(graph.data);
  for (int i = 0; i < 3; ++i) {
    graph.AddNode();
    ASSERT_TRUE(dut->Follow(graph.data));
    EXPECT_EQ(dut->rows().size(), 30 + i);
    EXPECT_TRUE(dut->IsExactFor(graph.data));
    ExpectInverseOf(graph.data, *dut);
  }
  graph.AddConstraint(30, 32, 6);
  ASSERT_TRUE(dut->Follow(graph.data));
  ExpectInverseOf(graph.data, *dut);
}

TEST(KeptFactorTest, KnowsOfWhichPosesItIs) {
  RandomGraph graph(10);
  const auto dut = KeptFactor::Of(graph.data);
  EXPECT_TRUE(dut->IsExactFor(graph.data));
  graph.data.nodes.at(4) = Perturbed(graph.data.nodes.at(4), Vec6::Constant(1e-12));
  EXPECT_FALSE(dut->IsExactFor(graph.data));
}

void ExpectMarginalsOf(const GraphData& graph, const KeptFactor& dut) {
  const Eigen::MatrixXd inverse = DenseHessian(graph, dut.rows()).inverse();
  ASSERT_EQ(dut.marginals().size(), static_cast<std::size_t>(dut.rows().size()));
  for (int row = 0; row < dut.rows().size(); ++row) {
    const Mat6 expected = inverse.block<6, 6>(6 * row, 6 * row);
    EXPECT_LT((dut.marginals()[static_cast<std::size_t>(row)] - expected).norm(),
              1e-8 * expected.norm())
        << row;
  }
  const Eigen::MatrixXd B = Eigen::MatrixXd::Random(inverse.rows(), 6);
  EXPECT_LT((dut.Solve(B) - inverse * B).norm(), 1e-8 * (inverse * B).norm());
}

TEST(KeptFactorTest, MarginalsFollowNodesAndConstraints) {
  RandomGraph graph(40);
  for (int round = 0; round < 4; ++round) {
    SCOPED_TRACE(round);
    auto dut = KeptFactor::Of(graph.data);
    EXPECT_FALSE(dut->HasMarginals());
    dut->FindMarginals();
    ExpectMarginalsOf(graph.data, *dut);
    graph.AddNode();
    ASSERT_TRUE(dut->Follow(graph.data));
    ExpectMarginalsOf(graph.data, *dut);
    graph.AddClosure(3);
    graph.AddNode();
    if (round % 2 == 1) graph.Remove(*dut, graph.data.constraints.begin()->first + 45 + round);
    ASSERT_TRUE(dut->Follow(graph.data));
    ExpectMarginalsOf(graph.data, *dut);
    if (round % 2 == 0) graph.AddClosure(6);
    ASSERT_TRUE(dut->Follow(graph.data));
    ExpectMarginalsOf(graph.data, *dut);
  }
}

TEST(KeptFactorTest, KnowsWhetherPosesAreNear) {
  RandomGraph graph(10);
  const auto dut = KeptFactor::Of(graph.data);
  const Pose3 X_W = graph.data.nodes.at(4);
  const auto is_near = [&](const Vec6& moved) {
    graph.data.nodes.at(4) = Perturbed(X_W, moved);
    return dut->IsNear(graph.data);
  };
  EXPECT_TRUE(is_near((Vec6() << 0.05, -0.05, 0.02, 0, 0.01, 0.01).finished()));
  EXPECT_FALSE(is_near(-0.2 * Vec6::Unit(1)));
  EXPECT_FALSE(is_near(0.05 * Vec6::Unit(4)));
  graph.data.nodes.at(4) = X_W;
  graph.AddNode();
  EXPECT_FALSE(dut->IsNear(graph.data)) << "a node that it does not know";
}

TEST(KeptFactorTest, GivesUpWhereItCannotFollow) {
  RandomGraph graph(30);
  const auto before = KeptFactor::Of(graph.data);
  {
    auto dut = before;
    RandomGraph lonely = graph;
    lonely.data.nodes.emplace(30, Pose3::Identity());
    EXPECT_FALSE(dut->Follow(lonely.data)) << "no constraint";
  }
  {
    auto dut = before;
    RandomGraph vague = graph;
    vague.data.nodes.emplace(30, Pose3::Identity());
    vague.AddConstraint(3, 30, 5);
    EXPECT_FALSE(dut->Follow(vague.data)) << "five directions";
  }
  {
    auto dut = before;
    RandomGraph changed = graph;
    for (int i = 0; i < 200; ++i) changed.AddClosure(6);
    EXPECT_FALSE(dut->Follow(changed.data)) << "more corrections than are worth it";
  }
  {
    auto dut = before;
    RandomGraph torn = graph;
    torn.AddNode();
    const int only = torn.last();
    ASSERT_TRUE(dut->Follow(torn.data));
    torn.Remove(*dut, only);
    EXPECT_FALSE(dut->Follow(torn.data)) << "a free node";
  }
  EXPECT_FALSE(KeptFactor::Of({{{0, Pose3::Identity()}, {1, Pose3::Identity()}}, {}, {}, {}}));
}

}  // namespace
}  // namespace vog
