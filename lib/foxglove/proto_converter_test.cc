#include "lib/foxglove/proto_converter.h"

#include <gtest/gtest.h>

#include <vector>

#include "lib/messages/convert.h"
#include "lib/messages/fake_bus_testing.h"
#include "lib/submap/octree_file.h"
#include "lib/submap/submaps_testing.h"

namespace vog {
namespace {

class ProtoConverterTest : public testing::Test {
 protected:
  template <class Message>
  bool Say(const Channel<Message>& channel, Message message, const std::string& sender = "sim") {
    message.header.sender = sender;
    return dut_.Add(FromUtime(1'000'000), channel.name, Encode(message));
  }
  /// The chunks of a submap, as the map service says them.
  std::vector<FakeBus::Sent> ChunksOf(const Submap& submap, std::int64_t version) {
    Endpoint endpoint(bus_, "map_service", 7);
    endpoint.PublishLarge(outputs::kSubmap, submap.id(), version,
                          ToMessage(submap, ToOctreeBytes(submap.grid)), FromUtime(2'000'000));
    return bus_.TakeSent();
  }
  void Say(const std::vector<FakeBus::Sent>& messages) {
    for (const auto& [channel, bytes] : messages)
      EXPECT_TRUE(dut_.Add(FromUtime(2'000'000), channel, bytes));
  }
  std::vector<ProtoMessage> On(const std::string& topic) const {
    std::vector<ProtoMessage> found;
    for (const ProtoMessage& message : written_)
      if (message.topic == topic) found.push_back(message);
    return found;
  }
  static foxglove::SceneUpdate Scene(const ProtoMessage& message) {
    foxglove::SceneUpdate update;
    EXPECT_EQ(message.schema->name, "foxglove.SceneUpdate");
    EXPECT_TRUE(update.ParseFromString(message.bytes));
    return update;
  }

  FakeBus bus_;
  Random random_{1, "converter"};
  std::vector<ProtoMessage> written_;
  ProtoConverter dut_{[this](const ProtoMessage& message) { written_.push_back(message); }};
};

TEST_F(ProtoConverterTest, ASubmapIsDrawnWhenItIsWholeAndOnce) {
  const SubmapPtr submap = RandomSubmap(3, 0.1, random_);
  const auto chunks = ChunksOf(*submap, 17);
  Say(chunks);
  Say(chunks);  // Somebody has asked for it again.
  const auto voxels = On("SUBMAP/voxels");
  ASSERT_EQ(voxels.size(), 1u);
  EXPECT_EQ(voxels[0].key, "3");
  EXPECT_EQ(voxels[0].log_ns, 2'000'000'000u);
  EXPECT_FALSE(voxels[0].voids_earlier);
  const LogOddsUnits occupied_from = SensorModel(SensorModelOptions()).occupied_from;
  EXPECT_EQ(voxels[0].bytes, VoxelsOf(*submap, occupied_from).SerializeAsString());
  EXPECT_EQ(On("SUBMAP").size(), 2 * chunks.size());
  dut_.AddSubmap(FromUtime(5), *RandomSubmap(4, 0.1, random_));
  EXPECT_EQ(On("SUBMAP/voxels").back().key, "4");
}

TEST_F(ProtoConverterTest, ARunTellsFromWhereOnAVoxelIsOccupied) {
  run_t run{};
  run.config_toml = "[sensor_model]\noccupied_probability = 0.9";
  Say(inputs::kRun, run);
  run.config_toml = "[sensor_model]\noccupied_probability = \"nonsense";
  Say(inputs::kRun, run);
  const SubmapPtr submap = RandomSubmap(0, 0.1, random_);
  Say(ChunksOf(*submap, 1));
  const LogOddsUnits sure = ToUnits(LogOddsOfProbability(0.9));
  EXPECT_EQ(On("SUBMAP/voxels").at(0).bytes, VoxelsOf(*submap, sure).SerializeAsString());
  EXPECT_LT(Scene(On("SUBMAP/voxels").at(0)).entities(0).cubes_size(),
            VoxelsOf(*submap, 0).entities(0).cubes_size());
}

TEST_F(ProtoConverterTest, AnotherMapTakesTheOldOnesVoxelsAway) {
  Say(ChunksOf(*RandomSubmap(0, 0.1, random_), 1));
  Say(ChunksOf(*RandomSubmap(1, 0.1, random_), 2));
  Say(ChunksOf(*RandomSubmap(0, 0.1, random_), 3));
  auto voxels = On("SUBMAP/voxels");
  ASSERT_EQ(voxels.size(), 4u);
  EXPECT_TRUE(voxels[2].voids_earlier);
  EXPECT_EQ(Scene(voxels[2]).deletions_size(), 1);
  EXPECT_EQ(Scene(voxels[3]).entities(0).id(), "M0");
  dut_.ForgetSubmaps(FromUtime(9));
  EXPECT_TRUE(On("SUBMAP/voxels").back().voids_earlier);
  Say(ChunksOf(*RandomSubmap(0, 0.1, random_), 3));
  voxels = On("SUBMAP/voxels");
  EXPECT_EQ(voxels.size(), 6u) << "it comes again";
  EXPECT_FALSE(voxels.back().voids_earlier);
}

TEST_F(ProtoConverterTest, ChunksOfNonsenseDrawNothing) {
  chunk_t chunk{};
  chunk.parts = 1;
  EXPECT_TRUE(Say(outputs::kSubmap, chunk)) << "a chunk, though of nothing";
  chunk.item = -1;
  EXPECT_TRUE(Say(outputs::kSubmap, chunk));
  EXPECT_EQ(On("SUBMAP").size(), 2u);
  EXPECT_TRUE(On("SUBMAP/voxels").empty());
}

TEST_F(ProtoConverterTest, KeysTellWhatAMessageReplaces) {
  status_t status{};
  status.process = "vog-slam";
  Say(outputs::kStatus, status);
  EXPECT_EQ(On("STATUS").at(0).key, "vog-slam");
  EXPECT_EQ(On("STATUS/fields").at(0).key, "vog-slam");
  nav_t nav{};
  nav.X_OB = ToMessage(Pose3::Identity());
  Say(outputs::kNav, nav, "bridge \xFF");
  EXPECT_EQ(On("NAV").at(0).key, "bridge ?");
  pose_estimate_t pose{};
  pose.X_WO = pose.X_WB = ToMessage(Pose3::Identity());
  Say(outputs::kPose, pose);
  ASSERT_EQ(On("tf").size(), 2u);
  EXPECT_EQ(On("tf")[0].key, "B");
  EXPECT_EQ(On("tf")[1].key, "O");
  Say(outputs::kSubmapPoses, ToMessage(std::vector<SubmapPlace>{{0, Pose3::Identity()}}));
  EXPECT_EQ(On("tf/submaps").at(0).schema->name, "foxglove.FrameTransforms");
}

}  // namespace
}  // namespace vog
