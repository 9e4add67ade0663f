#include "procs/slam/slam_node.h"

#include <gtest/gtest.h>

#include "lib/submap/octree_file.h"
#include "procs/map_service/map_service_node.h"
#include "procs/map_service/node_testing.h"

namespace vog {
namespace {

constexpr int kScansPerSubmap = 8;

class SlamNodeTest : public testing::Test {
 protected:
  SlamNodeTest() {
    map_settings_.map.directory = (folder_.path / "map").string();
    map_settings_.submap.voxel_size_m = 0.15;
    map_settings_.submap.scans_per_submap = kScansPerSubmap;
    map_settings_.run_id = settings_.run_id = Bench::kRun;
  }

  void StartMapService() {
    map_service_.reset();
    map_service_ = std::make_unique<Process<MapServiceNode>>(bench_.queue, ++epoch_, map_settings_);
  }
  void StartSlam() {
    dut_.reset();
    dut_ = std::make_unique<Process<SlamNode>>(bench_.queue, ++epoch_, settings_);
  }

  /// The submaps that the scans so far give, as they come out of messages.
  std::vector<SubmapPtr> Submaps() const {
    SubmapBuilder builder(map_settings_.submap, map_settings_.sensor_model, map_settings_.drift);
    std::vector<SubmapPtr> submaps;
    for (const RegisteredScan& registered : vehicle_.registered)
      if (const SubmapPtr closed = builder.Add(registered)) submaps.push_back(closed);
    return submaps;
  }
  /// What Slam itself makes of them.
  std::unique_ptr<Slam> Expected() const {
    auto slam = std::make_unique<Slam>(settings_.slam);
    for (const SubmapPtr& submap : Submaps()) slam->AddSubmap(submap);
    return slam;
  }
  void ExpectSolution(const Slam& expected) const {
    const submap_poses_t poses = bench_.Last(outputs::kSubmapPoses);
    ASSERT_EQ(poses.count, static_cast<int>(expected.X_WM().size()));
    for (int i = 0; i < poses.count; ++i) {
      const NodeId id = poses.submap_id[i];
      EXPECT_TRUE(FromMessage(poses.X_WM[i])->isApprox(expected.X_WM().at(id), 1e-6)) << id;
      const PlaceCovariance& covariance = expected.covariances().at(id);
      EXPECT_LT((*FromMessage(poses.covariance_WM[i]) - covariance.of_X_WM).norm(), 1e-5);
      EXPECT_LT((*FromMessage(poses.covariance_MN[i]) - covariance.of_X_MN).norm(), 1e-5);
    }
  }

  // Without a map service: what it would say.
  void SaySubmap(const Submap& submap) {
    const submap_t message = ToMessage(submap, ToOctree(submap));
    bench_.SayLarge(outputs::kSubmap, submap.id(), ContentChecksum(message), message,
                    bench_.queue.now());
    bench_.RunFor(Duration(0));
  }
  static std::string ToOctree(const Submap& submap) { return ToOctreeBytes(submap.grid); }
  void SayMapStatus(const std::vector<SubmapPtr>& submaps) {
    map_status_t status{};
    status.submaps = static_cast<int>(submaps.size());
    for (const SubmapPtr& submap : submaps)
      status.digest =
          AppendToDigest(status.digest, ContentChecksum(ToMessage(*submap, ToOctree(*submap))));
    status.open = ToMessage(SubmapBase{});
    bench_.Say(outputs::kMapStatus, status, bench_.queue.now());
    bench_.RunFor(Duration(0));
  }

  TestFolder folder_;
  Bench bench_;
  CirclingVehicle vehicle_{bench_};
  MapServiceSettings map_settings_;
  SlamNodeSettings settings_;
  std::unique_ptr<Process<MapServiceNode>> map_service_;
  std::unique_ptr<Process<SlamNode>> dut_;
  std::int64_t epoch_ = 10;
};

TEST_F(SlamNodeTest, TellsWhatSlamMakesOfTheSubmaps) {
  StartMapService();
  StartSlam();
  vehicle_.Drive(5 * kScansPerSubmap);
  const auto told = bench_.Said(outputs::kSubmapPoses);
  ASSERT_EQ(told.size(), 5u);
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(told[i].version, i + 1);
    EXPECT_EQ(told[i].count, i + 1);
  }
  const auto expected = Expected();
  ExpectSolution(*expected);
  EXPECT_EQ(bench_.Last(outputs::kRevisits).version, 5);
  const auto revisits = FromMessage(bench_.Last(outputs::kRevisits));
  ASSERT_TRUE(revisits);
  EXPECT_EQ(revisits->size(), expected->ExpectedRevisits().size());
  for (const auto& [id, gain] : expected->ExpectedRevisits())
    EXPECT_NEAR(revisits->at(id), gain, 1e-5);
  const graph_t graph = bench_.Last(outputs::kGraph);
  EXPECT_EQ(graph.version, 5);
  EXPECT_EQ(graph.count, static_cast<int>(4 + expected->closures().size()));
  int odometry = 0, rejected = 0, accepted = 0;
  for (const graph_edge_t& edge : graph.edge) {
    odometry += edge.kind == 0;
    accepted += edge.kind == 1 || edge.kind == 2;
    rejected += edge.kind == 3;
    EXPECT_EQ(edge.kind == 3, !edge.reason.empty());
    if (edge.kind == 0) {
      EXPECT_EQ(edge.to_id, edge.from_id + 1);
    }
  }
  EXPECT_EQ(odometry, 4);
  EXPECT_EQ(accepted + 4, static_cast<int>(expected->graph().constraints().size()));
  EXPECT_EQ(accepted + rejected, static_cast<int>(expected->closures().size()));
  EXPECT_EQ(bench_.StatusOf("vog-slam").health, "ok");
}

TEST_F(SlamNodeTest, PoseIsTheOdometryMovedWithTheNewestSubmap) {
  StartMapService();
  StartSlam();
  vehicle_.Drive(4 * kScansPerSubmap + 3);
  const auto slam = Expected();
  const OdometrySample base = Submaps().back()->base.odometry;
  const Pose3 X_WO = slam->X_WM().at(3) * base.X_OB.inverse();
  const pose_estimate_t pose = bench_.Last(outputs::kPose);
  EXPECT_EQ(TimeOf(pose.header), vehicle_.end());
  EXPECT_EQ(pose.version, 4);
  EXPECT_EQ(pose.segment, vehicle_.segment);
  EXPECT_TRUE(FromMessage(pose.X_WO)->isApprox(X_WO, 1e-6));
  EXPECT_TRUE(
      FromMessage(pose.X_WB)->isApprox(X_WO * CirclingVehicle::PoseAt(vehicle_.end()), 1e-6));
  EXPECT_TRUE(MatrixFrom<3>(pose.covariance_xyyaw)
                  .isApprox(MotionCovariance(base, vehicle_.SampleAt(vehicle_.end())), 1e-6));
  // To first order, in the world's axes: the place of the submap, and its heading's lever.
  const Mat6 of_WB = *FromMessage(pose.covariance_WB);
  const Mat6& of_WM = slam->covariances().at(3).of_X_WM;
  EXPECT_GT(HorizontalSigma(of_WB), HorizontalSigma(of_WM));
  EXPECT_NEAR(of_WB(5, 5), of_WM(5, 5) + MatrixFrom<3>(pose.covariance_xyyaw)(2, 2), 1e-6);
}

TEST_F(SlamNodeTest, BeforeTheFirstSubmapTheWorldIsTheOdometrys) {
  StartMapService();
  StartSlam();
  vehicle_.Drive(3);
  const pose_estimate_t pose = bench_.Last(outputs::kPose);
  EXPECT_TRUE(FromMessage(pose.X_WB)->isApprox(CirclingVehicle::PoseAt(TimeOf(pose.header)), 1e-9));
}

TEST_F(SlamNodeTest, ANewNavigationSegmentHangsOnTheOpenSubmap) {
  StartMapService();
  StartSlam();
  vehicle_.Drive(kScansPerSubmap + 3);
  bench_.Forget();
  vehicle_.segment += 1;
  vehicle_.Drive(4);
  const auto poses = bench_.Said(outputs::kPose);
  ASSERT_FALSE(poses.empty());
  EXPECT_EQ(poses.back().segment, vehicle_.segment);
  // The vehicle stood still in the meantime, as far as the edge knows.
  const auto slam = Expected();
  const SubmapBase open = *FromMessage(bench_.Last(outputs::kMapStatus).open);
  EXPECT_EQ(open.odometry.segment, vehicle_.segment);
  const Pose3 X_WM = slam->X_WM().rbegin()->second * open.edge.X_PM;
  const Pose3 expected =
      X_WM * open.odometry.X_OB.inverse() * CirclingVehicle::PoseAt(vehicle_.end());
  EXPECT_TRUE(FromMessage(poses.back().X_WB)->isApprox(expected, 1e-6));
}

TEST_F(SlamNodeTest, ANewSegmentWithoutASubmapGoesOnWhereTheVehicleWas) {
  map_settings_.mission.max_submaps = 2;
  StartMapService();
  StartSlam();
  vehicle_.Drive(2 * kScansPerSubmap + 3);
  const pose_estimate_t before = bench_.Last(outputs::kPose);
  vehicle_.segment += 1;
  bench_.Forget();
  vehicle_.Drive(4);
  EXPECT_FALSE(bench_.Last(outputs::kMapStatus).has_open);
  const auto poses = bench_.Said(outputs::kPose);
  ASSERT_EQ(poses.size(), 8u) << "with each NAV";
  const Pose3 first = *FromMessage(poses.front().X_WB);
  EXPECT_LT((first.translation() - FromMessage(before.X_WB)->translation()).norm(), 0.01);
  EXPECT_GT(poses.front().covariance_xyyaw[0], before.covariance_xyyaw[0] + 1e-4);
  EXPECT_GT(poses.front().covariance_WB.upper[0], before.covariance_WB.upper[0] + 1e-4);
  // From there on by odometry, also for a SLAM that is started then.
  const Pose3 moved = Ominus(CirclingVehicle::PoseAt(TimeOf(poses.front().header)),
                             CirclingVehicle::PoseAt(vehicle_.end()));
  EXPECT_TRUE(FromMessage(poses.back().X_WB)->isApprox(first * moved, 1e-6));
  StartSlam();
  bench_.Forget();
  vehicle_.Drive(15);
  ASSERT_FALSE(bench_.Said(outputs::kPose).empty());
  const pose_estimate_t late = bench_.Said(outputs::kPose).front();
  EXPECT_LT((FromMessage(late.X_WB)->translation() - first.translation()).norm(), 1);
}

// The vehicle may even reckon on in the old segment, wherever it was carried meanwhile.
TEST_F(SlamNodeTest, AFlightOnAnEarlierMapHangsOnTheSubmapThatItBeganWith) {
  StartMapService();
  StartSlam();
  vehicle_.Drive(2 * kScansPerSubmap);
  const auto old = Expected();
  mission_status_t finished{};
  finished.state = "finished";
  bench_.Say(outputs::kMissionStatus, finished, bench_.queue.now());
  bench_.RunFor(std::chrono::seconds(2));
  ASSERT_TRUE(bench_.Last(outputs::kMapStatus).complete);
  map_settings_.map.resume = map_settings_.map.directory;
  map_settings_.map.directory = (folder_.path / "new").string();
  map_service_.reset();
  StartSlam();
  StartMapService();
  bench_.RunFor(std::chrono::seconds(4));
  bench_.Forget();
  vehicle_.Drive(40);  // It is told late, until it has caught up with the bus.
  const auto poses = bench_.Said(outputs::kPose);
  ASSERT_FALSE(poses.empty());
  SubmapBase base;
  for (const map_status_t& status : bench_.Said(outputs::kMapStatus))
    if (status.has_open && status.open.submap_id == 2) base = *FromMessage(status.open);
  ASSERT_EQ(base.id, 2);
  const Pose3 X_WM = old->X_WM().at(1) * base.edge.X_PM;
  for (const pose_estimate_t& pose : poses) {
    if (pose.version > 2) break;  // Its first submap is closed.
    const Pose3 moved = Ominus(base.odometry.X_OB, CirclingVehicle::PoseAt(TimeOf(pose.header)));
    EXPECT_TRUE(FromMessage(pose.X_WB)->isApprox(X_WM * moved, 1e-6));
    EXPECT_GT(pose.covariance_xyyaw[0], std::pow(map_settings_.put_in.sigma_m, 2));
  }
}

TEST_F(SlamNodeTest, WithoutAMapItTellsNoPose) {
  StartSlam();
  vehicle_.Drive(5);
  EXPECT_TRUE(bench_.Said(outputs::kPose).empty());
  bench_.RunFor(std::chrono::seconds(1));
  EXPECT_EQ(bench_.StatusOf("vog-slam").health, "waiting for submaps");
}

TEST_F(SlamNodeTest, WhoComesLateFindsTheSameSolution) {
  StartMapService();
  vehicle_.Drive(4 * kScansPerSubmap);
  EXPECT_TRUE(bench_.Said(outputs::kSubmapPoses).empty());
  StartSlam();
  bench_.RunFor(std::chrono::seconds(5));
  ExpectSolution(*Expected());
}

TEST_F(SlamNodeTest, RestartGetsAllFromTheMapService) {
  StartMapService();
  StartSlam();
  vehicle_.Drive(3 * kScansPerSubmap);
  const submap_poses_t before = bench_.Last(outputs::kSubmapPoses);
  StartSlam();
  bench_.Forget();
  bench_.RunFor(std::chrono::seconds(4));
  const submap_poses_t after = bench_.Last(outputs::kSubmapPoses);
  EXPECT_GT(after.header.epoch, before.header.epoch);
  ASSERT_EQ(after.count, 3);
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(FromMessage(after.X_WM[i])->isApprox(*FromMessage(before.X_WM[i]), 1e-9));
  }
  // And the map service follows it.
  EXPECT_EQ(bench_.Last(outputs::kMapStatus).poses_version, after.version);
}

TEST_F(SlamNodeTest, RestartOfTheMapServiceChangesNothing) {
  StartMapService();
  StartSlam();
  vehicle_.Drive(3 * kScansPerSubmap + 2);
  const std::int64_t version = bench_.Last(outputs::kSubmapPoses).version;
  StartMapService();
  bench_.Forget();
  vehicle_.Drive(kScansPerSubmap + 2);
  const auto told = bench_.Said(outputs::kSubmapPoses);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].version, version + 1);
  EXPECT_EQ(told[0].count, 4);
}

TEST_F(SlamNodeTest, LostChunksComeAgain) {
  StartMapService();
  Random random(1, "loss");
  ProcessBus bus(bench_.queue, "dut", ++epoch_, [&](const std::string& channel, Bytes) {
    return channel == outputs::kSubmap.name && random.Chance(0.4);
  });
  const SlamNode dut(bus, settings_);
  vehicle_.Drive(5 * kScansPerSubmap);
  bench_.RunFor(std::chrono::seconds(60));
  ExpectSolution(*Expected());
}

TEST_F(SlamNodeTest, SubmapsWaitForTheirPredecessors) {
  vehicle_.Drive(3 * kScansPerSubmap);
  const auto submaps = Submaps();
  StartSlam();
  SaySubmap(*submaps[2]);
  SaySubmap(*submaps[1]);
  EXPECT_TRUE(bench_.Said(outputs::kSubmapPoses).empty());
  SaySubmap(*submaps[0]);
  EXPECT_EQ(bench_.Said(outputs::kSubmapPoses).size(), 1u);
  ExpectSolution(*Expected());
}

TEST_F(SlamNodeTest, ASubmapToldTwiceChangesNothing) {
  vehicle_.Drive(2 * kScansPerSubmap);
  const auto submaps = Submaps();
  StartSlam();
  for (const SubmapPtr& submap : {submaps[0], submaps[0], submaps[1], submaps[0], submaps[1]})
    SaySubmap(*submap);
  EXPECT_EQ(bench_.Said(outputs::kSubmapPoses).size(), 2u);
  ExpectSolution(*Expected());
}

TEST_F(SlamNodeTest, AnotherMapBeginsAnew) {
  vehicle_.Drive(3 * kScansPerSubmap);
  const auto submaps = Submaps();
  StartSlam();
  for (const SubmapPtr& submap : submaps) SaySubmap(*submap);
  // The service has lost the last two, and builds another submap 1.
  SayMapStatus({submaps[0]});
  auto other = std::make_shared<Submap>(*submaps[2]);
  other->base.id = 1;
  other->base.edge.X_PM = Ominus(submaps[0]->base.odometry.X_OB, other->base.odometry.X_OB);
  bench_.Forget();
  SaySubmap(*submaps[0]);
  SaySubmap(*other);
  Slam expected(settings_.slam);
  expected.AddSubmap(submaps[0]);
  expected.AddSubmap(other);
  ExpectSolution(expected);
  EXPECT_GT(bench_.Last(outputs::kSubmapPoses).version, 3) << "versions grow over a reset";
}

TEST_F(SlamNodeTest, TellsThePosesAgainToWhoAsks) {
  StartMapService();
  StartSlam();
  map_request_t request{};
  request.kind = "poses";
  bench_.Say(outputs::kMapRequest, request, bench_.queue.now());
  bench_.RunFor(Duration(0));
  EXPECT_TRUE(bench_.Said(outputs::kSubmapPoses).empty()) << "there are none yet";
  vehicle_.Drive(2 * kScansPerSubmap);
  const submap_poses_t before = bench_.Last(outputs::kSubmapPoses);
  bench_.Forget();
  bench_.Say(outputs::kMapRequest, request, bench_.queue.now());
  bench_.RunFor(Duration(0));
  EXPECT_EQ(bench_.Last(outputs::kSubmapPoses).version, before.version);
  EXPECT_EQ(bench_.Last(outputs::kGraph).version, before.version);
}

TEST_F(SlamNodeTest, DamagedBytesAreCountedAndHarmless) {
  StartMapService();
  StartSlam();
  vehicle_.Drive(2 * kScansPerSubmap);
  Random random(2, "damage");
  int damaged = SayDamaged(bench_, outputs::kNav, ToMessage(vehicle_.SampleAt({})), random);
  damaged += SayDamaged(bench_, outputs::kMapStatus, bench_.Last(outputs::kMapStatus), random);
  chunk_t chunk = bench_.Last(outputs::kSubmap);
  damaged += SayDamaged(bench_, outputs::kSubmap, chunk, random);
  // Whole chunks with a wrong content.
  chunk.header = bench_.NextHeader(outputs::kSubmap.name, bench_.queue.now());
  chunk.header.epoch += 1000;
  chunk.item = -5;
  bench_.SayAsIs(outputs::kSubmap, chunk, bench_.queue.now());
  chunk.header.sequence += 1;
  chunk.item = 2;
  chunk.parts = 1;
  chunk.part = 0;
  chunk.bytes[0] ^= 1;
  bench_.SayAsIs(outputs::kSubmap, chunk, bench_.queue.now());
  nav_t nav = ToMessage(vehicle_.SampleAt(vehicle_.end()));
  nav.X_OB.quaternion_wxyz[0] = 0;
  nav.header = bench_.NextHeader(outputs::kNav.name, vehicle_.end());
  nav.header.epoch = vehicle_.segment;
  bench_.SayAsIs(outputs::kNav, nav, vehicle_.end());
  vehicle_.Drive(2 * kScansPerSubmap);
  bench_.RunFor(std::chrono::seconds(1));
  ExpectSolution(*Expected());
  EXPECT_EQ(bench_.CounterOf("vog-slam", "malformed") + bench_.CounterOf("vog-slam", "other_run"),
            damaged + 2);
  EXPECT_EQ(bench_.CounterOf("vog-slam", "chunks_dropped"), 1);
}

TEST(SlamNodeSettingsTest, ModeWithoutClosuresSwitchesThemOff) {
  EXPECT_TRUE(SlamNodeSettings::From(Config::Parse("", "a")).slam.slam.loop_closures);
  EXPECT_FALSE(SlamNodeSettings::From(Config::Parse("[mission]\nmode = 'vog-no-lc'", "a"))
                   .slam.slam.loop_closures);
}

}  // namespace
}  // namespace vog
