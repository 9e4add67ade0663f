#include "procs/viewer/viewer_node.h"

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "lib/submap/octree_file.h"
#include "lib/submap/submaps_testing.h"
#include "procs/map_service/node_testing.h"
#include "procs/viewer/web_client_testing.h"

namespace vog {
namespace {

using nlohmann::json;

const std::string kToken = "correct horse battery";

class ViewerNodeTest : public testing::Test {
 protected:
  ViewerNodeTest() {
    settings_.run_id = Bench::kRun;
    settings_.viewer.port = 0;
    settings_.view.voxel_size_m = 0.1;
    settings_.view.exploration_W = Eigen::AlignedBox3d(Vec3(-3, -3, -2), Vec3(3, 3, 2));
  }

  ViewerNode& Dut() {
    if (!dut_) dut_ = std::make_unique<Process<ViewerNode>>(bench_.queue, 10, settings_);
    return dut_->node;
  }

  static Time At(double seconds) { return Time(FromSeconds(seconds)); }
  void SaySubmap(const Submap& submap) {
    const submap_t message = ToMessage(submap, ToOctreeBytes(submap.grid));
    bench_.SayLarge(outputs::kSubmap, submap.id(), ContentChecksum(message), message, At(0));
    Settle();
  }
  void SayPlaces(const std::vector<SubmapPlace>& places, std::int64_t version, Time time) {
    submap_poses_t message = ToMessage(places);
    message.version = version;
    bench_.Say(outputs::kSubmapPoses, message, time);
    bench_.RunUntil(time);
  }
  void SayBody(double t, const Vec3& estimate_W, const Vec3& odometry_O, const Vec3& truth_W) {
    truth_t truth{};
    truth.X_WB = ToMessage(MakePose(truth_W));
    bench_.Say(inputs::kTruth, truth, At(t));
    OdometrySample sample;
    sample.origin = sample.segment = 3;
    sample.X_OB = MakePose(odometry_O);
    nav_t nav = ToMessage(sample);
    nav.header = bench_.NextHeader(outputs::kNav.name, At(t));
    nav.header.epoch = 3;
    bench_.SayAsIs(outputs::kNav, nav, At(t));
    pose_estimate_t pose{};
    pose.X_WB = ToMessage(MakePose(estimate_W));
    pose.X_WO = ToMessage(MakePose(estimate_W - odometry_O));
    bench_.Say(outputs::kPose, pose, At(t));
    bench_.RunUntil(At(t));
  }
  void Settle() { bench_.RunFor(Duration(1)); }

  std::unique_ptr<WebClient> Listen() {
    auto client = std::make_unique<WebClient>(Dut().server().port(),
                                              [this] { Dut().Step(bench_.queue.now()); });
    EXPECT_TRUE(client->Upgrade());
    client->Say(json({{"k", "hello"}, {"token", settings_.viewer.token}}).dump());
    return client;
  }
  /// A client of Foxglove's protocol that subscribes to all channels; topic -> payloads.
  std::map<std::string, std::vector<std::string>> HearFeed() {
    WebClient client(Dut().server().port(), [this] { Dut().Step(bench_.queue.now()); });
    EXPECT_TRUE(
        client.Upgrade("Host: localhost\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n", "/"));
    EXPECT_EQ(json::parse(client.Hear().value_or("null"))["op"], "serverInfo");
    std::map<std::uint32_t, std::string> topics;
    json subscriptions = json::array();
    const json advertised = json::parse(client.Hear().value_or("null"));
    for (const json& channel : advertised["channels"]) {
      topics[channel["id"]] = channel["topic"];
      subscriptions.push_back({{"id", channel["id"]}, {"channelId", channel["id"]}});
    }
    client.Say(json({{"op", "subscribe"}, {"subscriptions", subscriptions}}).dump());
    std::map<std::string, std::vector<std::string>> heard;
    while (const auto message = client.Hear()) {
      if ((*message)[0] != 1) continue;
      std::uint32_t id = 0;
      std::memcpy(&id, message->data() + 1, sizeof(id));
      heard[topics.at(id)].push_back(message->substr(13));
    }
    return heard;
  }
  static std::string NameOf(const std::string& message) {
    if (message.starts_with("{")) return json::parse(message)["k"];
    std::uint32_t kind = 0;
    std::memcpy(&kind, message.data(), sizeof(kind));
    return std::to_string(kind);
  }
  static std::string NameOf(FrameKind kind) {
    return std::to_string(static_cast<std::uint32_t>(kind));
  }
  /// All that a client is told until it is quiet: kind -> messages.
  static std::map<std::string, std::vector<std::string>> HearAll(WebClient& client) {
    std::map<std::string, std::vector<std::string>> heard;
    while (const auto message = client.Hear()) heard[NameOf(*message)].push_back(*message);
    return heard;
  }
  static SubmapPlace PlaceOf(SubmapId id, const Vec3& position_W) {
    SubmapPlace place;
    place.id = id;
    place.X_WM = MakePose(position_W);
    return place;
  }
  /// x of the first submap in a frame of poses.
  static float FirstX(const std::string& frame) {
    float x = 0;
    std::memcpy(&x, frame.data() + 28, sizeof(x));
    return x;
  }

  Bench bench_;
  ViewerSettings settings_;
  std::unique_ptr<Process<ViewerNode>> dut_;
  Random random_{1, "viewer"};
};

TEST_F(ViewerNodeTest, WhoComesLateSeesTheWholeRun) {
  Dut();
  for (int id = 0; id < 3; ++id) SaySubmap(*RandomSubmap(id, 0.1, random_));
  SayPlaces({PlaceOf(0, {0, 0, 0}), PlaceOf(1, {1, 0, 0}), PlaceOf(2, {2, 0, 0})}, 1, At(1));
  bench_.Say(outputs::kGraph, graph_t{}, At(1));
  for (int i = 0; i < 50; ++i)
    SayBody(2 + 0.1 * i, {0.1 * i, 0, 0}, {0.1 * i, 0, 0}, {0.1 * i, 0, 0});
  bench_.Say(outputs::kMissionStatus, mission_status_t{}, At(8));
  bench_.RunUntil(At(10));
  const auto heard = HearAll(*Listen());
  EXPECT_EQ(heard.at(NameOf(FrameKind::kSubmap)).size(), 3u);
  EXPECT_GE(heard.at(NameOf(FrameKind::kFrontier)).size(), 10u);
  EXPECT_EQ(heard.at(NameOf(FrameKind::kTrail)).size(), 3u) << "estimate, odometry, truth";
  for (const FrameKind kind : {FrameKind::kPoses, FrameKind::kGraph, FrameKind::kEstimate,
                               FrameKind::kOdometry, FrameKind::kTruth})
    EXPECT_EQ(heard.at(NameOf(kind)).size(), 1u) << NameOf(kind);
  for (const char* name : {"welcome", "hello", "mission", "health", "series"})
    EXPECT_EQ(heard.at(name).size(), 1u) << name;
  const json hello = json::parse(heard.at("hello")[0]);
  EXPECT_EQ(hello["boxes"][0]["max"], json::parse("[3.0,3.0,2.0]"));
  EXPECT_EQ(hello["source"], "live");
}

TEST_F(ViewerNodeTest, FoxglovesClientsSeeTheWholeRunToo) {
  Dut();
  for (int id = 0; id < 3; ++id) SaySubmap(*RandomSubmap(id, 0.1, random_));
  SayPlaces({PlaceOf(0, {0, 0, 0}), PlaceOf(1, {1, 0, 0})}, 1, At(1));
  bench_.Say(outputs::kGraph, graph_t{}, At(1));
  for (int i = 0; i < 5; ++i) SayBody(2 + i, {1, 0, 0}, {1, 0, 0}, {1, 0, 0});
  bench_.Say(inputs::kDepth, depth_t{}, At(8));
  bench_.RunUntil(At(10));
  const auto heard = HearFeed();
  EXPECT_EQ(heard.at("SUBMAP/voxels").size(), 3u);
  EXPECT_EQ(heard.at("tf").size(), 2u) << "O in W, B in O";
  for (const char* topic : {"tf/submaps", "GRAPH", "SUBMAP_POSES", "POSE", "NAV", "TRUTH", "DEPTH",
                            "GRAPH/fields", "STATUS"})
    EXPECT_EQ(heard.at(topic).size(), 1u) << topic;
  foxglove::FrameTransforms frames;
  ASSERT_TRUE(frames.ParseFromString(heard.at("tf/submaps")[0]));
  EXPECT_EQ(frames.transforms(1).child_frame_id(), "M1");
  EXPECT_EQ(frames.transforms(1).translation().x(), 1);
}

TEST_F(ViewerNodeTest, FoxglovesClientsSeeAMapWithoutARun) {
  submap_poses_t places = ToMessage(std::vector<SubmapPlace>{PlaceOf(4, {1, 0, 0})});
  Dut().ShowMap({RandomSubmap(4, 0.1, random_)}, places, graph_t{});
  const auto heard = HearFeed();
  for (const char* topic : {"SUBMAP/voxels", "tf/submaps", "SUBMAP_POSES", "GRAPH"})
    EXPECT_EQ(heard.at(topic).size(), 1u) << topic;
  EXPECT_EQ(HearAll(*Listen()).at(NameOf(FrameKind::kPoses)).size(), 1u);
}

TEST_F(ViewerNodeTest, ALoopClosureIsPosesAloneAndMovesThem) {
  auto client = Listen();
  for (int id = 0; id < 3; ++id) SaySubmap(*RandomSubmap(id, 0.1, random_));
  SayPlaces({PlaceOf(0, {0, 0, 0}), PlaceOf(1, {1, 0, 0})}, 1, At(1));
  HearAll(*client);
  SayPlaces({PlaceOf(0, {0.5, 0, 0}), PlaceOf(1, {1.25, 0, 0})}, 2, At(2));
  const auto heard = HearAll(*client);
  ASSERT_EQ(heard.at(NameOf(FrameKind::kPoses)).size(), 1u);
  EXPECT_EQ(FirstX(heard.at(NameOf(FrameKind::kPoses))[0]), 0.5f);
  EXPECT_EQ(heard.count(NameOf(FrameKind::kSubmap)), 0u) << "no voxel is sent again";
}

TEST_F(ViewerNodeTest, TheSliderAsksForThePast) {
  auto client = Listen();
  SayPlaces({PlaceOf(0, {1, 0, 0})}, 1, At(1));
  SayPlaces({PlaceOf(0, {5, 0, 0})}, 2, At(5));
  HearAll(*client);
  client->Say(R"({"k":"at","t":3e6})");
  EXPECT_EQ(client->Hear(), R"({"k":"at_begin","t":3000000.0})");
  EXPECT_EQ(FirstX(client->Hear().value_or(std::string(40, ' '))), 1);
  const auto rest = HearAll(*client);
  EXPECT_EQ(rest.count("at_end"), 1u);
  for (const char* nonsense :
       {R"({"k":"at"})", R"({"k":"at","t":"now"})", R"({"k":17})", R"({})", R"({"k":"fly"})"}) {
    client->Say(nonsense);
    EXPECT_EQ(NameOf(client->Hear().value_or("{\"k\":\"\"}")), "refused") << nonsense;
  }
  for (const char* extreme : {R"({"k":"at","t":-1e300})", R"({"k":"at","t":1e300})"}) {
    client->Say(extreme);
    EXPECT_EQ(HearAll(*client).count("at_end"), 1u) << extreme;
  }
  bench_.RunFor(std::chrono::seconds(2));
  EXPECT_EQ(bench_.CounterOf("vog-viewer", "requests_refused"), 5);
}

TEST_F(ViewerNodeTest, ErrorsAreThoseOfTheirMoment) {
  auto client = Listen();
  SayBody(1, {1, 0, 0}, {0, 0, 0}, {1, 0, 0});
  // The odometry's world stays where it was when it was first heard of: 1 m ahead in x.
  SayBody(2.5, {2, 0.3, 0}, {1.6, 0, 0}, {2, 0, 0});
  const auto heard = HearAll(*client);
  const json samples = json::parse(heard.at("series").back())["samples"];
  ASSERT_EQ(samples.size(), 2u);
  EXPECT_NEAR(samples[1][1].get<double>(), 0.3, 1e-9);
  EXPECT_NEAR(samples[1][2].get<double>(), 0.6, 1e-9);
}

TEST_F(ViewerNodeTest, ANewMapStartsAnew) {
  auto client = Listen();
  const SubmapPtr first = RandomSubmap(0, 0.1, random_);
  SaySubmap(*first);
  EXPECT_EQ(HearAll(*client).at(NameOf(FrameKind::kSubmap)).size(), 1u);
  SaySubmap(*RandomSubmap(0, 0.1, random_));  // Another submap of the same number.
  const auto heard = HearAll(*client);
  EXPECT_EQ(heard.count("reset"), 1u);
  EXPECT_EQ(heard.count("hello"), 1u);
  EXPECT_EQ(heard.at(NameOf(FrameKind::kSubmap)).size(), 1u);
  const auto voxels = HearFeed().at("SUBMAP/voxels");
  ASSERT_EQ(voxels.size(), 2u) << "away with the old ones; the new one";
  foxglove::SceneUpdate update;
  ASSERT_TRUE(update.ParseFromString(voxels[0]));
  EXPECT_EQ(update.deletions_size(), 1);
}

TEST_F(ViewerNodeTest, OrdersGoOutWhereTheyAreAllowedAlone) {
  {
    auto client = Listen();
    HearAll(*client);
    client->Say(R"({"k":"command","command":"abort"})");
    EXPECT_EQ(NameOf(client->Hear().value_or("{\"k\":\"\"}")), "refused");
    Settle();
    EXPECT_TRUE(bench_.Said(outputs::kOperator).empty());
  }
  dut_.reset();
  settings_.viewer.token = kToken;
  settings_.viewer.operators = true;
  auto client = Listen();
  EXPECT_EQ(json::parse(HearAll(*client).at("welcome")[0])["operators"], true);
  for (const std::string command : {"pause", "resume", "go_home", "abort"}) {
    client->Say(json({{"k", "command"}, {"command", command}}).dump());
    EXPECT_EQ(NameOf(client->Hear().value_or("{\"k\":\"\"}")), "obeyed");
    Settle();
    const operator_command_t said = bench_.Last(outputs::kOperator);
    EXPECT_EQ(said.command, command);
    EXPECT_EQ(said.header.sender, "vog-viewer");
    EXPECT_EQ(said.header.run_id, Bench::kRun);
  }
  client->Say(R"({"k":"command","command":"self_destruct"})");
  EXPECT_EQ(NameOf(client->Hear().value_or("{\"k\":\"\"}")), "refused");
  Settle();
  EXPECT_EQ(bench_.Said(outputs::kOperator).size(), 4u);
}

TEST_F(ViewerNodeTest, DamagedMessagesAreCountedAndHarmless) {
  auto client = Listen();
  SayPlaces({PlaceOf(0, {1, 0, 0})}, 1, At(1));
  int damaged = 0;
  damaged += SayDamaged(bench_, outputs::kSubmapPoses, submap_poses_t{}, random_);
  damaged += SayDamaged(bench_, outputs::kGraph, graph_t{}, random_);
  damaged += SayDamaged(bench_, outputs::kPose, pose_estimate_t{}, random_);
  damaged += SayDamaged(bench_, outputs::kPlan, plan_t{}, random_);
  damaged += SayDamaged(bench_, outputs::kStatus, status_t{}, random_);
  damaged += SayDamaged(bench_, inputs::kTruth, truth_t{}, random_);
  // Whole, but impossible: no rotation.
  bench_.Say(outputs::kPose, pose_estimate_t{}, At(2));
  bench_.Say(inputs::kTruth, truth_t{}, At(2));
  bench_.RunUntil(At(5));
  EXPECT_EQ(
      bench_.CounterOf("vog-viewer", "malformed") + bench_.CounterOf("vog-viewer", "other_run"),
      damaged + 2);
  const auto heard = HearAll(*client);
  EXPECT_EQ(FirstX(heard.at(NameOf(FrameKind::kPoses)).back()), 1);
  EXPECT_EQ(heard.count(NameOf(FrameKind::kEstimate)), 0u);
}

}  // namespace
}  // namespace vog
