#include "procs/viewer/frames.h"

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "lib/submap/submaps_testing.h"

namespace vog {
namespace {

/// Reads a frame as the page does: number by number.
class FrameReader {
 public:
  explicit FrameReader(std::string bytes) : bytes_(std::move(bytes)) {}

  template <class Number>
  Number Take() {
    Number number{};
    if (at_ + sizeof(number) > bytes_.size()) {
      ADD_FAILURE() << "the frame ends at " << bytes_.size();
      return number;
    }
    std::memcpy(&number, bytes_.data() + at_, sizeof(number));
    at_ += sizeof(number);
    return number;
  }
  Vec3 TakeVector() {
    const float x = Take<float>(), y = Take<float>(), z = Take<float>();
    return {x, y, z};
  }
  void Head(FrameKind kind, std::uint32_t count, double utime_us) {
    EXPECT_EQ(Take<std::uint32_t>(), static_cast<std::uint32_t>(kind));
    EXPECT_EQ(Take<std::uint32_t>(), count);
    EXPECT_EQ(Take<double>(), utime_us);
  }
  void Pose(const Pose3& X) {
    EXPECT_TRUE(TakeVector().isApprox(X.translation(), 1e-6));
    const float w = Take<float>();
    const Vec3 v = TakeVector();
    EXPECT_TRUE(
        Eigen::Quaterniond(w, v.x(), v.y(), v.z()).toRotationMatrix().isApprox(X.linear(), 1e-5));
  }
  std::string Rest() const { return bytes_.substr(at_); }
  bool IsAtEnd() const { return at_ == bytes_.size(); }

 private:
  std::string bytes_;
  std::size_t at_ = 0;
};

const Pose3 kPose = MakePose({1, -2, 3}, {0.1, -0.2, 2.5});

TEST(FramesTest, ASubmapIsItsOccupiedVoxelsAndWhereTheirSurfaceLooks) {
  // A wall of 3 x 3 at x = 2 with free space on its lower side, and a speck that is alone.
  VoxelTable table;
  for (int y = 0; y < 3; ++y)
    for (int z = 0; z < 3; ++z) {
      table[{2, y, z}] = 40;
      table[{1, y, z}] = -30;
    }
  table[{-9, -9, -9}] = 40;
  Submap submap{{},           FromUtime(5),       FromUtime(9), 2, Pose3::Identity(),
                Mat3::Zero(), GridOf(0.25, table)};
  submap.base.id = 12;
  FrameReader dut(SubmapFrame(submap, 0));
  dut.Head(FrameKind::kSubmap, 9, 5);
  EXPECT_EQ(dut.Take<std::uint32_t>(), 12u);
  EXPECT_EQ(dut.Take<float>(), 0.25f);
  EXPECT_EQ(dut.Take<double>(), 9);
  std::set<VoxelKey> keys;
  for (int i = 0; i < 9; ++i) {
    VoxelKey key;
    for (std::int32_t* index : {&key.x, &key.y, &key.z}) *index = dut.Take<std::int16_t>();
    keys.insert(key);
    const int u = dut.Take<std::int8_t>(), v = dut.Take<std::int8_t>();
    if (key.y == 1 && key.z == 1) {
      EXPECT_LT(u, -120) << "towards -x";
      EXPECT_NEAR(v, 0, 2);
    }
    EXPECT_EQ(key.x, 2);
  }
  EXPECT_EQ(keys.size(), 9u);
  EXPECT_TRUE(dut.IsAtEnd());
}

TEST(FramesTest, PlacesTellHowSureTheyAre) {
  ViewedPlace place;
  place.place.id = 4;
  place.place.X_WM = kPose;
  place.place.covariance_WM.diagonal() << 0.04, 0.05, 0.07, 9, 9, 9;
  ViewedPlace known = place;
  known.true_error_m = 0.5;
  FrameReader dut(PosesFrame(FromUtime(8), 3, std::vector{place, known}));
  dut.Head(FrameKind::kPoses, 2, 8);
  EXPECT_EQ(dut.Take<double>(), 3);
  for (const bool has_truth : {false, true}) {
    EXPECT_EQ(dut.Take<std::uint32_t>(), 4u);
    dut.Pose(kPose);
    EXPECT_NEAR(dut.Take<float>(), 0.4, 1e-6);
    const float error = dut.Take<float>();
    EXPECT_TRUE(has_truth ? error == 0.5f : std::isnan(error));
  }
  EXPECT_TRUE(dut.IsAtEnd());
}

TEST(FramesTest, AScansBeamsTellEchoSilenceAndIgnorance) {
  const Scan scan{FromUtime(3),
                  0,
                  kPose,
                  0.5,
                  6,
                  {{-0.1f, 2, 1, BeamStatus::kReturn},
                   {0, 0, 0, BeamStatus::kClear},
                   {0.1f, 0, 0, BeamStatus::kUncertain}}};
  FrameReader dut(ScanFrame(scan));
  dut.Head(FrameKind::kScan, 3, 3);
  dut.Pose(kPose);
  EXPECT_EQ(dut.Take<float>(), 0.5f);
  EXPECT_EQ(dut.Take<float>(), 6);
  for (const float number : {-0.1f, 2.0f, 0.0f, 0.0f, 0.1f, -1.0f})
    EXPECT_EQ(dut.Take<float>(), number);
  EXPECT_TRUE(dut.IsAtEnd());
}

TEST(FramesTest, TheEstimatesCovarianceIsTurnedIntoTheWorld) {
  ViewedEstimate estimate{FromUtime(1), MakePose({0, 0, 0}, {0, 0, ToRadians(90)}), Mat6::Zero(),
                          0.2, 0.1};
  // Unsure ahead, which is W's y.
  estimate.covariance_WB(0, 0) = 0.09;
  FrameReader dut(EstimateFrame(estimate));
  dut.Head(FrameKind::kEstimate, 0, 1);
  dut.Pose(estimate.X_WB);
  for (const double number : {0.0, 0.0, 0.0, 0.09, 0.0, 0.0, 0.2, 0.1})
    EXPECT_NEAR(dut.Take<float>(), number, 1e-6);
  EXPECT_TRUE(dut.IsAtEnd());
}

/// A closure that binds all but the columns of `free`.
graph_edge_t PartialEdge(const Eigen::Matrix<double, 6, Eigen::Dynamic>& free) {
  const Mat6 bound = Mat6::Identity() - free * free.transpose();
  Mat6 weights = Mat6::Identity();
  weights.diagonal() << 400, 300, 900, 1e4, 2e4, 3e4;
  graph_edge_t edge{};
  edge.kind = graph_edge_t::PARTIAL_CLOSURE;
  edge.directions = static_cast<std::int8_t>(6 - free.cols());
  CopyMatrix<6>(Mat6(bound * weights * bound), edge.information);
  return edge;
}

TEST(FramesTest, AGraphsEdgesTellKindReasonAndFreeDirections) {
  const Vec3 along = Vec3(1, 2, -2) / 3;
  Eigen::Matrix<double, 6, Eigen::Dynamic> free = Eigen::Matrix<double, 6, 1>::Zero();
  free.col(0).head<3>() = along;
  graph_t graph{};
  graph.header.utime_us = 6;
  graph.version = 2;
  graph.edge = {PartialEdge(free), graph_edge_t{}, graph_edge_t{}};
  graph.edge[0].from_id = 3;
  graph.edge[0].to_id = 9;
  graph.edge[0].chi_square = 1.5;
  graph.edge[1].kind = graph_edge_t::REJECTED_CLOSURE;
  graph.edge[1].reason = "too \"far\"\xff";  // Not UTF-8.
  graph.edge[2].kind = graph_edge_t::FULL_CLOSURE;
  FrameReader dut(GraphFrame(graph));
  dut.Head(FrameKind::kGraph, 3, 6);
  EXPECT_EQ(dut.Take<double>(), 2);
  EXPECT_EQ(dut.Take<std::uint32_t>(), 3u);
  EXPECT_EQ(dut.Take<std::uint32_t>(), 9u);
  EXPECT_EQ(dut.Take<std::uint8_t>(), int{graph_edge_t::PARTIAL_CLOSURE});
  EXPECT_EQ(dut.Take<std::uint8_t>(), 5);
  EXPECT_EQ(dut.Take<std::uint16_t>(), 0);
  EXPECT_EQ(dut.Take<float>(), 1.5f);
  EXPECT_NEAR(std::abs(dut.TakeVector().dot(along)), 1, 1e-5);
  EXPECT_TRUE(dut.TakeVector().isZero());
  for (const int kind : {int{graph_edge_t::REJECTED_CLOSURE}, int{graph_edge_t::FULL_CLOSURE}}) {
    dut.Take<double>();
    EXPECT_EQ(dut.Take<std::uint8_t>(), kind);
    dut.Take<std::uint8_t>();
    EXPECT_EQ(dut.Take<std::uint16_t>(), kind == graph_edge_t::REJECTED_CLOSURE ? 1 : 0);
    dut.Take<float>();
    EXPECT_TRUE(dut.TakeVector().isZero() && dut.TakeVector().isZero());
  }
  const auto reasons = nlohmann::json::parse(dut.Rest());
  ASSERT_EQ(reasons.size(), 2u);
  EXPECT_TRUE(reasons[1].get<std::string>().starts_with("too \"far\""));
}

TEST(FramesTest, PathsAndFrontiersAreAsTheyAre) {
  FrameReader trail(TrailFrame(2, 5, std::vector<TrailPoint>{{FromUtime(7), 3, Vec3(1, 2, 3)}}));
  trail.Head(FrameKind::kTrail, 1, 7);
  EXPECT_EQ(trail.Take<std::uint32_t>(), 2u);
  EXPECT_EQ(trail.Take<std::uint32_t>(), 5u);
  EXPECT_EQ(trail.Take<double>(), 7);
  EXPECT_EQ(trail.Take<std::int32_t>(), 3);
  EXPECT_EQ(trail.TakeVector(), Vec3(1, 2, 3));
  EXPECT_TRUE(trail.IsAtEnd());
  FrameReader frontier(FrontierFrame({-16, 0, 32}, 0.5, std::vector<VoxelKey>{{-13, 15, 32}}));
  frontier.Head(FrameKind::kFrontier, 1, 0);
  for (const int index : {-16, 0, 32}) EXPECT_EQ(frontier.Take<std::int32_t>(), index);
  EXPECT_EQ(frontier.Take<float>(), 0.5f);
  for (const int index : {3, 15, 0}) EXPECT_EQ(frontier.Take<std::uint8_t>(), index);
  EXPECT_TRUE(frontier.IsAtEnd());
}

TEST(FramesTest, APlanTellsItsTreeWithGains) {
  plan_t plan{};
  plan.plan_id = 4;
  plan.best = 1;
  plan.path = {{{1, 2, 3}, 0.5}};
  plan.tree = {{-1, {0, 0, 0}, 0, 0, 0}, {0, {1, 2, 3}, 0.5f, 12.5f, 30}};
  const auto dut = nlohmann::json::parse(PlanFrame(plan));
  EXPECT_EQ(dut["k"], "plan");
  EXPECT_EQ(dut["best"], 1);
  EXPECT_EQ(dut["path"], nlohmann::json::parse("[[1.0,2.0,3.0,0.5]]"));
  EXPECT_EQ(dut["tree"][1], nlohmann::json::parse("[0,1.0,2.0,3.0,0.5,12.5,30]"));
}

}  // namespace
}  // namespace vog
