#include "lib/messages/graph_edges.h"

#include <gtest/gtest.h>

#include "lib/messages/convert.h"

namespace vog {
namespace {

/// A partial closure that binds all but sideways motion and yaw.
graph_edge_t WithoutYAndYaw() {
  graph_edge_t edge{};
  edge.kind = graph_edge_t::PARTIAL_CLOSURE;
  edge.directions = 4;
  Mat6 information = Mat6::Zero();
  information.diagonal() << 400, 0, 900, 1e4, 2e4, 0;
  CopyMatrix<6>(information, edge.information);
  return edge;
}

TEST(FreeMotionsTest, DirectionsAndTurnsAreToldApart) {
  const FreeMotions motions = FreeMotionsOf(WithoutYAndYaw());
  ASSERT_EQ(motions.directions.size(), 1u);
  EXPECT_NEAR(std::abs(motions.directions[0].y()), 1, 1e-6);
  ASSERT_EQ(motions.axes.size(), 1u);
  EXPECT_NEAR(std::abs(motions.axes[0].z()), 1, 1e-6);
}

TEST(FreeMotionsTest, OtherEdgesLeaveNothingFree) {
  for (const std::int8_t kind :
       {graph_edge_t::ODOMETRY, graph_edge_t::FULL_CLOSURE, graph_edge_t::REJECTED_CLOSURE}) {
    graph_edge_t edge = WithoutYAndYaw();
    edge.kind = kind;
    EXPECT_TRUE(FreeMotionsOf(edge).directions.empty());
    EXPECT_TRUE(FreeMotionsOf(edge).axes.empty());
  }
}

TEST(FreeMotionsTest, CountsOutOfRangeDoNoHarm) {
  graph_edge_t edge = WithoutYAndYaw();
  edge.directions = 100;
  EXPECT_TRUE(FreeMotionsOf(edge).directions.empty());
  edge.directions = -100;
  const FreeMotions motions = FreeMotionsOf(edge);
  EXPECT_EQ(motions.directions.size() + motions.axes.size(), 6u);
}

}  // namespace
}  // namespace vog
