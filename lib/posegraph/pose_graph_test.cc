#include "lib/posegraph/pose_graph.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "lib/base/random.h"

namespace vog {
namespace {

Vec6 RandomTwist(const Vec6& sigma, Random& random) {
  Vec6 xi;
  for (int i = 0; i < 6; ++i) xi[i] = random.Gaussian(sigma[i]);
  return xi;
}

Vec6 Twist(double x, double y, double z, double roll, double pitch, double yaw) {
  Vec6 xi;
  xi << x, y, z, roll, pitch, yaw;
  return xi;
}

Mat6 RandomCovariance(double scale, Random& random) {
  Mat6 A;
  for (double& number : A.reshaped()) number = random.Gaussian(scale);
  return A * A.transpose() + scale * scale * Mat6::Identity();
}

Mat6 Diagonal(const Vec6& sigma) { return sigma.cwiseAbs2().asDiagonal(); }

/// Poses, constraints and priors, solved by the book: dense normal equations, numeric derivatives.
class DenseReference {
 public:
  std::vector<Pose3> X_W;
  std::vector<Constraint> constraints;
  std::map<int, AbsolutePrior> priors;

  static Vec6 ErrorOf(const Constraint& c, const Pose3& X_Wi, const Pose3& X_Wk) {
    const Pose3 X_error = Ominus(c.X_ik, Ominus(X_Wi, X_Wk));
    Eigen::Quaterniond q(X_error.linear());
    if (q.w() < 0) q.coeffs() *= -1;
    Vec6 error;
    error << X_error.translation(), 2 * q.vec();
    return error;
  }

  Eigen::VectorXd Residuals(const std::vector<Pose3>& poses) const {
    std::vector<double> all;
    for (const Constraint& c : constraints) {
      const Eigen::VectorXd r = c.whitening * ErrorOf(c, poses[c.from], poses[c.to]);
      all.insert(all.end(), r.begin(), r.end());
    }
    for (const auto& [id, prior] : priors) {
      const Vec3 up = poses[id].linear().transpose() * Vec3::UnitZ();
      const Vec3 measured =
          MakePose(Vec3::Zero(), {prior.roll_rad, prior.pitch_rad, 0}).linear().transpose() *
          Vec3::UnitZ();
      const Vec3 tilt = measured.cross(up) / prior.sigma_angle_rad;
      all.push_back((poses[id].translation().z() - prior.z_m) / prior.sigma_z_m);
      all.push_back(tilt.x());
      all.push_back(tilt.y());
    }
    return Eigen::Map<Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size()));
  }

  /// All poses but the first perturbed on the right.
  std::vector<Pose3> Perturbed(const Eigen::VectorXd& delta) const {
    std::vector<Pose3> poses = X_W;
    for (std::size_t i = 1; i < poses.size(); ++i)
      poses[i] = poses[i] * Exp(delta.segment<6>(6 * static_cast<Eigen::Index>(i - 1)));
    return poses;
  }

  Eigen::MatrixXd Jacobian() const {
    const Eigen::Index columns = 6 * static_cast<Eigen::Index>(X_W.size() - 1);
    Eigen::MatrixXd J(Residuals(X_W).size(), columns);
    constexpr double kStep = 1e-5;
    for (Eigen::Index col = 0; col < columns; ++col) {
      const Eigen::VectorXd delta = kStep * Eigen::VectorXd::Unit(columns, col);
      J.col(col) = (Residuals(Perturbed(delta)) - Residuals(Perturbed(-delta))) / (2 * kStep);
    }
    return J;
  }

  void Solve() {
    for (int i = 0; i < 50; ++i) {
      const Eigen::MatrixXd J = Jacobian();
      const Eigen::VectorXd step =
          (J.transpose() * J).ldlt().solve(-J.transpose() * Residuals(X_W));
      X_W = Perturbed(step);
      if (step.norm() < 1e-10) return;
    }
    FAIL() << "the reference does not converge";
  }

  Mat6 RelativeCovariance(int i, int k) const {
    const Eigen::MatrixXd J = Jacobian();
    const Eigen::MatrixXd P = (J.transpose() * J).inverse();
    // Numeric derivative of X_ik by all poses.
    Eigen::MatrixXd D(6, P.cols());
    constexpr double kStep = 1e-5;
    for (Eigen::Index col = 0; col < P.cols(); ++col) {
      const auto poses = Perturbed(kStep * Eigen::VectorXd::Unit(P.cols(), col));
      D.col(col) = Log(Ominus(Ominus(X_W[i], X_W[k]), Ominus(poses[i], poses[k]))) / kStep;
    }
    return D * P * D.transpose();
  }

  PoseGraph ToGraph(const PoseGraphOptions& options = {100, 1e-14}) const {
    PoseGraph graph(options);
    for (int i = 0; i < static_cast<int>(X_W.size()); ++i) graph.AddNode(i, X_W[i]);
    for (const Constraint& c : constraints) graph.AddConstraint(c);
    for (const auto& [id, prior] : priors) graph.SetPrior(id, prior);
    return graph;
  }
};

/// A noisy chain with full and partial closures and with priors.
DenseReference RandomGraph(int nodes, Random& random) {
  DenseReference graph;
  const Vec6 noise = Twist(0.03, 0.03, 0.02, 0.01, 0.01, 0.03);
  std::vector<Pose3> truth = {MakePose({1, 2, -3}, {0.1, -0.05, 2})};
  while (static_cast<int>(truth.size()) < nodes)
    truth.push_back(truth.back() * Exp(RandomTwist(Twist(1, 1, 0.1, 0.1, 0.1, 0.8), random)));
  const auto measure = [&](int i, int k) -> Pose3 {
    return Ominus(truth[i], truth[k]) * Exp(RandomTwist(noise, random));
  };
  graph.X_W = {truth[0]};
  for (int i = 1; i < nodes; ++i) {
    const Pose3 X_ik = measure(i - 1, i);
    graph.X_W.push_back(graph.X_W.back() * X_ik);
    graph.constraints.push_back(
        {i - 1, i, ConstraintKind::kOdometry, X_ik, WhiteningOf(RandomCovariance(0.03, random))});
  }
  for (int i = 0; i < nodes; ++i) {
    const int from = random.Index(nodes), to = (from + 1 + random.Index(nodes - 1)) % nodes;
    if (i % 2 == 0) {
      graph.constraints.push_back({from, to, ConstraintKind::kFullClosure, measure(from, to),
                                   WhiteningOf(RandomCovariance(0.03, random))});
    } else {
      const Mat6 directions =
          Eigen::SelfAdjointEigenSolver<Mat6>(RandomCovariance(1, random)).eigenvectors();
      graph.constraints.push_back({from, to, ConstraintKind::kPartialClosure, measure(from, to),
                                   PartialWhiteningOf(directions.leftCols(1 + random.Index(5)),
                                                      RandomCovariance(0.03, random))});
    }
  }
  for (int i = 0; i < nodes; ++i) {
    const RollPitchYaw angles = AnglesOf(truth[i]);
    graph.priors[i] = {truth[i].translation().z() + random.Gaussian(0.02),
                       angles.roll + random.Gaussian(0.01), angles.pitch + random.Gaussian(0.01),
                       0.02, 0.01};
  }
  return graph;
}

TEST(WhiteningTest, SquaresToTheInformation) {
  Random random(1, "whitening");
  for (int i = 0; i < 20; ++i) {
    const Mat6 covariance = RandomCovariance(0.3, random);
    const Whitening W = WhiteningOf(covariance);
    EXPECT_TRUE((W.transpose() * W * covariance).isIdentity(1e-8));
  }
}

TEST(WhiteningTest, OfSomeDirectionsIsThatOfTheirMarginal) {
  Random random(2, "whitening");
  const Mat6 covariance = RandomCovariance(0.3, random);
  const Mat6 vectors =
      Eigen::SelfAdjointEigenSolver<Mat6>(RandomCovariance(1, random)).eigenvectors();
  for (int n = 1; n <= 6; ++n) {
    const Eigen::Matrix<double, 6, Eigen::Dynamic> basis = vectors.leftCols(n);
    const Whitening W = PartialWhiteningOf(basis, covariance);
    ASSERT_EQ(W.rows(), n);
    const Vec6 error = RandomTwist(Vec6::Ones(), random);
    const Eigen::VectorXd seen = basis.transpose() * error;
    const Eigen::MatrixXd P = basis.transpose() * covariance * basis;
    EXPECT_NEAR((W * error).squaredNorm(), seen.dot(P.inverse() * seen), 1e-6);
    EXPECT_LT((W * vectors.rightCols(6 - n)).norm(), 1e-6);
  }
}

TEST(WhiteningTest, RefusesACovarianceThatIsNone) {
  EXPECT_THROW(WhiteningOf(Mat6::Zero()), std::invalid_argument);
  Mat6 indefinite = Mat6::Identity();
  indefinite(3, 3) = -1;
  EXPECT_THROW(WhiteningOf(indefinite), std::invalid_argument);
}

TEST(PoseGraphTest, FindsTheOptimumOfDenseGaussNewton) {
  Random random(3, "graph");
  for (int run = 0; run < 10; ++run) {
    DenseReference reference = RandomGraph(8, random);
    PoseGraph dut = reference.ToGraph();
    const double before = reference.Residuals(reference.X_W).squaredNorm();
    const SolveSummary summary = dut.Solve();
    reference.Solve();
    ASSERT_TRUE(summary.usable);
    EXPECT_NEAR(summary.initial_cost, before, 1e-6 * before);
    EXPECT_NEAR(summary.final_cost, reference.Residuals(reference.X_W).squaredNorm(),
                1e-6 * summary.final_cost);
    for (int i = 0; i < 8; ++i)
      EXPECT_LT(Log(Ominus(reference.X_W[i], dut.X_W(i))).norm(), 1e-5) << run << " " << i;
    EXPECT_TRUE(dut.X_W(0).isApprox(reference.X_W[0], 1e-14)) << "the first node stays";
    for (const Constraint& c : reference.constraints) {
      const Vec6 error = DenseReference::ErrorOf(c, dut.X_W(c.from), dut.X_W(c.to));
      EXPECT_NEAR(dut.ChiSquareOf(c), (c.whitening * error).squaredNorm(), 1e-7);
    }
  }
}

TEST(PoseGraphTest, ResidualIsTheLogarithmToFirstOrder) {
  Random random(4, "graph");
  const Pose3 X_ik = MakePose({1, -2, 0.5}, {0.2, 0.4, -2});
  const Constraint constraint{0, 1, ConstraintKind::kFullClosure, X_ik,
                              WhiteningOf(RandomCovariance(0.1, random))};
  for (int i = 0; i < 20; ++i) {
    const Vec6 xi = RandomTwist(Vec6::Constant(1e-3), random);
    PoseGraph graph({});
    graph.AddNode(0, MakePose({5, 4, 3}, {0.1, 0.2, 3}));
    graph.AddNode(1, graph.X_W(0) * X_ik * Exp(xi));
    const double expected = (constraint.whitening * xi).squaredNorm();
    EXPECT_NEAR(graph.ChiSquareOf(constraint), expected, 0.01 * expected);
  }
}

TEST(PoseGraphTest, WeighsTwoMeasurementsByTheirInformation) {
  PoseGraph graph({100, 1e-14});
  graph.AddNode(0, Pose3::Identity());
  graph.AddNode(1, Pose3::Identity());
  const auto measure = [&](double x, double sigma_m) {
    graph.AddConstraint({0, 1, ConstraintKind::kOdometry, MakePose({x, 0, 0}),
                         WhiteningOf(sigma_m * sigma_m * Mat6::Identity())});
  };
  measure(1, 0.1);
  measure(2, 0.2);
  ASSERT_TRUE(graph.Solve().usable);
  EXPECT_NEAR(graph.X_W(1).translation().x(), (1 * 100 + 2 * 25) / 125.0, 1e-7);
  EXPECT_NEAR(graph.RelativeCovariances({{0, 1}})[0](0, 0), 1 / 125.0, 1e-9);
}

TEST(PoseGraphTest, PriorsHoldHeightAndTiltAndNothingElse) {
  PoseGraph graph({100, 1e-14});
  graph.AddNode(0, Pose3::Identity());
  graph.AddNode(1, MakePose({1, 0, 0}));
  graph.AddConstraint({0, 1, ConstraintKind::kOdometry, MakePose({1, 2, 0.3}, {0, 0, 1}),
                       WhiteningOf(Diagonal(Vec6::Constant(0.1)))});
  graph.SetPrior(1, {0.5, 0.02, -0.03, 0.05, 0.05});
  ASSERT_TRUE(graph.Solve().usable);
  const Pose3& X = graph.X_W(1);
  EXPECT_NEAR(X.translation().x(), 1, 1e-6);
  EXPECT_NEAR(X.translation().y(), 2, 1e-6);
  EXPECT_NEAR(X.translation().z(), (0.3 * 100 + 0.5 * 400) / 500, 1e-3);
  EXPECT_NEAR(AnglesOf(X).roll, 0.02 * 400 / 500, 1e-4);
  EXPECT_NEAR(AnglesOf(X).pitch, -0.03 * 400 / 500, 1e-4);
  EXPECT_NEAR(YawOf(X), 1, 1e-3);
}

TEST(PoseGraphTest, PartialClosureMovesItsDirectionsAlone) {
  PoseGraph graph({100, 1e-14});
  graph.AddNode(0, Pose3::Identity());
  graph.AddNode(1, MakePose({1, 2, 3}));
  graph.AddConstraint({0, 1, ConstraintKind::kOdometry, MakePose({1, 2, 3}),
                       WhiteningOf(Diagonal(Vec6::Constant(1)))});
  Eigen::Matrix<double, 6, Eigen::Dynamic> basis(6, 2);
  basis << Vec6::Unit(0), Vec6::Unit(2);
  graph.AddConstraint({0, 1, ConstraintKind::kPartialClosure, MakePose({2, 7, 4}, {0.5, 0, 0}),
                       PartialWhiteningOf(basis, Diagonal(Vec6::Constant(1e-4)))});
  ASSERT_TRUE(graph.Solve().usable);
  // Seen in the frame of the measured pose, which is rolled.
  const Vec3 error = MakePose({2, 7, 4}, {0.5, 0, 0}).inverse() * graph.X_W(1).translation();
  EXPECT_NEAR(error.x(), 0, 1e-6);
  EXPECT_NEAR(error.z(), 0, 1e-6);
  EXPECT_LT(error.y(), -1);
  EXPECT_LT(AnglesOf(graph.X_W(1)).roll, 0.1);
}

TEST(PoseGraphTest, RelativeCovariancesAreThoseOfTheDenseInverse) {
  Random random(5, "graph");
  DenseReference reference = RandomGraph(7, random);
  reference.Solve();
  const PoseGraph dut = reference.ToGraph();
  std::vector<std::pair<NodeId, NodeId>> pairs;
  for (int i = 0; i < 7; ++i)
    for (int k = 0; k < 7; ++k)
      if (i != k) pairs.emplace_back(i, k);
  const auto covariances = dut.RelativeCovariances(pairs);
  ASSERT_EQ(covariances.size(), pairs.size());
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const Mat6 expected = reference.RelativeCovariance(pairs[p].first, pairs[p].second);
    EXPECT_LT((covariances[p] - expected).norm(), 1e-3 * expected.norm())
        << pairs[p].first << " " << pairs[p].second;
  }
}

TEST(PoseGraphTest, CovarianceOfAChainIsTheSumOfItsTransportedParts) {
  Random random(6, "graph");
  PoseGraph graph({});
  graph.AddNode(0, MakePose({3, 2, 1}, {0, 0, 2}));
  Mat6 expected = Mat6::Zero();
  for (int i = 1; i < 20; ++i) {
    const Pose3 X_ik = Exp(RandomTwist(Twist(1, 1, 0.2, 0.1, 0.1, 1), random));
    const Mat6 covariance = RandomCovariance(0.02, random);
    graph.AddNode(i, graph.X_W(i - 1) * X_ik);
    graph.AddConstraint({i - 1, i, ConstraintKind::kOdometry, X_ik, WhiteningOf(covariance)});
    const Mat6 A = AdjointOf(X_ik.inverse());
    expected = A * expected * A.transpose() + covariance;
  }
  const auto covariances = graph.RelativeCovariances({{0, 19}, {7, 7}});
  ASSERT_EQ(covariances.size(), 2u);
  EXPECT_TRUE(covariances[0].isApprox(expected, 1e-6));
  EXPECT_LT(covariances[1].norm(), 1e-6);
}

TEST(PoseGraphTest, CovariancesAreEmptyWhenAPoseIsFree) {
  PoseGraph graph({});
  graph.AddNode(0, Pose3::Identity());
  graph.AddNode(1, Pose3::Identity());
  graph.AddNode(2, Pose3::Identity());
  graph.AddConstraint(
      {0, 1, ConstraintKind::kOdometry, Pose3::Identity(), WhiteningOf(Mat6::Identity())});
  EXPECT_TRUE(graph.RelativeCovariances({{0, 1}}).empty());
  graph.AddConstraint(
      {1, 2, ConstraintKind::kOdometry, Pose3::Identity(), WhiteningOf(Mat6::Identity())});
  EXPECT_EQ(graph.RelativeCovariances({{0, 1}}).size(), 1u);
}

// Odometry around a loop with closures and priors: normalised errors squared must average to one a
// dimension, or the covariances lie.
TEST(PoseGraphTest, ErrorsAreAsLargeAsTheCovariancesSay) {
  Random random(7, "graph");
  const Vec6 odometry = Twist(0.05, 0.05, 0.02, 0.01, 0.01, 0.02);
  const Vec6 closure = Twist(0.03, 0.03, 0.03, 0.02, 0.02, 0.01);
  constexpr int kNodes = 12, kRuns = 60;
  double normalised = 0, odometry_error = 0, error = 0;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<Pose3> truth;
    for (int i = 0; i < kNodes; ++i) {
      const double angle = 2 * EIGEN_PI * i / kNodes;
      truth.push_back(MakePose({3 * std::cos(angle), 3 * std::sin(angle), 0}, {0, 0, angle}));
    }
    PoseGraph graph({});
    graph.AddNode(0, truth[0]);
    const auto measure = [&](int i, int k, const Vec6& sigma) -> Pose3 {
      return Ominus(truth[i], truth[k]) * Exp(RandomTwist(sigma, random));
    };
    for (int i = 1; i < kNodes; ++i) {
      const Pose3 X_ik = measure(i - 1, i, odometry);
      graph.AddNode(i, graph.X_W(i - 1) * X_ik);
      graph.AddConstraint(
          {i - 1, i, ConstraintKind::kOdometry, X_ik, WhiteningOf(Diagonal(odometry))});
      graph.SetPrior(
          i, {random.Gaussian(0.02), random.Gaussian(0.005), random.Gaussian(0.005), 0.02, 0.005});
    }
    odometry_error += Ominus(truth.back(), graph.X_W(kNodes - 1)).translation().norm();
    for (const auto& [i, k] : {std::pair{0, 11}, {2, 9}, {0, 6}, {1, 10}})
      graph.AddConstraint({i, k, ConstraintKind::kFullClosure, measure(i, k, closure),
                           WhiteningOf(Diagonal(closure))});
    ASSERT_TRUE(graph.Solve().usable);
    error += Ominus(truth.back(), graph.X_W(kNodes - 1)).translation().norm();
    for (const auto& [i, k] : {std::pair{0, 5}, {3, 8}}) {
      const Vec6 xi = Log(Ominus(Ominus(graph.X_W(i), graph.X_W(k)), Ominus(truth[i], truth[k])));
      normalised += xi.dot(graph.RelativeCovariances({{i, k}})[0].inverse() * xi) / 6 / 2;
    }
  }
  EXPECT_NEAR(normalised / kRuns, 1, 0.15);
  EXPECT_LT(error, 0.5 * odometry_error);
}

TEST(PoseGraphTest, MovesAsAWholeWithItsFirstNode) {
  Random random(8, "graph");
  DenseReference reference = RandomGraph(8, random);
  reference.priors.clear();
  PoseGraph here = reference.ToGraph();
  const Pose3 X_there = MakePose({10, -20, 5}, {0.3, -0.2, 2.5});
  for (Pose3& X : reference.X_W) X = X_there * X;
  PoseGraph there = reference.ToGraph();
  ASSERT_TRUE(here.Solve().usable);
  ASSERT_TRUE(there.Solve().usable);
  for (int i = 0; i < 8; ++i)
    EXPECT_LT(Log(Ominus(X_there * here.X_W(i), there.X_W(i))).norm(), 1e-6);
}

TEST(PoseGraphTest, GivesTheSameBitsEachTime) {
  Random a(9, "graph"), b(9, "graph");
  PoseGraph first = RandomGraph(20, a).ToGraph({}), second = RandomGraph(20, b).ToGraph({});
  first.Solve();
  second.Solve();
  for (int i = 0; i < 20; ++i) EXPECT_EQ(first.X_W(i).matrix(), second.X_W(i).matrix());
  EXPECT_EQ(first.RelativeCovariances({{3, 17}})[0], second.RelativeCovariances({{3, 17}})[0]);
}

TEST(PoseGraphTest, RemovedConstraintHasNoSay) {
  PoseGraph graph({});
  graph.AddNode(0, Pose3::Identity());
  graph.AddNode(1, MakePose({1, 0, 0}));
  const Whitening W = WhiteningOf(Mat6::Identity());
  const int right = graph.AddConstraint({0, 1, ConstraintKind::kOdometry, MakePose({1, 0, 0}), W});
  const int wrong =
      graph.AddConstraint({0, 1, ConstraintKind::kFullClosure, MakePose({9, 0, 0}), W});
  graph.RemoveConstraint(wrong);
  ASSERT_TRUE(graph.Solve().usable);
  EXPECT_NEAR(graph.X_W(1).translation().x(), 1, 1e-9);
  const int next =
      graph.AddConstraint({0, 1, ConstraintKind::kFullClosure, MakePose({1, 0, 0}), W});
  EXPECT_NE(next, wrong);
  EXPECT_NE(next, right);
}

TEST(PoseGraphTest, RefusesNodesTwiceAndConstraintsInTheAir) {
  PoseGraph graph({});
  graph.AddNode(4, Pose3::Identity());
  EXPECT_THROW(graph.AddNode(4, Pose3::Identity()), std::invalid_argument);
  EXPECT_THROW(graph.AddConstraint({4, 5, ConstraintKind::kOdometry, Pose3::Identity(),
                                    WhiteningOf(Mat6::Identity())}),
               std::invalid_argument);
  EXPECT_TRUE(graph.Solve().usable) << "a single node";
  EXPECT_TRUE(graph.RelativeCovariances({{4, 4}})[0].isZero());
}

TEST(PoseGraphTest, FailedSolveLeavesThePosesAlone) {
  PoseGraph graph({});
  graph.AddNode(0, Pose3::Identity());
  graph.AddNode(1, MakePose({1, 0, 0}));
  Pose3 nowhere = Pose3::Identity();
  nowhere.translation().x() = std::numeric_limits<double>::quiet_NaN();
  graph.AddConstraint({0, 1, ConstraintKind::kOdometry, nowhere, WhiteningOf(Mat6::Identity())});
  EXPECT_FALSE(graph.Solve().usable);
  EXPECT_EQ(graph.X_W(1).translation(), Vec3(1, 0, 0));
}

}  // namespace
}  // namespace vog
