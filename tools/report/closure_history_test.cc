#include "tools/report/closure_history.h"

#include <gtest/gtest.h>

#include "lib/messages/convert.h"

namespace vog {
namespace {

graph_edge_t Edge(int from, int to, std::int8_t kind, const Pose3& X_ik) {
  graph_edge_t edge{};
  edge.from_id = from;
  edge.to_id = to;
  edge.kind = kind;
  edge.X_ik = ToMessage(X_ik);
  return edge;
}

graph_t Graph(std::int64_t version, double time_s, std::vector<graph_edge_t> edges) {
  graph_t graph{};
  graph.header.utime_us = static_cast<std::int64_t>(1e6 * time_s);
  graph.version = version;
  graph.edge = std::move(edges);
  graph.count = static_cast<std::int32_t>(graph.edge.size());
  return graph;
}

submap_poses_t Poses(std::int64_t version, const std::vector<Vec3>& positions) {
  std::vector<SubmapPlace> places;
  for (const Vec3& position : positions) {
    SubmapPlace place;
    place.id = static_cast<SubmapId>(places.size());
    place.X_WM.translation() = position;
    places.push_back(place);
  }
  submap_poses_t message = ToMessage(places);
  message.version = version;
  return message;
}

const graph_edge_t kFirstMotion = Edge(0, 1, graph_edge_t::ODOMETRY, MakePose({1, 0, 0}));
const graph_edge_t kSecondMotion = Edge(1, 2, graph_edge_t::ODOMETRY, MakePose({1, 0, 0}));

/// Three submaps; the third one closes a loop with the first.
ClosureHistory WithClosure(std::int8_t kind) {
  ClosureHistory history;
  history.Add(Poses(1, {Vec3(0, 0, 0)}));
  history.Add(Graph(1, 10, {}));
  history.Add(Poses(2, {Vec3(0, 0, 0), Vec3(1, 0, 0)}));
  history.Add(Graph(2, 20, {kFirstMotion}));
  history.Add(Poses(3, {Vec3(0, 0, 0), Vec3(1, 0.1, 0), Vec3(2, 0.5, 0)}));
  history.Add(Graph(3, 30, {kFirstMotion, kSecondMotion, Edge(0, 2, kind, MakePose({2, 0.5, 0}))}));
  return history;
}

TEST(ClosureHistoryTest, WhereOdometryHadTheSubmapIsOfTheSolutionBefore) {
  const auto closures = WithClosure(graph_edge_t::FULL_CLOSURE).Closures();
  ASSERT_EQ(closures.size(), 1u);
  EXPECT_EQ(closures[0].kind, int{graph_edge_t::FULL_CLOSURE});
  EXPECT_FALSE(closures[0].dropped);
  ASSERT_TRUE(closures[0].X_ik_before);
  EXPECT_TRUE(closures[0].X_ik_before->translation().isApprox(Vec3(2, 0, 0), 1e-12));
  EXPECT_TRUE(closures[0].X_ik.translation().isApprox(Vec3(2, 0.5, 0), 1e-12));
}

TEST(ClosureHistoryTest, ASolutionToldTwiceIsStillTheSame) {
  ClosureHistory dut = WithClosure(graph_edge_t::FULL_CLOSURE);
  dut.Add(Poses(3, {Vec3(0, 0, 0), Vec3(1, 0.1, 0), Vec3(2, 0.5, 0)}));
  dut.Add(Graph(
      3, 31,
      {kFirstMotion, kSecondMotion, Edge(0, 2, graph_edge_t::FULL_CLOSURE, MakePose({2, 0.5, 0})),
       Edge(1, 2, graph_edge_t::FULL_CLOSURE, MakePose({1, 0.5, 0}))}));
  const auto closures = dut.Closures();
  ASSERT_EQ(closures.size(), 2u);
  EXPECT_TRUE(closures[1].X_ik_before->translation().isApprox(Vec3(1, 0, 0), 1e-12));
}

TEST(ClosureHistoryTest, OneThatLeavesTheGraphWasDropped) {
  ClosureHistory dut = WithClosure(graph_edge_t::PARTIAL_CLOSURE);
  for (const int version : {4, 5})
    dut.Add(Graph(version, 10 * version,
                  {Edge(0, 2, graph_edge_t::REJECTED_CLOSURE, MakePose({2, 0.5, 0}))}));
  const auto closures = dut.Closures();
  ASSERT_EQ(closures.size(), 1u);
  EXPECT_EQ(closures[0].kind, int{graph_edge_t::PARTIAL_CLOSURE});
  ASSERT_TRUE(closures[0].dropped);
  EXPECT_EQ(ToSeconds(*closures[0].dropped), 40);
}

TEST(ClosureHistoryTest, OneThatWasNeverInTheGraphIsRejected) {
  const auto closures = WithClosure(graph_edge_t::REJECTED_CLOSURE).Closures();
  ASSERT_EQ(closures.size(), 1u);
  EXPECT_FALSE(closures[0].was_accepted() || closures[0].dropped);
}

TEST(ClosureHistoryTest, TheLastGraphCountsInTheOrderOfSubmaps) {
  ClosureHistory dut = WithClosure(graph_edge_t::FULL_CLOSURE);
  dut.Add(Graph(4, 40,
                {Edge(1, 5, graph_edge_t::FULL_CLOSURE, MakePose({1, 0, 0})),
                 Edge(0, 4, graph_edge_t::REJECTED_CLOSURE, MakePose({1, 0, 0})),
                 Edge(0, 5, graph_edge_t::REJECTED_CLOSURE, MakePose({1, 0, 0}))}));
  std::vector<std::pair<int, int>> pairs;
  for (const auto& closure : dut.Closures())
    pairs.emplace_back(closure.edge.from_id, closure.edge.to_id);
  EXPECT_EQ(pairs, (std::vector<std::pair<int, int>>{{0, 4}, {0, 5}, {1, 5}}));
}

TEST(ClosureHistoryTest, WhatMakesNoSenseIsLeftOut) {
  ClosureHistory dut;
  graph_edge_t no_pose = Edge(0, 2, graph_edge_t::FULL_CLOSURE, Pose3::Identity());
  no_pose.X_ik.position_m[0] = std::numeric_limits<double>::quiet_NaN();
  const graph_edge_t far = Edge(std::numeric_limits<int>::min(), std::numeric_limits<int>::max(),
                                graph_edge_t::FULL_CLOSURE, Pose3::Identity());
  dut.Add(Graph(1, 1, {no_pose, far, Edge(0, 1, 7, Pose3::Identity())}));
  const auto closures = dut.Closures();
  ASSERT_EQ(closures.size(), 1u);
  EXPECT_FALSE(closures[0].X_ik_before);
}

}  // namespace
}  // namespace vog
