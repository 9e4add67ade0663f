#include "procs/planner/planner_node.h"

#include <gtest/gtest.h>

#include "lib/messages/fake_bus_testing.h"
#include "lib/planner/chamber_testing.h"
#include "procs/map_service/map_service_node.h"
#include "procs/map_service/node_testing.h"
#include "procs/slam/slam_node.h"

namespace vog {
namespace {

constexpr int kScansPerSubmap = 8;

/// A vehicle that circles on its own, with a map service and SLAM, and the planner under test.
class PlannerNodeTest : public testing::Test {
 protected:
  PlannerNodeTest() {
    settings_.planner = SmallPlanner();
    settings_.sonar = WideSonar();
    settings_.exploration.min_m = {-2.9, -2.4, -1.1};
    settings_.exploration.max_m = {2.9, 2.4, 1.1};
    settings_.submap.voxel_size_m = 0.15;
    settings_.submap.scans_per_submap = kScansPerSubmap;
    settings_.run_id = slam_settings_.run_id = map_settings_.run_id = Bench::kRun;
    map_settings_.submap = settings_.submap;
    map_settings_.map.directory = (folder_.path / "map").string();
    map_service_ = std::make_unique<Process<MapServiceNode>>(bench_.queue, 5, map_settings_);
    slam_ = std::make_unique<Process<SlamNode>>(bench_.queue, 5, slam_settings_);
  }

  void Start() {
    dut_.reset();
    dut_ = std::make_unique<Process<PlannerNode>>(bench_.queue, ++epoch_, settings_);
  }
  void ExpectSound(const plan_t& plan) const {
    ASSERT_GE(plan.waypoints, 1);
    for (int i = 0; i < plan.nodes; ++i) {
      EXPECT_LT(plan.tree[i].parent, i);
      EXPECT_EQ(plan.tree[i].parent < 0, i == 0);
    }
    EXPECT_LT(plan.best, std::max(1, plan.nodes));
    // The hull stays inside the true room.
    const double half_m = 0.5 * settings_.planner.hull_size_m.head<2>().norm();
    for (const waypoint_t& waypoint : plan.path) {
      const Vec3 p_W = Eigen::Map<const Vec3>(waypoint.position_m);
      EXPECT_LT(std::abs(p_W.x()), 3 - half_m + 0.15);
      EXPECT_GT(p_W.y(), -2.5 + half_m - 0.15);
      EXPECT_LT(p_W.y(), 2.5 - half_m + 0.15);
    }
  }
  /// Runs a planner with `twin_settings` beside the one under test.
  void ExpectEqualPlansOfTwin(const PlannerSettings& twin_settings) {
    Start();
    ProcessBus twin_bus(bench_.queue, "twin", 1);
    const PlannerNode twin(twin_bus, twin_settings);
    vehicle_.Drive(2 * kScansPerSubmap);
    std::map<std::int64_t, std::map<std::int64_t, plan_t>> plans;  // By epoch and id.
    for (const plan_t& plan : bench_.Said(outputs::kPlan))
      plans[plan.header.epoch].emplace(plan.plan_id, plan);
    ASSERT_EQ(plans.size(), 2u);
    const auto& a = plans.begin()->second;
    const auto& b = plans.rbegin()->second;
    ASSERT_EQ(a.size(), b.size());
    for (const auto& [id, plan] : a) {
      plan_t other = b.at(id);
      other.header = plan.header;
      EXPECT_EQ(Encode(other), Encode(plan)) << id;
    }
  }
  std::vector<map_request_t> RequestsOfPlanner() const {
    std::vector<map_request_t> requests;
    for (const map_request_t& request : bench_.Said(outputs::kMapRequest))
      if (request.header.sender == "vog-planner") requests.push_back(request);
    return requests;
  }

  TestFolder folder_;
  Bench bench_;
  CirclingVehicle vehicle_{bench_};
  MapServiceSettings map_settings_;
  SlamNodeSettings slam_settings_;
  PlannerSettings settings_;
  std::unique_ptr<Process<MapServiceNode>> map_service_;
  std::unique_ptr<Process<SlamNode>> slam_;
  std::unique_ptr<Process<PlannerNode>> dut_;
  std::int64_t epoch_ = 10;
};

TEST_F(PlannerNodeTest, PlansFromThePoseOn) {
  Start();
  vehicle_.Drive(2 * kScansPerSubmap);
  const auto plans = bench_.Said(outputs::kPlan);
  ASSERT_FALSE(plans.empty());
  std::int64_t id = 0;
  for (const plan_t& plan : plans) {
    ExpectSound(plan);
    EXPECT_FALSE(plan.in_odometry_frame);
    EXPECT_GE(plan.plan_id, id);
    if (plan.plan_id > id) {
      const Pose3 X_WB = CirclingVehicle::PoseAt(TimeOf(plan.header));
      EXPECT_LT((Eigen::Map<const Vec3>(plan.path[0].position_m) - X_WB.translation()).norm(), 0.1);
    }
    id = plan.plan_id;
  }
  const mission_status_t status = bench_.Last(outputs::kMissionStatus);
  EXPECT_EQ(status.state, "exploring");
  EXPECT_EQ(status.end_reason, "");
  EXPECT_EQ(status.plans, id);
  EXPECT_GT(status.explored_m3, 1);
  EXPECT_TRUE(RequestsOfPlanner().empty()) << "nothing was missed";
}

TEST_F(PlannerNodeTest, TellsThePlanAgainEachSecond) {
  Start();
  vehicle_.Drive(kScansPerSubmap);
  const plan_t plan = bench_.Last(outputs::kPlan);
  bench_.Forget();
  bench_.RunFor(std::chrono::seconds(3));
  const auto again = bench_.Said(outputs::kPlan);
  ASSERT_EQ(again.size(), 3u);
  EXPECT_EQ(again[0].plan_id, plan.plan_id);
  EXPECT_EQ(again[2].waypoints, plan.waypoints);
}

TEST_F(PlannerNodeTest, WaitsForTheMap) {
  map_service_.reset();
  slam_.reset();
  Start();
  pose_estimate_t pose{};
  pose.X_WB = pose.X_WO = ToMessage(Pose3::Identity());
  bench_.Say(outputs::kPose, pose, bench_.queue.now());
  bench_.RunFor(std::chrono::seconds(2));
  EXPECT_TRUE(bench_.Said(outputs::kPlan).empty());
  EXPECT_EQ(bench_.Last(outputs::kMissionStatus).state, "waiting");
  EXPECT_EQ(bench_.StatusOf("vog-planner").health, "waiting for submaps");
}

TEST_F(PlannerNodeTest, MakesItsFirstPlanOnTheWholeMapAtTheSlamsPoses) {
  vehicle_.Drive(2 * kScansPerSubmap);
  slam_.reset();
  Start();
  bench_.RunFor(std::chrono::seconds(5));
  EXPECT_EQ(bench_.StatusOf("vog-planner").health, "ok") << "all submaps are here";
  pose_estimate_t pose{};
  pose.X_WB = pose.X_WO = ToMessage(Pose3::Identity());
  bench_.Forget();
  bench_.Say(outputs::kPose, pose, bench_.queue.now());
  bench_.RunFor(Duration(0));
  EXPECT_TRUE(bench_.Said(outputs::kPlan).empty());
  slam_ = std::make_unique<Process<SlamNode>>(bench_.queue, 6, slam_settings_);
  bench_.RunFor(std::chrono::seconds(4));
  bench_.Say(outputs::kPose, pose, bench_.queue.now());
  bench_.RunFor(Duration(0));
  EXPECT_FALSE(bench_.Said(outputs::kPlan).empty());
}

TEST_F(PlannerNodeTest, EndsWithTheBudget) {
  settings_.mission.max_submaps = 2;
  settings_.mission.when_done = WhenDone::kEnd;
  Start();
  vehicle_.Drive(2 * kScansPerSubmap + 2);
  const mission_status_t status = bench_.Last(outputs::kMissionStatus);
  EXPECT_EQ(status.state, "finished");
  EXPECT_EQ(status.end_reason, "max_submaps");
  EXPECT_EQ(status.submaps, 2);
  EXPECT_EQ(bench_.Last(outputs::kPlan).waypoints, 1);
}

// On a slow machine, or a network that loses much, the last ones may be long in coming.
TEST_F(PlannerNodeTest, EndsWithTheBudgetWithoutTheLastSubmaps) {
  settings_.mission.max_submaps = 2;
  ProcessBus bus(bench_.queue, "dut", ++epoch_, [](const std::string& channel, Bytes) {
    return channel == outputs::kSubmap.name;
  });
  const PlannerNode dut(bus, settings_);
  vehicle_.Drive(2 * kScansPerSubmap + 2);
  EXPECT_EQ(bench_.StatusOf("vog-planner").health, "waiting for submaps");
  EXPECT_EQ(bench_.Last(outputs::kMissionStatus).end_reason, "max_submaps");
}

// A step of planning may take longer than the poses take to come.
TEST_F(PlannerNodeTest, PlansWithTheNewestOfThePosesThatHaveCome) {
  FakeBus bus;
  PlannerNode dut(bus, settings_);
  map_status_t status{};  // Of a map that has just begun.
  status.header.run_id = settings_.run_id;
  bus.Deliver({outputs::kMapStatus.name, Encode(status)});
  for (int i = 0; i < 5; ++i) {
    pose_estimate_t pose{};
    pose.header.run_id = settings_.run_id;
    pose.header.utime_us = 100'000 * i;
    pose.header.sequence = i;
    pose.X_WB = ToMessage(MakePose({0.1 * i, 0, 0}, {0, 0, 0}));
    pose.X_WO = ToMessage(Pose3::Identity());
    bus.Arrive({outputs::kPose.name, Encode(pose)});
  }
  EXPECT_TRUE(bus.sent.empty());
  bus.CatchUp();
  plan_t plan{};
  const auto sent = bus.TakeSent();
  const auto said = std::find_if(sent.begin(), sent.end(), [](const FakeBus::Sent& message) {
    return message.channel == outputs::kPlan.name;
  });
  ASSERT_NE(said, sent.end());
  ASSERT_TRUE(Decode(said->bytes, plan));
  EXPECT_EQ(plan.header.utime_us, 400'000);
  EXPECT_NEAR(plan.path.at(0).position_m[0], 0.4, 1e-6);
  bus.CatchUp();
  EXPECT_TRUE(bus.TakeSent().empty()) << "planned twice with one pose";
}

TEST_F(PlannerNodeTest, RestartGoesOnExploring) {
  Start();
  vehicle_.Drive(2 * kScansPerSubmap);
  const double explored_m3 = bench_.Last(outputs::kMissionStatus).explored_m3;
  Start();
  bench_.Forget();
  bench_.RunFor(std::chrono::seconds(3));
  vehicle_.Drive(20 + kScansPerSubmap);
  ASSERT_FALSE(bench_.Said(outputs::kPlan).empty());
  EXPECT_EQ(bench_.Last(outputs::kPlan).header.epoch, epoch_);
  ExpectSound(bench_.Last(outputs::kPlan));
  EXPECT_EQ(bench_.Last(outputs::kMissionStatus).state, "exploring");
  EXPECT_GE(bench_.Last(outputs::kMissionStatus).explored_m3, 0.9 * explored_m3);
}

// Who comes late, or has lost the message, must not plan on a map at odometry poses.
TEST_F(PlannerNodeTest, AsksForPosesThatItMissed) {
  vehicle_.Drive(3 * kScansPerSubmap);
  Start();
  vehicle_.Drive(1);
  bench_.Forget();
  bench_.RunFor(std::chrono::seconds(3));
  vehicle_.Drive(1);
  const auto requests = RequestsOfPlanner();
  const auto asked = std::count_if(requests.begin(), requests.end(),
                                   [](const auto& request) { return request.kind == "poses"; });
  EXPECT_GT(asked, 0);
  EXPECT_LE(asked, 2) << "until it is answered";
}

TEST_F(PlannerNodeTest, GetsLostSubmapsInTheEnd) {
  Random random(1, "loss");
  ProcessBus bus(bench_.queue, "dut", ++epoch_, [&](const std::string& channel, Bytes) {
    return channel == outputs::kSubmap.name && random.Chance(0.5);
  });
  const PlannerNode dut(bus, settings_);
  vehicle_.Drive(4 * kScansPerSubmap);
  bench_.RunFor(std::chrono::seconds(40));
  EXPECT_EQ(bench_.StatusOf("vog-planner").health, "waiting for POSE");
  EXPECT_EQ(bench_.CounterOf("vog-planner", "submaps"), 4);
  for (const char* counter : {"map_digest", "poses_version"}) {
    const std::int64_t told = bench_.CounterOf("vog-map-service", counter);
    EXPECT_NE(told, 0);
    EXPECT_EQ(bench_.CounterOf("vog-planner", counter), told) << counter;
    EXPECT_EQ(bench_.CounterOf("vog-slam", counter), told) << counter;
  }
}

TEST_F(PlannerNodeTest, StandardModePlansInTheOdometrysWorld) {
  settings_.mission.mode = MissionMode::kStandard;
  Start();
  vehicle_.Drive(2 * kScansPerSubmap);
  const plan_t plan = bench_.Last(outputs::kPlan);
  EXPECT_TRUE(plan.in_odometry_frame);
  ExpectSound(plan);
  EXPECT_GT(bench_.Last(outputs::kMissionStatus).explored_m3, 1);
}

TEST_F(PlannerNodeTest, EqualInputsGiveEqualPlans) { ExpectEqualPlansOfTwin(settings_); }

TEST_F(PlannerNodeTest, PlansDoNotDependOnWhatTheMapRemembers) {
  PlannerSettings direct = settings_;
  direct.map.method = MapMethod::kDirect;
  ExpectEqualPlansOfTwin(direct);
}

// Both fuse by themselves, from what SLAM tells.
TEST_F(PlannerNodeTest, FusesWhatTheMapServiceFuses) {
  settings_.fuse.enabled = map_settings_.fuse.enabled = true;
  map_service_.reset();
  map_service_ = std::make_unique<Process<MapServiceNode>>(bench_.queue, 6, map_settings_);
  Start();
  constexpr int kSubmaps = 30;
  vehicle_.Drive(kSubmaps * kScansPerSubmap + 1);  // The last scan waits: none is open.
  bench_.RunFor(std::chrono::seconds(1));
  EXPECT_EQ(bench_.CounterOf("vog-planner", "submaps"), kSubmaps);
  const std::int64_t fused = bench_.CounterOf("vog-planner", "fused");
  EXPECT_EQ(bench_.CounterOf("vog-map-service", "fused"), fused);
  EXPECT_GE(fused, kSubmaps / 2);

  map_request_t request{};
  request.kind = "box";
  request.points = 2;
  request.point_W_m = {{-3.2, -2.7, -1.5}, {3.2, 2.7, 1.5}};
  bench_.Say(outputs::kMapRequest, request, bench_.queue.now());
  bench_.RunFor(Duration(0));
  const auto replies = bench_.SaidLarge<map_reply_t>(outputs::kMapReply);
  ASSERT_EQ(replies.size(), 1u);
  std::vector<float> answers;
  const OccupancyMap& map = dut_->node.planning_map();
  map.LogOddsIn(VoxelsOf(map.grid(), {Vec3(-3.2, -2.7, -1.5), Vec3(3.2, 2.7, 1.5)}), answers);
  ASSERT_EQ(answers.size(), replies[0].log_odds.size());
  int known = 0;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    known += IsKnown(answers[i]);
    ASSERT_TRUE(answers[i] == replies[0].log_odds[i] ||
                (!IsKnown(answers[i]) && !IsKnown(replies[0].log_odds[i])))
        << answers[i] << " " << replies[0].log_odds[i];
  }
  EXPECT_GT(known, 5000);
}

TEST_F(PlannerNodeTest, SurvivesAPoseFarAway) {
  Start();
  vehicle_.Drive(3);
  vehicle_.LeapFarAway();
  EXPECT_NO_THROW(bench_.RunFor(std::chrono::milliseconds(20)));
  EXPECT_NO_THROW(vehicle_.Drive(kScansPerSubmap));
}

TEST_F(PlannerNodeTest, DamagedBytesAreCountedAndHarmless) {
  Start();
  vehicle_.Drive(kScansPerSubmap);
  Random random(2, "damage");
  int damaged = SayDamaged(bench_, outputs::kPose, bench_.Last(outputs::kPose), random);
  damaged += SayDamaged(bench_, outputs::kSubmapPoses, submap_poses_t{}, random);
  damaged += SayDamaged(bench_, outputs::kScan, ToMessage(vehicle_.ScanAt({}, 0)), random);
  damaged += SayDamaged(bench_, outputs::kNav, ToMessage(vehicle_.SampleAt({})), random);
  damaged += SayDamaged(bench_, outputs::kMapStatus, bench_.Last(outputs::kMapStatus), random);
  const revisits_t revisits = ToMessage(std::map<SubmapId, double>{{0, 1.5}});  // More than all.
  damaged += SayDamaged(bench_, outputs::kRevisits, revisits, random);
  bench_.Say(outputs::kRevisits, revisits, bench_.queue.now());
  pose_estimate_t pose{};  // No rotations.
  bench_.Say(outputs::kPose, pose, bench_.queue.now());
  submap_poses_t foreign{};
  foreign.header = bench_.NextHeader(outputs::kSubmapPoses.name, bench_.queue.now());
  foreign.header.run_id += 1;
  foreign.version = 99;
  bench_.SayAsIs(outputs::kSubmapPoses, foreign, bench_.queue.now());
  vehicle_.Drive(kScansPerSubmap);
  bench_.RunFor(std::chrono::seconds(1));
  EXPECT_EQ(
      bench_.CounterOf("vog-planner", "malformed") + bench_.CounterOf("vog-planner", "other_run"),
      damaged + 3);
  ExpectSound(bench_.Last(outputs::kPlan));
  EXPECT_EQ(bench_.CounterOf("vog-planner", "submaps"), 2);
}

TEST_F(PlannerNodeTest, FliesToASubmapThatIsWorthBeingSeenAgain) {
  for (const double share : {0.0, 1.0}) {
    settings_.planner.revisit_share = share;
    Start();
    vehicle_.Drive(20 * kScansPerSubmap);
    ASSERT_EQ(bench_.Last(outputs::kMissionStatus).state, "exploring");
    const SubmapId newest = bench_.Last(outputs::kMapStatus).submaps - 1;
    bench_.Say(outputs::kRevisits, ToMessage(std::map<SubmapId, double>{{newest, 1}, {777, 1}}),
               bench_.queue.now());
    bench_.Forget();
    // It goes on with a new plan.
    for (const char* command : {"pause", "resume"}) {
      operator_command_t order{};
      order.command = command;
      bench_.Say(outputs::kOperator, order, bench_.queue.now());
      vehicle_.Drive(2);
    }
    int localising = 0;
    for (const mission_status_t& status : bench_.Said(outputs::kMissionStatus))
      localising += status.state == "localising";
    EXPECT_EQ(localising > 0, share > 0);
  }
}

TEST_F(PlannerNodeTest, ObeysTheOperator) {
  Start();
  vehicle_.Drive(kScansPerSubmap);
  const auto order = [&](const std::string& command, const std::string& settings = {}) {
    operator_command_t message{};
    message.command = command;
    message.settings = settings;
    bench_.Say(outputs::kOperator, message, bench_.queue.now());
    vehicle_.Drive(2);
    return bench_.Last(outputs::kMissionStatus);
  };
  mission_status_t status = order("pause");
  EXPECT_EQ(status.hold, "paused");
  EXPECT_EQ(status.orders, 1);
  EXPECT_EQ(bench_.Last(outputs::kPlan).waypoints, 1);
  status = order("resume");
  EXPECT_EQ(status.hold, "");
  EXPECT_EQ(status.state, "exploring");
  EXPECT_NE(order("dance").refused.find("unknown order"), std::string::npos);
  EXPECT_NE(order("set", "[planner]\nrange_m = -1").refused.find("range_m"), std::string::npos);
  EXPECT_NE(order("set", "[sonar]\nfov_deg = 30").refused.find("sonar"), std::string::npos);
  EXPECT_EQ(order("set", "[exploration]\nmax_depth_m = 0.9").refused, "");
  EXPECT_EQ(order("abort").state, "finished");
  EXPECT_EQ(bench_.Last(outputs::kMissionStatus).end_reason, "abort");
  EXPECT_EQ(bench_.Last(outputs::kPlan).waypoints, 1);
  EXPECT_NE(order("resume").refused.find("over"), std::string::npos);
}

TEST_F(PlannerNodeTest, HoldsWithoutSonarAndWithoutMap) {
  Start();
  vehicle_.Drive(kScansPerSubmap);
  const auto pose_after = [&](int seconds) {
    pose_estimate_t pose = bench_.Last(outputs::kPose);
    for (int i = 0; i < seconds; ++i) {
      pose.header.utime_us += 1000000;
      bench_.Say(outputs::kPose, pose, TimeOf(pose.header));
      bench_.RunFor(std::chrono::seconds(1));
    }
    return bench_.Last(outputs::kMissionStatus).hold;
  };
  map_status_t map = bench_.Last(outputs::kMapStatus);
  EXPECT_EQ(pose_after(4), "");
  bench_.Say(outputs::kMapStatus, map, bench_.queue.now());
  EXPECT_EQ(pose_after(2), "no sonar");
  EXPECT_EQ(bench_.Last(outputs::kPlan).waypoints, 1);
  map_service_.reset();
  EXPECT_EQ(pose_after(6), "no map");
}

// A simulated vehicle's time may go many times as fast as the bus' seconds.
TEST_F(PlannerNodeTest, DoesNotMissTheMapWhenTheVehiclesTimeIsFast) {
  Start();
  vehicle_.Drive(kScansPerSubmap);
  pose_estimate_t pose = bench_.Last(outputs::kPose);
  Time time = TimeOf(pose.header);
  for (int second = 0; second < 20; ++second) {
    time += std::chrono::seconds(8);
    pose.header = bench_.NextHeader(outputs::kPose.name, time);
    bench_.SayAsIs(outputs::kPose, pose, bench_.queue.now());
    bench_.RunFor(std::chrono::seconds(1));
    EXPECT_NE(bench_.Last(outputs::kMissionStatus).hold, "no map") << second;
  }
}

class PlannerMethodTest : public PlannerNodeTest, public testing::WithParamInterface<MapMethod> {};

TEST_P(PlannerMethodTest, PlansOnItsMap) {
  settings_.map.method = GetParam();
  Start();
  vehicle_.Drive(2 * kScansPerSubmap);
  ExpectSound(bench_.Last(outputs::kPlan));
  EXPECT_GT(bench_.Last(outputs::kMissionStatus).explored_m3, 1);
}

INSTANTIATE_TEST_SUITE_P(All, PlannerMethodTest,
                         testing::Values(MapMethod::kCached, MapMethod::kDirect,
                                         MapMethod::kAlgorithm1, MapMethod::kIncrementalMerge),
                         [](const auto& info) { return NameOf(MapMethodNames(), info.param); });

TEST(PlannerSettingsTest, RefusesAnEmptyBox) {
  EXPECT_THROW(PlannerSettings::From(Config::Parse(
                   "[exploration]\nmin_m = [1.0, 0.0, 0.0]\nmax_m = [0.0, 1.0, 1.0]", "a")),
               UsageError);
}

}  // namespace
}  // namespace vog
