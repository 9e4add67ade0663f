#include "procs/map_service/map_service_node.h"

#include <gtest/gtest.h>

#include <fstream>

#include "lib/messages/submap_receiver.h"
#include "lib/submap/octree_file.h"
#include "lib/vogmap/map_folder_testing.h"
#include "lib/vogmap/merged_grid.h"
#include "procs/map_service/earlier_map.h"
#include "procs/map_service/node_testing.h"

namespace vog {
namespace {

constexpr int kScansPerSubmap = 8;

class MapServiceNodeTest : public testing::Test {
 protected:
  MapServiceNodeTest() {
    settings_.map.directory = (folder_.path / "map").string();
    settings_.submap.voxel_size_m = 0.15;
    settings_.submap.scans_per_submap = kScansPerSubmap;
    settings_.run_id = Bench::kRun;
    Start();
  }

  void Start() {
    dut_.reset();
    dut_ = std::make_unique<Process<MapServiceNode>>(bench_.queue, ++epoch_, settings_);
  }

  /// The submaps that the scans so far must give.
  std::vector<SubmapPtr> ExpectedSubmaps() const {
    SubmapBuilder builder(settings_.submap, settings_.sensor_model, settings_.drift);
    std::vector<SubmapPtr> submaps;
    for (const RegisteredScan& registered : vehicle_.registered)
      if (const SubmapPtr closed = builder.Add(registered)) submaps.push_back(closed);
    return submaps;
  }
  std::vector<SubmapPtr> ToldSubmaps() const {
    std::vector<SubmapPtr> submaps;
    for (const submap_t& message : bench_.SaidLarge<submap_t>(outputs::kSubmap)) {
      const auto submap = FromMessage(message);
      EXPECT_TRUE(submap.has_value());
      if (submap) submaps.push_back(*submap);
    }
    return submaps;
  }
  std::vector<SubmapId> ToldIds() const {
    std::vector<SubmapId> ids;
    for (const SubmapPtr& submap : ToldSubmaps()) ids.push_back(submap->id());
    return ids;
  }

  static Pose3 SlamPoseOf(SubmapId id) {
    return MakePose({0.3 * id, -0.2 * id, 0.02 * id}, {0, 0, 0.4 * id});
  }
  void SayPoses(int submaps, std::int64_t version) {
    std::vector<SubmapPlace> places;
    for (SubmapId id = 0; id < submaps; ++id) places.push_back({id, SlamPoseOf(id)});
    submap_poses_t poses = ToMessage(places);
    poses.version = version;
    bench_.Say(outputs::kSubmapPoses, poses, bench_.queue.now());
    bench_.RunFor(Duration(0));
  }
  void SayGraph(std::int64_t version, std::vector<graph_edge_t> edges = {}) {
    graph_t graph{};
    graph.version = version;
    graph.count = static_cast<int>(edges.size());
    graph.edge = std::move(edges);
    bench_.Say(outputs::kGraph, graph, bench_.queue.now());
    bench_.RunFor(Duration(0));
  }
  void SayFinished() {
    mission_status_t status{};
    status.state = "finished";
    bench_.Say(outputs::kMissionStatus, status, bench_.queue.now());
    bench_.RunFor(Duration(0));
  }
  map_reply_t Ask(map_request_t request) {
    request.request_id = ++request_id_;
    bench_.Say(outputs::kMapRequest, request, bench_.queue.now());
    bench_.RunFor(Duration(0));
    const auto replies = bench_.SaidLarge<map_reply_t>(outputs::kMapReply);
    EXPECT_FALSE(replies.empty());
    if (replies.empty()) return {};
    EXPECT_EQ(replies.back().request_id, request_id_);
    return replies.back();
  }
  static map_request_t Points(const std::vector<Vec3>& points, const std::string& kind,
                              const std::string& method = "cached") {
    map_request_t request{};
    request.kind = kind;
    request.method = method;
    for (const Vec3& p : points) request.point_W_m.push_back({p.x(), p.y(), p.z()});
    request.points = static_cast<int>(points.size());
    return request;
  }
  static map_request_t Ray(const Vec3& origin_W, const Vec3& direction_W, double range_m) {
    map_request_t request{};
    request.kind = "ray";
    request.method = "cached";
    std::copy_n(origin_W.data(), 3, request.origin_W_m);
    std::copy_n(direction_W.data(), 3, request.direction_W);
    request.range_m = range_m;
    return request;
  }
  map_status_t Status() const { return bench_.Last(outputs::kMapStatus); }

  TestFolder folder_;
  Bench bench_;
  CirclingVehicle vehicle_{bench_};
  MapServiceSettings settings_;
  std::unique_ptr<Process<MapServiceNode>> dut_;
  std::int64_t epoch_ = 10, request_id_ = 0;
};

void ExpectSame(const Submap& a, const Submap& b) {
  EXPECT_EQ(a.id(), b.id());
  EXPECT_EQ(a.scans, b.scans);
  EXPECT_EQ(a.first_scan, b.first_scan);
  EXPECT_EQ(a.last_scan, b.last_scan);
  EXPECT_TRUE(a.base.odometry.X_OB.isApprox(b.base.odometry.X_OB, 1e-9));
  EXPECT_TRUE(a.base.edge.X_PM.isApprox(b.base.edge.X_PM, 1e-9));
  EXPECT_TRUE(a.base.edge.covariance.isApprox(b.base.edge.covariance, 1e-6));
  EXPECT_EQ(ToOctreeBytes(a.grid), ToOctreeBytes(b.grid));
}

void ExpectSameAnswers(const std::vector<float>& a, const std::vector<float>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    EXPECT_TRUE(a[i] == b[i] || (!IsKnown(a[i]) && !IsKnown(b[i]))) << a[i] << " " << b[i];
}

TEST_F(MapServiceNodeTest, TellsEachSubmapThatTheScansFill) {
  vehicle_.Drive(3 * kScansPerSubmap + 2);
  const auto expected = ExpectedSubmaps();
  const auto told = ToldSubmaps();
  ASSERT_EQ(expected.size(), 3u);
  ASSERT_EQ(told.size(), 3u);
  for (int i = 0; i < 3; ++i) ExpectSame(*told[i], *expected[i]);
  EXPECT_EQ(Status().submaps, 3);
  EXPECT_TRUE(Status().has_open);
  EXPECT_EQ(Status().open.submap_id, 3);
  EXPECT_FALSE(Status().complete);
  EXPECT_EQ(Status().fault, "");
}

TEST_F(MapServiceNodeTest, DigestIsThatOfTheSubmapsTold) {
  vehicle_.Drive(2 * kScansPerSubmap);
  std::int64_t digest = 0;
  for (const chunk_t& chunk : bench_.Said(outputs::kSubmap))
    if (chunk.part == 0) digest = AppendToDigest(digest, static_cast<std::uint32_t>(chunk.version));
  EXPECT_EQ(Status().digest, digest);
}

TEST_F(MapServiceNodeTest, SavesEachSubmapBeforeItIsTold) {
  int told = 0;
  bench_.queue.Observe([&](Time, const std::string& channel, Bytes) {
    if (channel != outputs::kSubmap.name) return;
    const LoadedMap loaded = LoadMapFolder(settings_.map.directory);
    EXPECT_TRUE(loaded.faults.empty());
    EXPECT_GE(loaded.map.submaps.size(), 1u);
    ++told;
  });
  vehicle_.Drive(2 * kScansPerSubmap);
  EXPECT_GE(told, 2);
  const LoadedMap loaded = LoadMapFolder(settings_.map.directory);
  const auto expected = ExpectedSubmaps();
  ASSERT_EQ(loaded.map.submaps.size(), 2u);
  for (int i = 0; i < 2; ++i) ExpectSame(*loaded.map.submaps[i], *expected[i]);
  EXPECT_EQ(loaded.map.run_id, Bench::kRun);
}

class MapServiceQueryTest : public MapServiceNodeTest {
 protected:
  MapServiceQueryTest() : map_(settings_.submap.voxel_size_m, SensorModel(settings_.sensor_model)) {
    vehicle_.Drive(3 * kScansPerSubmap);
    SayPoses(3, 5);
    for (const SubmapPtr& submap : ExpectedSubmaps()) map_.Place(submap, SlamPoseOf(submap->id()));
  }

  VogMap map_;
};

TEST_F(MapServiceQueryTest, AnswersPointsAsTheMapDoes) {
  Random random(1, "query");
  std::vector<Vec3> points;
  for (int i = 0; i < 3000; ++i) points.push_back(random.GaussianVector({2, 2, 1}));
  const map_reply_t direct = Ask(Points(points, "points", "direct"));
  std::vector<float> expected(points.size());
  map_.LogOddsAt(points, expected);
  ExpectSameAnswers(direct.log_odds, expected);
  EXPECT_EQ(direct.poses_version, 5);
  EXPECT_EQ(direct.error, "");
  EXPECT_GT(std::count_if(expected.begin(), expected.end(), IsKnown), 200);

  const map_reply_t cached = Ask(Points(points, "points", "cached"));
  std::vector<VoxelKey> voxels;
  for (const Vec3& p : points) voxels.push_back(map_.grid().KeyOf(p));
  map_.LogOddsOf(voxels, expected);
  ExpectSameAnswers(cached.log_odds, expected);
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_NEAR(cached.center_W_m[i][0], map_.grid().CenterOf(voxels[i]).x(), 1e-5);
}

TEST_F(MapServiceQueryTest, CastsRaysAsTheMapDoes) {
  Random random(2, "query");
  for (int i = 0; i < 30; ++i) {
    const Vec3 direction_W = random.GaussianVector(Vec3::Ones());
    const map_reply_t reply = Ask(Ray({0.2, 0.1, 0}, direction_W, 4));
    std::vector<RayVoxel> ray;
    map_.CastRay({0.2, 0.1, 0}, direction_W.normalized(), 4, ray);
    std::vector<float> expected;
    for (const RayVoxel& voxel : ray) expected.push_back(voxel.log_odds);
    ExpectSameAnswers(reply.log_odds, expected);
  }
}

TEST_F(MapServiceQueryTest, DirectRaysAskTheMapStepByStep) {
  map_request_t request = Ray({0.2, 0.1, 0}, {1, 2, 0.3}, 3);
  request.method = "direct";
  const map_reply_t reply = Ask(request);
  const double step_m = map_.grid().voxel_size_m();
  for (std::size_t i = 0; i < reply.log_odds.size(); ++i) {
    const Vec3 p_W =
        Vec3(0.2, 0.1, 0) + step_m * static_cast<double>(i + 1) * Vec3(1, 2, 0.3).normalized();
    float expected;
    map_.LogOddsAt({&p_W, 1}, {&expected, 1});
    ExpectSameAnswers({reply.log_odds[i]}, {expected});
    EXPECT_EQ(map_.IsOccupied(expected), i + 1 == reply.log_odds.size());
  }
  EXPECT_GT(reply.count, 5);
}

TEST_F(MapServiceQueryTest, ReadsBoxesAsTheMapDoesWhateverTheOrderOfTheCorners) {
  const Vec3 a(-1, -2, -0.5), b(3.3, 2, 1);
  std::vector<float> expected;
  map_.LogOddsIn(VoxelsOf(map_.grid(), {a, b}), expected);
  ExpectSameAnswers(Ask(Points({a, b}, "box")).log_odds, expected);
  ExpectSameAnswers(Ask(Points({b, a}, "box")).log_odds, expected);
  ExpectSameAnswers(Ask(Points({{a.x(), b.y(), a.z()}, {b.x(), a.y(), b.z()}}, "box")).log_odds,
                    expected);
}

TEST_F(MapServiceQueryTest, SnapshotIsTheMergedMap) {
  map_request_t request{};
  request.kind = "snapshot";
  const map_reply_t reply = Ask(request);
  const std::string expected = ToOctreeBytes(MergedGrid(map_));
  EXPECT_EQ(std::string(reply.octree.begin(), reply.octree.end()), expected);
}

TEST_F(MapServiceQueryTest, RefusesWhatCannotBeAnswered) {
  const auto error_of = [&](const map_request_t& request) { return Ask(request).error; };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(error_of(Points({{0, 0, nan}}, "points")).find("not finite"), std::string::npos);
  EXPECT_NE(error_of(Points({{0, 0, 1e300}}, "points")).find("too large"), std::string::npos);
  EXPECT_NE(error_of(Points({{0, 0, 0}}, "box")).find("two corners"), std::string::npos);
  EXPECT_NE(error_of(Points({{-9e4, -9e4, -9e4}, {9e4, 9e4, 9e4}}, "box")).find("at most"),
            std::string::npos);
  EXPECT_NE(error_of(Ray({0, 0, 0}, {0, 0, 0}, 4)).find("no direction"), std::string::npos);
  EXPECT_NE(error_of(Ray({0, 0, 0}, {1, 0, 0}, nan)).find("not finite"), std::string::npos);
  EXPECT_NE(error_of(Ray({0, 0, 0}, {1, 0, 0}, 5e4)).find("at most"), std::string::npos);
  EXPECT_NE(error_of(Points({{0, 0, 0}}, "points", "guess")).find("direct or cached"),
            std::string::npos);
  EXPECT_NE(error_of(Points({}, "a poem")).find("kind must be one of"), std::string::npos);
  EXPECT_EQ(error_of(Points({{0, 0, 0}}, "points")), "");
}

TEST_F(MapServiceQueryTest, SendsSubmapsAgainToWhoAsks) {
  bench_.Forget();
  map_request_t request{};
  request.kind = "submaps";
  bench_.Say(outputs::kMapRequest, request, bench_.queue.now());
  bench_.RunFor(Duration(0));
  EXPECT_EQ(ToldIds(), (std::vector<SubmapId>{0, 1, 2}));
  bench_.Forget();
  request.submap_id = {1, 17, -4};
  request.ids = 3;
  bench_.Say(outputs::kMapRequest, request, bench_.queue.now());
  bench_.RunFor(Duration(0));
  EXPECT_EQ(ToldIds(), (std::vector<SubmapId>{1}));
  ExpectSame(*ToldSubmaps()[0], *ExpectedSubmaps()[1]);
}

TEST_F(MapServiceQueryTest, ShowsTheOpenSubmapBehindTheLastClosedOne) {
  vehicle_.Drive(kScansPerSubmap - 1);
  SubmapBuilder builder(settings_.submap, settings_.sensor_model, settings_.drift);
  for (const RegisteredScan& registered : vehicle_.registered) builder.Add(registered);
  ASSERT_NE(builder.open(), nullptr);
  map_.SetOpen(&builder.open()->grid, SlamPoseOf(2) * builder.open()->base.edge.X_PM);
  const Vec3 a(-2, -2, -0.5), b(3.3, 2, 1);
  std::vector<float> expected;
  map_.LogOddsIn(VoxelsOf(map_.grid(), {a, b}), expected);
  ExpectSameAnswers(Ask(Points({a, b}, "box")).log_odds, expected);
}

TEST_F(MapServiceNodeTest, StaleOrForeignPosesMoveNothing) {
  vehicle_.Drive(2 * kScansPerSubmap);
  SayPoses(2, 4);
  const auto answer = [&] { return Ask(Points({{-2, -2, 0}, {3, 2, 0.3}}, "box")); };
  const map_reply_t before = answer();
  EXPECT_EQ(before.poses_version, 4);

  submap_poses_t poses = ToMessage(std::vector<SubmapPlace>{{0, MakePose({50, 0, 0})}});
  poses.version = 9;
  const auto say_with = [&](auto change) {
    submap_poses_t message = poses;
    message.header = bench_.NextHeader(outputs::kSubmapPoses.name, bench_.queue.now());
    change(message);
    bench_.SayAsIs(outputs::kSubmapPoses, message, bench_.queue.now());
    bench_.RunFor(Duration(0));
    const map_reply_t after = answer();
    EXPECT_EQ(after.poses_version, 4);
    ExpectSameAnswers(after.log_odds, before.log_odds);
  };
  say_with([](auto& message) { message.header.run_id += 1; });
  say_with([](auto& message) { message.header.epoch -= 1; });
  say_with([](auto& message) { message.header.sequence = 0; });
  say_with([](auto& message) { message.version = 4; });
  say_with([](auto& message) { message.version = 3; });
  say_with([](auto& message) { message.X_WM[0].quaternion_wxyz[0] = 2; });
  bench_.RunFor(std::chrono::seconds(1));
  EXPECT_EQ(bench_.CounterOf("vog-map-service", "other_run"), 1);
  EXPECT_EQ(bench_.CounterOf("vog-map-service", "stale"), 2);
  EXPECT_EQ(bench_.CounterOf("vog-map-service", "malformed"), 1);

  // A restarted SLAM counts its versions anew.
  bench_.epoch += 1;
  SayPoses(2, 1);
  EXPECT_EQ(answer().poses_version, 1);
}

TEST_F(MapServiceNodeTest, DamagedBytesAreCountedAndHarmless) {
  vehicle_.Drive(kScansPerSubmap + 3);
  Random random(3, "damage");
  int damaged = 0;
  damaged += SayDamaged(bench_, outputs::kScan, ToMessage(vehicle_.registered[0].scan), random);
  damaged += SayDamaged(bench_, outputs::kNav, ToMessage(vehicle_.registered[0].odometry), random);
  damaged += SayDamaged(bench_, outputs::kSubmapPoses, submap_poses_t{}, random);
  damaged += SayDamaged(bench_, outputs::kGraph, graph_t{}, random);
  damaged += SayDamaged(bench_, outputs::kMissionStatus, mission_status_t{}, random);
  damaged += SayDamaged(bench_, outputs::kMapRequest, Points({{0, 0, 0}}, "points"), random);
  vehicle_.Drive(kScansPerSubmap);
  bench_.RunFor(std::chrono::seconds(1));
  EXPECT_EQ(bench_.CounterOf("vog-map-service", "malformed") +
                bench_.CounterOf("vog-map-service", "other_run"),
            damaged);
  const auto told = ToldSubmaps(), expected = ExpectedSubmaps();
  ASSERT_EQ(told.size(), 2u);
  for (int i = 0; i < 2; ++i) ExpectSame(*told[i], *expected[i]);
}

TEST_F(MapServiceNodeTest, ImpossibleValuesAreCountedAndHarmless) {
  vehicle_.Drive(3);
  scan_t scan = ToMessage(vehicle_.ScanAt(vehicle_.end(), 1));
  scan.range_m[3] = std::numeric_limits<float>::quiet_NaN();
  bench_.Say(outputs::kScan, scan, vehicle_.end() + Duration(1));
  nav_t nav = ToMessage(vehicle_.SampleAt(vehicle_.end()));
  nav.X_OB.position_m[1] = std::numeric_limits<double>::infinity();
  nav.header = bench_.NextHeader(outputs::kNav.name, vehicle_.end() + Duration(1));
  nav.header.epoch = vehicle_.segment;
  bench_.SayAsIs(outputs::kNav, nav, bench_.queue.now());
  vehicle_.Drive(kScansPerSubmap);
  bench_.RunFor(std::chrono::seconds(1));
  EXPECT_EQ(bench_.CounterOf("vog-map-service", "malformed"), 2);
  ASSERT_EQ(ToldSubmaps().size(), 1u);
  ExpectSame(*ToldSubmaps()[0], *ExpectedSubmaps()[0]);
}

// A leap of the odometry within one segment makes a submap larger than any table.
TEST_F(MapServiceNodeTest, SurvivesAPoseFarAway) {
  vehicle_.Drive(3);
  vehicle_.LeapFarAway();
  EXPECT_NO_THROW(bench_.RunFor(std::chrono::milliseconds(20)));
  EXPECT_NO_THROW(vehicle_.Drive(2 * kScansPerSubmap));
  EXPECT_GE(ToldSubmaps().size(), 1u);
}

TEST_F(MapServiceNodeTest, RestartGoesOnWithTheSavedMap) {
  vehicle_.Drive(2 * kScansPerSubmap + 3);
  SayPoses(2, 3);
  vehicle_.Drive(1);
  const map_status_t before = Status();
  const auto expected = ExpectedSubmaps();
  Start();
  bench_.Forget();
  vehicle_.Drive(10);
  EXPECT_EQ(bench_.Said(outputs::kMapStatus).front().submaps, 2);
  EXPECT_EQ(bench_.Said(outputs::kMapStatus).front().digest, before.digest);
  // The scans of the open submap are lost, its number is not.
  ASSERT_EQ(ToldIds(), (std::vector<SubmapId>{2}));
  const OdometrySample base = ToldSubmaps()[0]->base.odometry;
  EXPECT_TRUE(ToldSubmaps()[0]->base.edge.X_PM.isApprox(
      Ominus(expected[1]->base.odometry.X_OB, base.X_OB), 1e-9));
  bench_.Forget();
  map_request_t request{};
  request.kind = "submaps";
  request.submap_id = {0, 1};
  request.ids = 2;
  bench_.Say(outputs::kMapRequest, request, bench_.queue.now());
  bench_.RunFor(Duration(0));
  ASSERT_EQ(ToldIds(), (std::vector<SubmapId>{0, 1}));
  for (int i = 0; i < 2; ++i) ExpectSame(*ToldSubmaps()[i], *expected[i]);
}

TEST_F(MapServiceNodeTest, RestartWithADamagedSubmapGoesOnBeforeIt) {
  vehicle_.Drive(3 * kScansPerSubmap);
  std::ofstream(std::filesystem::path(settings_.map.directory) / "submaps" / "000001.ot")
      << "not an octree";
  Start();
  bench_.Forget();
  vehicle_.Drive(2 * kScansPerSubmap);
  EXPECT_EQ(bench_.Said(outputs::kMapStatus).front().submaps, 1);
  EXPECT_EQ(ToldIds().front(), 1);
  EXPECT_TRUE(LoadMapFolder(settings_.map.directory).faults.empty());
}

TEST_F(MapServiceNodeTest, RefusesTheMapOfAnotherRun) {
  vehicle_.Drive(kScansPerSubmap);
  settings_.run_id += 1;
  try {
    Start();
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find("the map of another run"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find(settings_.map.directory), std::string::npos);
  }
}

TEST_F(MapServiceNodeTest, RefusesAMapOfOtherVoxels) {
  vehicle_.Drive(kScansPerSubmap);
  settings_.submap.voxel_size_m = 0.2;
  EXPECT_THROW(Start(), UsageError);
}

TEST_F(MapServiceNodeTest, IsCompleteWhenEverySubmapOfAFinishedMissionHasItsPose) {
  vehicle_.Drive(2 * kScansPerSubmap + 3);
  SayPoses(2, 3);
  SayGraph(3);
  SayFinished();
  // The open submap was closed; SLAM has not answered for it yet.
  EXPECT_EQ(Status().submaps, 3);
  EXPECT_FALSE(Status().complete);
  SayPoses(3, 4);
  EXPECT_FALSE(LoadMapFolder(settings_.map.directory).map.complete);
  graph_edge_t edge{};
  edge.from_id = 0;
  edge.to_id = 2;
  edge.kind = 1;
  edge.X_ik = ToMessage(MakePose({1, 2, 3}));
  CopyMatrix<6>(4 * Mat6::Identity(), edge.information);
  graph_edge_t rejected = edge;
  rejected.kind = 3;
  SayGraph(4, {edge, rejected});
  EXPECT_TRUE(Status().complete);
  const LoadedMap loaded = LoadMapFolder(settings_.map.directory);
  EXPECT_TRUE(loaded.map.complete);
  EXPECT_TRUE(loaded.faults.empty());
  ASSERT_EQ(loaded.map.submaps.size(), 3u);
  EXPECT_EQ(loaded.map.submaps[2]->scans, 3);
  for (SubmapId id = 0; id < 3; ++id)
    EXPECT_TRUE(loaded.map.X_WM.at(id).isApprox(SlamPoseOf(id), 1e-9));
  EXPECT_NE(loaded.map.graph_g2o.find("EDGE_SE3:QUAT 0 2 1 2 3 "), std::string::npos);
  EXPECT_EQ(loaded.map.graph_g2o.find("EDGE_SE3:QUAT"),
            loaded.map.graph_g2o.rfind("EDGE_SE3:QUAT"));

  // Nothing changes the finished map.
  vehicle_.Drive(2 * kScansPerSubmap);
  EXPECT_EQ(Status().submaps, 3);
  EXPECT_TRUE(Status().complete);
}

// The planner may be behind: more than the budget is never built.
TEST_F(MapServiceNodeTest, KeepsTheBudgetByItself) {
  settings_.mission.max_submaps = 2;
  Start();
  vehicle_.Drive(5 * kScansPerSubmap);
  EXPECT_EQ(Status().submaps, 2);
  EXPECT_FALSE(Status().has_open);
  SayPoses(2, 3);
  SayGraph(3);
  EXPECT_FALSE(Status().complete);
  SayFinished();
  EXPECT_TRUE(Status().complete);
  EXPECT_EQ(LoadMapFolder(settings_.map.directory).map.submaps.size(), 2u);
}

TEST_F(MapServiceNodeTest, RestartAfterTheEndStillCompletes) {
  vehicle_.Drive(2 * kScansPerSubmap);
  SayPoses(2, 3);
  Start();
  bench_.Forget();
  SayFinished();
  // It has to ask for the poses: SLAM told them before.
  bench_.RunFor(std::chrono::seconds(3));
  const auto requests = bench_.Said(outputs::kMapRequest);
  ASSERT_FALSE(requests.empty());
  EXPECT_EQ(requests.back().kind, "poses");
  SayPoses(2, 3);
  SayGraph(3);
  EXPECT_TRUE(Status().complete);
}

TEST_F(MapServiceNodeTest, CompleteMapStaysCompleteOverARestart) {
  vehicle_.Drive(kScansPerSubmap);
  SayPoses(1, 1);
  SayGraph(1);
  SayFinished();
  ASSERT_TRUE(Status().complete);
  Start();
  bench_.Forget();
  vehicle_.Drive(2 * kScansPerSubmap);
  EXPECT_EQ(Status().submaps, 1);
  EXPECT_TRUE(Status().complete);
  EXPECT_TRUE(ToldIds().empty());
}

/// A finished map of two submaps, and a new mission that goes on from it.
class MapServiceResumeTest : public MapServiceNodeTest {
 protected:
  MapServiceResumeTest() {
    vehicle_.Drive(2 * kScansPerSubmap);
    SayPoses(2, 3);
    SayGraph(3);
    vehicle_.Drive(3);  // The open submap is of the budget's rest, and dropped.
    mission_status_t status{};
    status.state = "finished";
    status.end_reason = "max_submaps";
    bench_.Say(outputs::kMissionStatus, status, bench_.queue.now());
    bench_.RunFor(Duration(0));
    EXPECT_TRUE(Status().complete);
    end_ = vehicle_.end();
    settings_.map.resume = settings_.map.directory;
    settings_.map.directory = (folder_.path / "new").string();
    bench_.Forget();
  }

  StoredMap Old() const { return LoadMapFolder(settings_.map.resume).map; }
  StoredMap New() const { return LoadMapFolder(settings_.map.directory).map; }
  std::string Refusal() {
    try {
      Start();
    } catch (const UsageError& error) {
      EXPECT_FALSE(std::filesystem::exists(settings_.map.directory));
      return error.what();
    }
    return "not refused";
  }

  Time end_;
};

TEST_F(MapServiceResumeTest, AFinishedMapTellsWhereTheVehicleWasThen) {
  const StoredMap map = Old();
  ASSERT_TRUE(map.end.has_value());
  EXPECT_FALSE(map.put_in.has_value());
  EXPECT_EQ(map.end->time, end_);
  const OdometrySample base = map.submaps.back()->base.odometry;
  EXPECT_TRUE(map.end->X_ME.isApprox(Ominus(base.X_OB, CirclingVehicle::PoseAt(end_)), 1e-6));
  EXPECT_TRUE(map.end->covariance.isApprox(MotionCovariance(base, vehicle_.SampleAt(end_)), 1e-6));
}

TEST_F(MapServiceResumeTest, GoesOnWithACopyOfTheMap) {
  const auto files = FilesOf(settings_.map.resume);
  Start();
  vehicle_.Drive(kScansPerSubmap + 2);
  const map_status_t first = bench_.Said(outputs::kMapStatus).front();
  EXPECT_EQ(first.submaps, 2);
  EXPECT_EQ(first.first, 2);
  EXPECT_FALSE(first.complete);
  ASSERT_EQ(ToldIds(), (std::vector<SubmapId>{2}));
  // The old segment goes on, but nobody knows what the vehicle did meanwhile: what it reckoned then
  // does not count.
  const OdometryEdge edge = ToldSubmaps()[0]->base.edge;
  const PlaceInMap place = PutInPlaceOf(Old(), settings_.put_in);
  EXPECT_TRUE(edge.X_PM.translation().head<2>().isApprox(place.X_ME.translation().head<2>(), 0.02));
  EXPECT_TRUE(PlanarOf(edge.covariance).isApprox(place.covariance, 1e-9));
  EXPECT_GT(HorizontalSigma(edge.covariance), settings_.put_in.sigma_m);
  const StoredMap map = New();
  ASSERT_EQ(map.submaps.size(), 3u);
  ASSERT_TRUE(map.put_in.has_value());
  EXPECT_EQ(map.put_in->id, 2);
  EXPECT_FALSE(map.complete);
  EXPECT_FALSE(map.end.has_value()) << "a flight that breaks off here ended at its last scan";
  const auto copied = FilesOf(settings_.map.directory);
  for (const char* name : {"submaps/000000.ot", "submaps/000001.ot"})
    EXPECT_TRUE(copied.at(name) == files.at(name)) << name;
  EXPECT_TRUE(FilesOf(settings_.map.resume) == files) << "the old map stays as it is";

  Start();  // Killed, and started with the same settings.
  bench_.Forget();
  vehicle_.Drive(kScansPerSubmap);
  EXPECT_EQ(Status().first, 2);
  EXPECT_EQ(ToldIds(), (std::vector<SubmapId>{3}));
}

TEST_F(MapServiceResumeTest, KilledBeforeItsFirstSubmapItKnowsWhereTheFlightBegan) {
  Start();
  vehicle_.Drive(kScansPerSubmap - 2);
  const SubmapBase base = *FromMessage(Status().open);
  EXPECT_EQ(base.id, 2);
  Start();
  bench_.Forget();
  vehicle_.Drive(kScansPerSubmap + 1);
  ASSERT_EQ(ToldIds(), (std::vector<SubmapId>{2}));
  const SubmapBase again = ToldSubmaps()[0]->base;
  const Pose3 moved = Ominus(base.odometry.X_OB, again.odometry.X_OB);
  EXPECT_GT(moved.translation().norm(), 0.1);
  EXPECT_TRUE(again.edge.X_PM.isApprox(base.edge.X_PM * moved, 1e-6));
  EXPECT_EQ(Status().first, 2);
}

TEST_F(MapServiceResumeTest, ADamagedCopyGoesOnBeforeTheDamage) {
  Start();
  vehicle_.Drive(kScansPerSubmap + 2);
  Overwrite(std::filesystem::path(settings_.map.directory) / "submaps/000001.ot", "not an octree");
  Start();
  bench_.Forget();
  vehicle_.Drive(2 * kScansPerSubmap + 1);
  EXPECT_EQ(ToldIds(), (std::vector<SubmapId>{1, 2}));
  EXPECT_EQ(Status().first, 1);
  EXPECT_EQ(New().put_in->id, 1);
}

TEST_F(MapServiceResumeTest, AMapWithoutAnEndGoesOnFromItsLastScan) {
  StoredMap map = Old();
  map.end.reset();
  SaveMapFolder(map, settings_.map.resume);
  Start();
  vehicle_.Drive(kScansPerSubmap + 1);
  ASSERT_EQ(ToldIds(), (std::vector<SubmapId>{2}));
  const Vec3 put_in_m = ToldSubmaps()[0]->base.edge.X_PM.translation();
  EXPECT_TRUE(put_in_m.head<2>().isApprox(map.submaps.back()->X_ML.translation().head<2>(), 0.02));
}

TEST_F(MapServiceResumeTest, BeginsWhereTheFirstFlightDidOrAtAPlace) {
  const StoredMap map = Old();
  const Pose3 X_WM = map.X_WM.at(1);
  settings_.put_in.place = PutInPlace::kStart;
  const PlaceInMap start = PutInPlaceOf(map, settings_.put_in);
  EXPECT_TRUE((X_WM * start.X_ME).isApprox(map.X_WM.at(0), 1e-9));
  settings_.put_in.place = PutInPlace::kPlace;
  settings_.put_in.position_m = {5, 6, -1};
  settings_.put_in.yaw_deg = 90;
  const PlaceInMap place = PutInPlaceOf(map, settings_.put_in);
  EXPECT_TRUE((X_WM * place.X_ME).isApprox(MakePose({5, 6, -1}, {0, 0, ToRadians(90)}), 1e-9));
  // The place is known by the first submap, which the last one's edge joins to the last.
  const Mat3 of_edge = PlanarOf(map.submaps[1]->base.edge.covariance);
  const double put_in = std::pow(settings_.put_in.sigma_m, 2);
  EXPECT_GT(start.covariance(0, 0), put_in + 0.9 * of_edge(0, 0));
  EXPECT_LT(start.covariance(0, 0), put_in + 1.5 * of_edge(0, 0) + 1e-4);
  EXPECT_GT(place.covariance(0, 0), start.covariance(0, 0)) << "the heading's lever";
}

TEST_F(MapServiceResumeTest, RefusesWhatItCannotGoOnFrom) {
  const MapServiceSettings good = settings_;
  settings_.submap.voxel_size_m = 0.2;
  EXPECT_NE(Refusal().find("its voxels are of 0.15 m, submap.voxel_size_m is 0.2"),
            std::string::npos);
  settings_ = good;
  settings_.sensor_model.hit_probability = 0.8;
  EXPECT_NE(Refusal().find("another [sensor_model]"), std::string::npos);
  settings_ = good;
  settings_.mission.max_submaps = 2;
  EXPECT_NE(Refusal().find("it has 2 submaps"), std::string::npos);
  settings_ = good;
  settings_.map.resume = folder_.path.string();
  EXPECT_NE(Refusal().find("no map here"), std::string::npos);
  settings_ = good;
  StoredMap map = Old();
  const std::string whole = map.graph_g2o;
  map.graph_g2o = whole.substr(0, whole.find("EDGE_SE3:QUAT"));
  SaveMapFolder(map, settings_.map.resume);
  EXPECT_NE(Refusal().find("no edge joins"), std::string::npos);
  map.graph_g2o = whole;
  SaveMapFolder(map, settings_.map.resume);
  Overwrite(std::filesystem::path(settings_.map.resume) / "submaps/000001.ot", "not an octree");
  EXPECT_NE(Refusal().find("000001.ot: the check sum does not match"), std::string::npos);
}

// A file where the folder was: as good as a full disk.
TEST_F(MapServiceNodeTest, TellsWhenTheMapCannotBeSavedAndSavesItLater) {
  vehicle_.Drive(kScansPerSubmap);
  const std::filesystem::path submaps = std::filesystem::path(settings_.map.directory) / "submaps";
  const std::filesystem::path aside = folder_.path / "aside";
  std::filesystem::rename(submaps, aside);
  std::ofstream(submaps) << "in the way";
  vehicle_.Drive(2 * kScansPerSubmap + 1);
  EXPECT_EQ(Status().submaps, 3);
  EXPECT_NE(Status().fault.find("000001.ot"), std::string::npos) << Status().fault;
  EXPECT_EQ(ToldIds(), (std::vector<SubmapId>{0, 1, 2}));
  bench_.RunFor(std::chrono::seconds(1));
  EXPECT_EQ(bench_.StatusOf("vog-map-service").health, Status().fault);
  EXPECT_EQ(LoadMapFolder(settings_.map.directory).map.submaps.size(), 0u);

  std::filesystem::remove(submaps);
  std::filesystem::rename(aside, submaps);
  vehicle_.Drive(kScansPerSubmap);
  EXPECT_EQ(Status().fault, "");
  const LoadedMap loaded = LoadMapFolder(settings_.map.directory);
  EXPECT_TRUE(loaded.faults.empty());
  EXPECT_EQ(loaded.map.submaps.size(), 4u);
}

TEST_F(MapServiceNodeTest, CompletesWhenTheDiskHasRoomAgain) {
  vehicle_.Drive(kScansPerSubmap);
  const std::filesystem::path graph = std::filesystem::path(settings_.map.directory) / "graph.g2o";
  std::filesystem::remove(graph);
  std::filesystem::create_directories(graph / "in the way");
  SayFinished();
  SayPoses(1, 1);
  SayGraph(1);
  EXPECT_FALSE(Status().complete);
  EXPECT_NE(Status().fault, "");
  std::filesystem::remove_all(graph);
  bench_.Forget();
  bench_.RunFor(std::chrono::seconds(2));
  // It asks SLAM again until all is saved.
  ASSERT_FALSE(bench_.Said(outputs::kMapRequest).empty());
  SayPoses(1, 1);
  SayGraph(1);
  EXPECT_TRUE(Status().complete);
  EXPECT_EQ(Status().fault, "");
  bench_.Forget();
  bench_.RunFor(std::chrono::seconds(2));
  EXPECT_TRUE(bench_.Said(outputs::kMapRequest).empty());
}

TEST_F(MapServiceNodeTest, WithoutAFolderItDoesNotStart) {
  settings_.map.directory = (folder_.path / "file").string();
  std::ofstream(settings_.map.directory) << "in the way";
  EXPECT_THROW(Start(), SystemError);
}

TEST_F(MapServiceNodeTest, ANewNavigationSegmentClosesTheSubmap) {
  vehicle_.Drive(3);
  vehicle_.segment += 1;
  vehicle_.Drive(3);
  ASSERT_EQ(ToldIds(), (std::vector<SubmapId>{0}));
  EXPECT_LE(ToldSubmaps()[0]->scans, 3);
  EXPECT_EQ(Status().open.submap_id, 1);
}

/// A service that fuses, and SLAM tells where the submaps truly are.
class MapServiceFusionTest : public MapServiceNodeTest {
 protected:
  MapServiceFusionTest() {
    settings_.fuse.enabled = true;
    Start();
  }

  void DriveAndSayTruePoses(int submaps) {
    for (int i = 0; i < submaps; ++i) {
      vehicle_.Drive(kScansPerSubmap);
      std::vector<SubmapPlace> places;
      const Mat6 covariance = 1e-4 * Mat6::Identity();
      for (const SubmapPtr& submap : ExpectedSubmaps())
        places.push_back({submap->id(), submap->base.odometry.X_OB, covariance, covariance});
      submap_poses_t poses = ToMessage(places);
      poses.version = ++version_;
      bench_.Say(outputs::kSubmapPoses, poses, bench_.queue.now());
      bench_.RunFor(Duration(0));
    }
  }
  /// Submaps that the service's map shows.
  std::int64_t Shown() {
    bench_.RunFor(std::chrono::seconds(1));
    return bench_.CounterOf("vog-map-service", "submaps") -
           bench_.CounterOf("vog-map-service", "fused");
  }

  std::int64_t version_ = 0;
};

TEST_F(MapServiceFusionTest, TheMapStaysSmallAndEverySubmapReachable) {
  DriveAndSayTruePoses(30);
  const std::int64_t shown = Shown();
  EXPECT_LE(shown, 14);
  DriveAndSayTruePoses(30);
  EXPECT_LE(Shown(), shown) << "it is the same place";
  vehicle_.Drive(1);
  EXPECT_EQ(Status().submaps, 60);

  const auto expected = ExpectedSubmaps();
  bench_.Forget();
  map_request_t request{};
  request.kind = "submaps";
  bench_.Say(outputs::kMapRequest, request, bench_.queue.now());
  bench_.RunFor(Duration(0));
  const auto told = ToldSubmaps();
  ASSERT_EQ(told.size(), expected.size());
  const LoadedMap loaded = LoadMapFolder(settings_.map.directory);
  EXPECT_TRUE(loaded.faults.empty());
  ASSERT_EQ(loaded.map.submaps.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    ExpectSame(*told[i], *expected[i]);
    ExpectSame(*loaded.map.submaps[i], *expected[i]);
  }
}

TEST_F(MapServiceFusionTest, ARestartFusesAnew) {
  DriveAndSayTruePoses(12);
  const std::int64_t shown = Shown();
  EXPECT_LT(shown, 12);
  const map_status_t before = Status();
  Start();
  vehicle_.Drive(1);
  EXPECT_EQ(Status().digest, before.digest);
  DriveAndSayTruePoses(settings_.fuse.settled_versions + 2);
  EXPECT_LE(Shown(), shown + settings_.fuse.settled_versions + 2);
}

// Away from surfaces no state changes. Near them, half a voxel's diagonal may tell (8.6 % of the
// voxels here), and at the ends of what was seen it tells what is known (3.8 %).
TEST_F(MapServiceFusionTest, StatesChangeOnlyNearSurfaces) {
  DriveAndSayTruePoses(40);
  VogMap apart(settings_.submap.voxel_size_m, SensorModel(settings_.sensor_model));
  for (const SubmapPtr& submap : ExpectedSubmaps()) apart.Place(submap, submap->base.odometry.X_OB);
  const Eigen::AlignedBox3d& room_W = vehicle_.room_W;
  const Vec3 min_W = room_W.min().array() - 0.5, max_W = room_W.max().array() + 0.5;
  const VoxelBox box = VoxelsOf(apart.grid(), {min_W, max_W});
  std::vector<float> before;
  apart.LogOddsIn(box, before);
  const std::vector<float> after = Ask(Points({min_W, max_W}, "box")).log_odds;
  ASSERT_EQ(after.size(), before.size());

  struct {
    int voxels = 0, changed = 0;
  } away, near, known;
  std::size_t i = 0;
  ForEachVoxel(box, [&](const VoxelKey& voxel) {
    const float answer = before[i], fused = after[i];
    ++i;
    known.voxels += IsKnown(answer) || IsKnown(fused);
    known.changed += IsKnown(answer) != IsKnown(fused);
    if (!IsKnown(answer) || !IsKnown(fused)) return;
    const Vec3 center_W = apart.grid().CenterOf(voxel);
    const double to_wall_m = (room_W.max() - center_W).cwiseMin(center_W - room_W.min()).minCoeff();
    auto& count = std::abs(to_wall_m) >= 2 * apart.grid().voxel_size_m() ? away : near;
    ++count.voxels;
    count.changed += apart.IsOccupied(answer) != apart.IsOccupied(fused);
  });
  EXPECT_GT(away.voxels, 10000);
  EXPECT_EQ(away.changed, 0);
  EXPECT_LT(near.changed, 0.1 * near.voxels);
  EXPECT_LT(known.changed, 0.05 * known.voxels);
}

/// Collects submaps as a process does.
struct Listener {
  Listener(Bus& bus, const std::string& name)
      : endpoint(bus, name, Bench::kRun),
        receiver(endpoint, {[this](const SubmapPtr& s) { submaps[s->id()] = s; },
                            [this] { submaps.clear(); }, [](const map_status_t&) {}}) {}
  Endpoint endpoint;
  std::map<SubmapId, SubmapPtr> submaps;
  SubmapReceiver receiver;
};

TEST_F(MapServiceNodeTest, AListenerThatLosesChunksGetsAllInTheEnd) {
  Random random(4, "loss");
  ProcessBus bus(bench_.queue, "listener", 1, [&](const std::string& channel, Bytes) {
    return channel == outputs::kSubmap.name && random.Chance(0.5);
  });
  Listener listener(bus, "listener");
  vehicle_.Drive(6 * kScansPerSubmap);
  EXPECT_FALSE(listener.receiver.IsComplete());
  bench_.RunFor(std::chrono::seconds(60));
  EXPECT_TRUE(listener.receiver.IsComplete());
  const auto expected = ExpectedSubmaps();
  ASSERT_EQ(listener.submaps.size(), expected.size());
  for (const SubmapPtr& submap : expected) ExpectSame(*listener.submaps.at(submap->id()), *submap);
}

TEST_F(MapServiceNodeTest, AListenerThatComesLateGetsAll) {
  vehicle_.Drive(3 * kScansPerSubmap);
  ProcessBus bus(bench_.queue, "listener", 1);
  Listener listener(bus, "listener");
  EXPECT_FALSE(listener.receiver.IsComplete());
  bench_.RunFor(std::chrono::seconds(5));
  EXPECT_TRUE(listener.receiver.IsComplete());
  EXPECT_EQ(listener.submaps.size(), 3u);
}

TEST_F(MapServiceNodeTest, AListenerKeepsWhatItHasOverARestart) {
  ProcessBus bus(bench_.queue, "listener", 1);
  Listener listener(bus, "listener");
  vehicle_.Drive(3 * kScansPerSubmap);
  const SubmapPtr first = listener.submaps.at(0);
  Start();
  vehicle_.Drive(kScansPerSubmap);
  EXPECT_EQ(listener.submaps.at(0), first);
  EXPECT_EQ(listener.submaps.size(), 4u);
}

}  // namespace
}  // namespace vog
