#include "lib/foxglove/foxglove_messages.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "lib/messages/convert.h"
#include "lib/submap/submaps_testing.h"

namespace vog {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

const Pose3 kPose = MakePose({1, 2, 3}, {0.1, -0.2, 2});

Pose3 PoseFrom(const foxglove::Pose& pose) {
  const auto& p = pose.position();
  const auto& q = pose.orientation();
  return MakePose({p.x(), p.y(), p.z()}, Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z()));
}

std::vector<float> FloatsOf(const std::string& bytes) {
  std::vector<float> floats(bytes.size() / sizeof(float));
  std::memcpy(floats.data(), bytes.data(), bytes.size());
  return floats;
}

TEST(FoxgloveMessagesTest, PosesKeepFrameAndTime) {
  truth_t truth{};
  truth.header.utime_us = 12'345'678;
  truth.X_WB = ToMessage(kPose);
  const auto drawn = ToFoxglove(truth);
  ASSERT_TRUE(drawn);
  EXPECT_EQ(drawn->frame_id(), "W");
  EXPECT_EQ(drawn->timestamp().seconds(), 12);
  EXPECT_EQ(drawn->timestamp().nanos(), 345'678'000);
  EXPECT_TRUE(PoseFrom(drawn->pose()).isApprox(kPose, 1e-12));

  nav_t nav{};
  nav.X_OB = ToMessage(kPose);
  EXPECT_EQ(ToFoxglove(nav)->frame_id(), "O");
  vehicle_nav_t vehicle_nav{};
  vehicle_nav.X_OB = ToMessage(kPose);
  EXPECT_EQ(ToFoxglove(vehicle_nav)->frame_id(), "O");
}

TEST(FoxgloveMessagesTest, FramesAreAChainFromTheWorldToTheBody) {
  nav_t nav{};
  nav.X_OB = ToMessage(kPose);
  pose_estimate_t estimate{};
  estimate.X_WO = ToMessage(MakePose({5, 0, 0}));
  estimate.X_WB = ToMessage(MakePose({5, 0, 0}) * kPose);
  const auto X_WO = FrameOf(estimate), X_OB = FrameOf(nav);
  ASSERT_TRUE(X_WO && X_OB);
  EXPECT_EQ(X_WO->parent_frame_id(), "W");
  EXPECT_EQ(X_WO->child_frame_id(), X_OB->parent_frame_id());
  EXPECT_EQ(X_OB->child_frame_id(), "B");
  EXPECT_EQ(X_WO->translation().x(), 5);
  EXPECT_NEAR(X_OB->translation().z(), 3, 1e-12);
  EXPECT_NEAR(X_OB->rotation().w(), Eigen::Quaterniond(kPose.linear()).w(), 1e-12);
  EXPECT_NEAR(ToFoxglove(estimate)->pose().position().x(), 6, 1e-12);
}

TEST(FoxgloveMessagesTest, AScansEchoesAreAPointCloudInTheBody) {
  Scan scan;
  scan.X_BS = MakePose({1, 0, 0.5});
  scan.min_range_m = 0.5;
  scan.max_range_m = 10;
  scan.beams = {{0, 4, 0.25, BeamStatus::kReturn},
                {0.1F, 0, 0, BeamStatus::kClear},
                {static_cast<float>(ToRadians(90)), 2, 0.75, BeamStatus::kReturn}};
  const auto cloud = ToFoxglove(ToMessage(scan));
  ASSERT_TRUE(cloud);
  EXPECT_EQ(cloud->frame_id(), "B");
  EXPECT_EQ(cloud->pose().orientation().w(), 1);
  ASSERT_EQ(cloud->point_stride(), 16u);
  ASSERT_EQ(cloud->fields_size(), 4);
  EXPECT_EQ(cloud->fields(3).name(), "strength");
  EXPECT_EQ(cloud->fields(3).offset(), 12u);
  const std::vector<float> expected = {5, 0, 0.5, 0.25, 1, 2, 0.5, 0.75};
  const std::vector<float> found = FloatsOf(cloud->data());
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-6);
}

TEST(FoxgloveMessagesTest, ASonarFrameIsAnImage) {
  const SonarFrame frame{{}, 0, 0.1, 1, 10, 3, 2, {1, 2, 3, 4, 5, 6}};
  const auto image = ToFoxglove(ToMessage(frame));
  ASSERT_TRUE(image);
  EXPECT_EQ(image->frame_id(), "S");
  EXPECT_EQ(image->encoding(), "mono8");
  EXPECT_EQ(image->width(), 3u);
  EXPECT_EQ(image->height(), 2u);
  EXPECT_EQ(image->step(), 3u);
  EXPECT_EQ(image->data(), "\1\2\3\4\5\6");
}

TEST(FoxgloveMessagesTest, APathLiesInTheFrameOfItsPlan) {
  plan_t plan{};
  plan.path = {{{1, 2, 3}, 0}, {{4, 5, 6}, 1.5}};
  plan.waypoints = 2;
  auto drawn = ToFoxglove(plan);
  ASSERT_TRUE(drawn);
  EXPECT_EQ(drawn->frame_id(), "W");
  ASSERT_EQ(drawn->poses_size(), 2);
  EXPECT_TRUE(PoseFrom(drawn->poses(1)).isApprox(MakePose({4, 5, 6}, {0, 0, 1.5}), 1e-12));
  plan.in_odometry_frame = true;
  EXPECT_EQ(ToFoxglove(plan)->frame_id(), "O");
}

TEST(FoxgloveMessagesTest, SubmapsAreTheirPoses) {
  const auto drawn = ToFoxglove(ToMessage({{0, Pose3::Identity()}, {1, kPose}}));
  ASSERT_TRUE(drawn);
  EXPECT_EQ(drawn->frame_id(), "W");
  ASSERT_EQ(drawn->poses_size(), 2);
  EXPECT_TRUE(PoseFrom(drawn->poses(1)).isApprox(kPose, 1e-12));
}

TEST(FoxgloveMessagesTest, EdgesAreLinesBetweenKnownSubmapsInAColourAKind) {
  graph_t graph{};
  graph.edge.resize(5);
  graph.count = 5;
  for (std::int8_t kind = 0; kind < 4; ++kind) {
    graph.edge[kind].kind = kind;
    graph.edge[kind].to_id = 7;
  }
  graph.edge[4].to_id = 8;
  const submap_poses_t places = ToMessage({{0, Pose3::Identity()}, {7, kPose}});
  const auto update = ToFoxglove(graph, places);
  ASSERT_TRUE(update);
  ASSERT_EQ(update->entities_size(), 1);
  const foxglove::SceneEntity& entity = update->entities(0);
  EXPECT_EQ(entity.id(), "graph") << "each one replaces the one before";
  EXPECT_EQ(entity.frame_id(), "W");
  ASSERT_EQ(entity.lines_size(), 4);
  std::set<double> reds;
  for (const foxglove::LinePrimitive& lines : entity.lines()) {
    EXPECT_EQ(lines.type(), foxglove::LinePrimitive::LINE_LIST);
    ASSERT_EQ(lines.points_size(), 2) << "8 is not known";
    EXPECT_EQ(lines.points(1).y(), 2);
    EXPECT_EQ(lines.color().a(), 1);
    reds.insert(lines.color().r());
  }
  EXPECT_EQ(reds.size(), 4u);
  EXPECT_EQ(ToFoxglove(graph_t{}, places)->entities(0).lines_size(), 0) << "and the edges are gone";
}

TEST(FoxgloveMessagesTest, VoxelsAreCubesThatMoveWithTheirSubmapsFrame) {
  Random random(1, "voxels");
  // A line of occupied voxels, a speck, and one that is free.
  const SubmapPtr submap = MakeSubmap(
      7,
      GridOf(0.1,
             {{{1, 0, 0}, 60}, {{2, 0, 0}, 60}, {{3, 0, 0}, 60}, {{9, 9, 9}, 60}, {{2, 1, 0}, -9}}),
      random);
  const foxglove::SceneUpdate update = VoxelsOf(*submap, 0);
  ASSERT_EQ(update.entities_size(), 1);
  const foxglove::SceneEntity& entity = update.entities(0);
  EXPECT_EQ(entity.frame_id(), "M7");
  EXPECT_EQ(entity.id(), "M7");
  EXPECT_TRUE(entity.frame_locked());
  ASSERT_EQ(entity.cubes_size(), 1) << "the middle one alone has two neighbours";
  const foxglove::CubePrimitive& cube = entity.cubes(0);
  EXPECT_TRUE(PoseFrom(cube.pose()).isApprox(MakePose({0.25, 0.05, 0.05}), 1e-9));
  EXPECT_EQ(cube.size().z(), 0.1);
  EXPECT_EQ(cube.color().a(), 1);
  EXPECT_EQ(NoVoxels(5).deletions(0).type(), foxglove::SceneEntityDeletion::ALL);

  const auto frames = FrameOf(ToMessage(std::vector<SubmapPlace>{{7, kPose}}));
  ASSERT_TRUE(frames);
  ASSERT_EQ(frames->transforms_size(), 1);
  EXPECT_EQ(frames->transforms(0).parent_frame_id(), "W");
  EXPECT_EQ(frames->transforms(0).child_frame_id(), entity.frame_id());
  EXPECT_NEAR(frames->transforms(0).translation().y(), 2, 1e-12);
}

TEST(FoxgloveMessagesTest, HealthIsALevel) {
  status_t status{};
  status.process = "slam";
  status.health = "ok";
  EXPECT_EQ(ToFoxglove(status)->level(), foxglove::Log::INFO);
  status.health = "no map\xFF";
  EXPECT_EQ(ToFoxglove(status)->level(), foxglove::Log::WARNING);
  EXPECT_EQ(ToFoxglove(status)->name(), "slam");
  EXPECT_EQ(ToFoxglove(status)->message(), "no map?");
}

TEST(FoxgloveMessagesTest, NothingComesOfImpossibleValues) {
  EXPECT_FALSE(ToFoxglove(truth_t{})) << "a quaternion of zeros";
  EXPECT_FALSE(FrameOf(nav_t{}));
  EXPECT_FALSE(ToFoxglove(scan_t{}));
  EXPECT_FALSE(ToFoxglove(sonar_frame_t{}));
  plan_t plan{};
  plan.path = {{{1, kNan, 3}, 0}};
  EXPECT_FALSE(ToFoxglove(plan));
  submap_poses_t places = ToMessage(std::vector<SubmapPlace>{{0, Pose3::Identity()}});
  places.X_WM[0].position_m[2] = kNan;
  EXPECT_FALSE(ToFoxglove(places));
  EXPECT_FALSE(FrameOf(places));
}

TEST(FoxgloveMessagesTest, TimesStayWhatNanosecondsCanSay) {
  EXPECT_EQ(NanosecondsOf(1'700'000'000'123'456), 1'700'000'000'123'456'000u);
  EXPECT_EQ(NanosecondsOf(-5), 0u);
  EXPECT_EQ(NanosecondsOf(std::numeric_limits<std::int64_t>::max()), 9'223'372'036'854'775'000u);
}

}  // namespace
}  // namespace vog
