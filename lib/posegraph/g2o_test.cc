#include "lib/posegraph/g2o.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <sstream>

#include "lib/base/random.h"

namespace vog {
namespace {

Pose3 RandomPose(Random& random) {
  Vec6 xi;
  for (double& number : xi) number = random.Gaussian(2);
  return Exp(xi);
}

/// The numbers of a pose as a file has them.
Eigen::Matrix<double, 7, 1> NumbersOf(const Pose3& X) {
  Eigen::Matrix<double, 7, 1> numbers;
  numbers << X.translation(), Eigen::Quaterniond(X.linear()).coeffs();
  return numbers;
}

template <class Numbers>
Numbers Read(std::istream& line) {
  Numbers numbers;
  for (double& number : numbers.reshaped()) line >> number;
  return numbers;
}

TEST(G2oTest, NumbersReadBackExactly) {
  Random random(1, "g2o");
  G2oGraph graph;
  for (const NodeId id : {3, 4, 7, 20}) graph.vertices[id] = RandomPose(random);
  graph.fixed = {3};
  for (int i = 0; i < 5; ++i) {
    Mat6 A;
    for (double& number : A.reshaped()) number = random.Gaussian(100);
    graph.edges.push_back({3, 7, RandomPose(random), A * A.transpose()});
  }
  std::istringstream text(ToG2oText(graph));
  std::map<NodeId, int> seen;
  std::size_t edges = 0;
  for (std::string text_line; std::getline(text, text_line);) {
    std::istringstream line(text_line);
    std::string tag;
    NodeId id;
    line >> tag >> id;
    if (tag == "VERTEX_SE3:QUAT") {
      ++seen[id];
      EXPECT_EQ((Read<Eigen::Matrix<double, 7, 1>>(line)), NumbersOf(graph.vertices.at(id)));
    } else if (tag == "FIX") {
      EXPECT_EQ(id, 3);
    } else {
      ASSERT_EQ(tag, "EDGE_SE3:QUAT");
      const G2oEdge& edge = graph.edges.at(edges++);
      NodeId to;
      line >> to;
      EXPECT_EQ(id, edge.from);
      EXPECT_EQ(to, edge.to);
      EXPECT_EQ((Read<Eigen::Matrix<double, 7, 1>>(line)), NumbersOf(edge.X_ik));
      for (int row = 0; row < 6; ++row)
        for (int col = row; col < 6; ++col) {
          double number;
          line >> number;
          EXPECT_EQ(number, edge.information(row, col));
        }
    }
    EXPECT_FALSE(line.fail()) << text_line;
    EXPECT_TRUE((line >> std::ws).eof()) << "more than expected: " << text_line;
  }
  EXPECT_EQ(seen, (std::map<NodeId, int>{{3, 1}, {4, 1}, {7, 1}, {20, 1}}));
  EXPECT_EQ(edges, graph.edges.size());
}

TEST(G2oTest, TellsAPoseGraphWithTheInformationOfItsConstraints) {
  PoseGraph graph({});
  graph.AddNode(0, Pose3::Identity());
  graph.AddNode(1, MakePose({1, 2, 3}));
  Vec6 sigma;
  sigma << 0.1, 0.2, 0.5, 1, 2, 4;
  const int dropped = graph.AddConstraint(
      {0, 1, ConstraintKind::kFullClosure, Pose3::Identity(), WhiteningOf(Mat6::Identity())});
  graph.AddConstraint({0, 1, ConstraintKind::kOdometry, MakePose({1, 2, 3}),
                       WhiteningOf(sigma.cwiseAbs2().asDiagonal())});
  graph.RemoveConstraint(dropped);
  const G2oGraph g2o = ToG2oGraph(graph.nodes(), graph.constraints());
  EXPECT_EQ(g2o.vertices.size(), 2u);
  ASSERT_EQ(g2o.edges.size(), 1u);
  EXPECT_TRUE(g2o.edges[0].X_ik.isApprox(MakePose({1, 2, 3})));
  const Mat6 information = sigma.cwiseAbs2().cwiseInverse().asDiagonal();
  EXPECT_TRUE(g2o.edges[0].information.isApprox(information, 1e-9));
}

TEST(G2oTest, ReadsWhatItWrites) {
  Random random(2, "g2o");
  for (const bool is_planar : {false, true}) {
    G2oGraph graph;
    graph.is_planar = is_planar;
    for (const NodeId id : {3, 4, 7, 20})
      graph.vertices[id] = is_planar ? MakePose({random.Gaussian(5), random.Gaussian(5), 0},
                                                {0, 0, random.Uniform(-3, 3)})
                                     : RandomPose(random);
    graph.fixed = {4, 20};
    Mat6 information = Mat6::Identity();
    information(0, 0) = 7;
    information(0, 5) = information(5, 0) = 0.25;
    graph.edges.push_back({20, 3, graph.vertices[7], information});
    const std::string text = ToG2oText(graph);
    const G2oFile file = ParseG2o("# a comment\r\n\n" + text + "TAG 1 2\n", "x.g2o");
    EXPECT_TRUE(file.faults.empty()) << file.faults.front();
    EXPECT_EQ(file.comments, 1);
    EXPECT_EQ(file.unknown, (std::map<std::string, int>{{"TAG", 1}}));
    EXPECT_EQ(file.graph.is_planar, is_planar);
    EXPECT_EQ(file.graph.fixed, graph.fixed);
    ASSERT_EQ(file.graph.vertices.size(), 4u);
    for (const auto& [id, X_W] : graph.vertices)
      EXPECT_TRUE(file.graph.vertices.at(id).isApprox(X_W, 1e-12));
    ASSERT_EQ(file.graph.edges.size(), 1u);
    EXPECT_EQ(file.graph.edges[0].information, information);
    EXPECT_EQ(file.graph.edges[0].from, 20);
  }
}

TEST(G2oTest, TellsEachFaultWithItsLine) {
  const G2oFile file = ParseG2o(
      "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nVERTEX_SE2 0 0 0 0\nVERTEX_SE2 0 1 1 1\nVERTEX_SE2 2 0 x "
      "0\n",
      "x.g2o");
  ASSERT_EQ(file.faults.size(), 3u);
  EXPECT_TRUE(file.faults[0].starts_with("x.g2o:3: ")) << file.faults[0];
  EXPECT_TRUE(file.faults[1].starts_with("x.g2o:4: ")) << file.faults[1];
  EXPECT_EQ(file.faults[2], "x.g2o:1: edge to vertex 1, which is missing");
  EXPECT_EQ(file.graph.vertices.size(), 1u);
  EXPECT_TRUE(file.graph.edges.empty());
}

TEST(G2oTest, RotationInformationIsThatOfRadiansOrOfHalfAngles) {
  G2oGraph g2o;
  g2o.vertices = {{0, Pose3::Identity()}, {1, MakePose({0, 0, 0}, {0, 0, 0.01})}};
  g2o.edges.push_back({0, 1, Pose3::Identity(), 100 * Mat6::Identity()});
  const auto cost = [&](RotationInformation rotation) {
    return ToPoseGraph(g2o, {}, rotation, Objective::kGeodesic).Cost();
  };
  EXPECT_NEAR(cost(RotationInformation::kRadians), 100 * 1e-4, 1e-6);
  EXPECT_NEAR(cost(RotationInformation::kHalfAngles), 25 * 1e-4, 1e-6);
}

TEST(G2oTest, ChordalCostIsThatOfItsFormula) {
  Random random(3, "g2o");
  G2oGraph g2o;
  for (const NodeId id : {0, 1}) g2o.vertices[id] = RandomPose(random);
  Mat6 A;
  for (double& number : A.reshaped()) number = random.Gaussian(1);
  const Mat6 information = A * A.transpose() + Mat6::Identity();
  const Pose3 X_ik = RandomPose(random), X_Wi = g2o.vertices[0], X_Wk = g2o.vertices[1];
  g2o.edges.push_back({0, 1, X_ik, information});
  const double tau = 3 / Mat3(information.topLeftCorner<3, 3>()).inverse().trace();
  const double kappa = 1.5 / Mat3(information.bottomRightCorner<3, 3>()).inverse().trace();
  const double expected = kappa * (X_Wk.linear() - X_Wi.linear() * X_ik.linear()).squaredNorm() +
                          tau * (X_Wk.translation() - X_Wi * X_ik.translation()).squaredNorm();
  const PoseGraph graph = ToPoseGraph(g2o, {}, RotationInformation::kRadians, Objective::kChordal);
  EXPECT_NEAR(graph.Cost(), expected, 1e-9 * expected);
}

TEST(G2oTest, EachPartIsHeldAndEdgesOfNeighboursAreOdometry) {
  G2oGraph g2o;
  for (const NodeId id : {0, 1, 5, 6, 9}) g2o.vertices[id] = Pose3::Identity();
  g2o.edges.push_back({1, 0});
  g2o.edges.push_back({5, 6});
  g2o.edges.push_back({9, 5, Pose3::Identity(), Mat6::Identity()});
  g2o.fixed = {9};
  EXPECT_EQ(ConnectedParts(g2o), (std::vector<std::vector<NodeId>>{{0, 1}, {5, 6, 9}}));
  const PoseGraph graph = ToPoseGraph(g2o, {}, RotationInformation::kRadians, Objective::kGeodesic);
  for (const NodeId id : {0, 1, 5, 6, 9}) EXPECT_EQ(graph.IsFixed(id), id == 0 || id == 9) << id;
  EXPECT_EQ(graph.constraints().at(0).kind, ConstraintKind::kOdometry);
  EXPECT_EQ(graph.constraints().at(2).kind, ConstraintKind::kFullClosure);
}

TEST(G2oTest, EmptyGraphIsAnEmptyText) { EXPECT_EQ(ToG2oText({}), ""); }

}  // namespace
}  // namespace vog
