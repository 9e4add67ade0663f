#include "lib/posegraph/g2o.h"

#include <gtest/gtest.h>

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
  const G2oGraph g2o = ToG2oGraph(graph);
  EXPECT_EQ(g2o.vertices.size(), 2u);
  ASSERT_EQ(g2o.edges.size(), 1u);
  EXPECT_TRUE(g2o.edges[0].X_ik.isApprox(MakePose({1, 2, 3})));
  const Mat6 information = sigma.cwiseAbs2().cwiseInverse().asDiagonal();
  EXPECT_TRUE(g2o.edges[0].information.isApprox(information, 1e-9));
}

TEST(G2oTest, EmptyGraphIsAnEmptyText) { EXPECT_EQ(ToG2oText({}), ""); }

}  // namespace
}  // namespace vog
