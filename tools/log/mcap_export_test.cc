#include "tools/log/mcap_export.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include "foxglove/FrameTransform.pb.h"
#include "foxglove/PoseInFrame.pb.h"
#include "foxglove/RawImage.pb.h"
#include "foxglove/SceneUpdate.pb.h"
#include "lib/base/errors.h"
#include "lib/messages/channels.h"
#include "lib/messages/convert.h"
#include "lib/messages/endpoint.h"
#include "tools/log/log_testing.h"
#include "tools/log/mcap_testing.h"
#include "vogmap/lcm_message.pb.h"
#include "vogmap/messages.pb.h"

namespace vog {
namespace {

namespace pb = google::protobuf;

template <class Message>
LogEvent EventOf(double s, const Channel<Message>& channel, Message message) {
  message.header.utime_us = 1'000'000;
  message.header.sequence = 42;
  return {FromUtime(0) + FromSeconds(s), channel.name, Encode(message)};
}

nav_t NavAt(double x_m) {
  nav_t nav{};
  nav.X_OB = ToMessage(MakePose({x_m, 0, -1}));
  nav.velocity_B_m_s[0] = 0.5;
  return nav;
}

template <class Message>
Message Parsed(const McapContent::Message& message) {
  Message parsed;
  EXPECT_TRUE(parsed.ParseFromString(message.bytes));
  return parsed;
}

class McapExportTest : public LogTest {
 protected:
  McapContent Export(const std::vector<LogEvent>& events) {
    done_ = ExportToMcap(LogTest::Write("a.log", events), PathOf("a.mcap"),
                         [this](double share) { shares_.push_back(share); });
    return McapContent(PathOf("a.mcap"));
  }

  McapExport done_;
  std::vector<double> shares_;
};

TEST_F(McapExportTest, AChannelThatIsDrawnIsThereWithAllItsFieldsToo) {
  const McapContent content =
      Export({EventOf(2, outputs::kNav, NavAt(1)), EventOf(3, outputs::kNav, NavAt(2))});
  EXPECT_EQ(done_.messages, 2);
  EXPECT_EQ(done_.malformed, 0);
  const auto drawn = content.On("NAV"), fields = content.On("NAV/fields"), tf = content.On("tf");
  ASSERT_EQ(drawn.size(), 2u);
  ASSERT_EQ(fields.size(), 2u);
  ASSERT_EQ(tf.size(), 2u);
  EXPECT_EQ(drawn[0].log_time_ns, 2'000'000'000u);
  EXPECT_EQ(drawn[0].publish_time_ns, 1'000'000'000u);
  EXPECT_EQ(drawn[0].sequence, 42u);
  EXPECT_EQ(Parsed<foxglove::PoseInFrame>(drawn[1]).pose().position().x(), 2);
  EXPECT_EQ(Parsed<vogmap::Nav>(fields[1]).velocity_b_m_s(0), 0.5);
  EXPECT_EQ(Parsed<foxglove::FrameTransform>(tf[1]).translation().z(), -1);
}

TEST_F(McapExportTest, SamplesOfASonarFrameAreInItsImageAlone) {
  const SonarFrame frame{{}, 0, 0.1, 1, 10, 3, 2, {1, 2, 3, 4, 5, 6}};
  const McapContent content = Export({EventOf(0, inputs::kSonarFrame, ToMessage(frame))});
  EXPECT_EQ(Parsed<foxglove::RawImage>(content.On("SONAR_FRAME").at(0)).data().size(), 6u);
  const auto fields = Parsed<vogmap::SonarFrame>(content.On("SONAR_FRAME/fields").at(0));
  EXPECT_EQ(fields.tilt_rad(), 0.1);
  EXPECT_EQ(fields.size(), 6);
  EXPECT_TRUE(fields.samples().empty());
}

TEST_F(McapExportTest, OtherChannelsAreThereWithTheirFields) {
  map_status_t open{};
  open.submaps = 3;
  open.has_open = true;
  open.open.submap_id = 3;
  open.fault = "disk \xFF full";
  const McapContent content = Export(
      {EventOf(0, outputs::kMapStatus, map_status_t{}), EventOf(1, outputs::kMapStatus, open)});
  const auto messages = content.On("MAP_STATUS");
  ASSERT_EQ(messages.size(), 2u);
  EXPECT_FALSE(Parsed<vogmap::MapStatus>(messages[0]).has_open());
  const auto found = Parsed<vogmap::MapStatus>(messages[1]);
  EXPECT_EQ(found.submaps(), 3);
  EXPECT_EQ(found.open().submap_id(), 3);
  EXPECT_EQ(found.fault(), "disk ? full");
}

TEST_F(McapExportTest, ArraysOfArraysAreLaidOutOneAfterTheOther) {
  map_request_t request{};
  request.points = 2;
  request.point_W_m = {{1, 2, 3}, {4, 5, 6}};
  const auto found = Parsed<vogmap::MapRequest>(
      Export({EventOf(0, outputs::kMapRequest, request)}).On("MAP_REQUEST").at(0));
  ASSERT_EQ(found.point_w_m_size(), 6);
  EXPECT_EQ(found.point_w_m(3), 4);
}

TEST_F(McapExportTest, AGraphIsDrawnAtTheNewestPoses) {
  graph_t graph{};
  graph.count = 1;
  graph.edge.resize(1);
  graph.edge[0].to_id = 1;
  const auto places = [](double x_m) {
    return ToMessage({{0, Pose3::Identity()}, {1, MakePose({x_m, 0, 0})}});
  };
  const auto drawn =
      Export({EventOf(0, outputs::kSubmapPoses, places(1)),
              EventOf(1, outputs::kSubmapPoses, places(2)), EventOf(1, outputs::kGraph, graph)})
          .On("GRAPH");
  ASSERT_EQ(drawn.size(), 1u);
  EXPECT_EQ(Parsed<foxglove::SceneUpdate>(drawn[0]).entities(0).lines(0).points(1).x(), 2);
}

TEST_F(McapExportTest, WhatMakesNoSenseIsKeptAsItIs) {
  LogEvent short_one = EventOf(1, outputs::kNav, NavAt(1));
  short_one.bytes.pop_back();
  const McapContent content =
      Export({short_one, EventOf(2, outputs::kNav, nav_t{}), EventOf(3, outputs::kNav, NavAt(1)),
              EventAt(4, "tf", "a stranger"), EventAt(5, "HAUV\xFF", "x")});
  EXPECT_EQ(done_.messages, 5);
  EXPECT_EQ(done_.malformed, 2) << "one is cut short, one has a quaternion of zeros";
  EXPECT_EQ(content.On("NAV").size(), 1u);
  const auto malformed = content.On("NAV/malformed");
  ASSERT_EQ(malformed.size(), 2u);
  EXPECT_EQ(malformed[0].publish_time_ns, malformed[0].log_time_ns);
  const auto cut_short = Parsed<vogmap::LcmMessage>(malformed[0]);
  EXPECT_EQ(cut_short.channel(), "NAV");
  EXPECT_EQ(cut_short.fingerprint(), static_cast<std::uint64_t>(nav_t::getHash()));
  EXPECT_EQ(cut_short.bytes().size(), short_one.bytes.size());
  const auto both = content.On("tf");
  ASSERT_EQ(both.size(), 2u) << "a transform and a stranger of another schema";
  EXPECT_NE(both[0].channel_id, both[1].channel_id);
  EXPECT_EQ(Parsed<vogmap::LcmMessage>(both[1]).bytes(), "a stranger");
  EXPECT_EQ(Parsed<vogmap::LcmMessage>(content.On("HAUV?").at(0)).fingerprint(), 0u);
}

TEST_F(McapExportTest, EverySchemaStandsByItself) {
  const McapContent content =
      Export({EventOf(0, outputs::kNav, NavAt(1)), EventOf(0, outputs::kGraph, graph_t{}),
              EventOf(0, outputs::kStatus, status_t{}), EventOf(0, inputs::kRun, run_t{})});
  EXPECT_EQ(content.schemas.size(), 8u) << "four with fields, a frame, three that are drawn";
  for (const auto& [id, schema] : content.schemas) {
    pb::FileDescriptorSet set;
    ASSERT_TRUE(set.ParseFromString(schema.data));
    pb::DescriptorPool pool;
    for (const pb::FileDescriptorProto& file : set.file())
      ASSERT_NE(pool.BuildFile(file), nullptr) << schema.name << " " << file.name();
    EXPECT_NE(pool.FindMessageTypeByName(schema.name), nullptr);
    EXPECT_EQ(pool.FindMessageTypeByName("vogmap.Truth"), nullptr) << "nobody needs it";
  }
}

TEST_F(McapExportTest, ProgressEndsWithTheWhole) {
  Export({EventOf(0, outputs::kNav, NavAt(1)), EventAt(1, "A", "abc"), EventAt(1, "B", "")});
  ASSERT_EQ(shares_.size(), 3u);
  EXPECT_LT(shares_[1], 1);
  EXPECT_EQ(shares_[2], 1);
}

TEST_F(McapExportTest, RefusesWhatCannotBe) {
  const std::string log = LogTest::Write("a.log", {EventAt(0, "A", "0")});
  const auto ignore = [](double) {};
  EXPECT_THROW(ExportToMcap(PathOf("nosuch.log"), PathOf("a.mcap"), ignore), UsageError);
  EXPECT_THROW(ExportToMcap(log, log, ignore), UsageError);
  EXPECT_EQ(TextOf(log), "0");
  EXPECT_THROW(ExportToMcap(log, PathOf("nosuch/a.mcap"), ignore), SystemError);
  EXPECT_FALSE(std::filesystem::exists(PathOf("a.mcap")));
}

}  // namespace
}  // namespace vog
