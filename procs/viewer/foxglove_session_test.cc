#include "procs/viewer/foxglove_session.h"

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <vector>

namespace vog {
namespace {

using nlohmann::json;

constexpr std::size_t kRecent_bytes = 1000;
constexpr std::uint64_t kSecond_ns = 1'000'000'000;

/// A client of a session, and a feed to post to.
class FoxgloveSessionTest : public testing::Test {
 protected:
  void Post(const std::string& topic, const std::string& bytes, const std::string& key = "",
            bool voids_earlier = false) {
    feed_.Post({.topic = topic,
                .key = key,
                .schema = &schema_,
                .bytes = bytes,
                .log_ns = kSecond_ns,
                .voids_earlier = voids_earlier});
  }

  struct Heard {
    std::vector<json> texts;
    std::vector<std::pair<std::uint32_t, std::string>> messages;  // Subscription, payload.
    std::vector<std::uint64_t> times_ns;

    /// The one text of this op; null where there is not exactly one.
    json Only(const std::string& op) const {
      std::vector<json> found;
      for (const json& text : texts)
        if (text["op"] == op) found.push_back(text);
      return found.size() == 1 ? found[0] : json();
    }
  };
  static Heard HearAll(FoxgloveSession& session, int limit = 1000) {
    Heard heard;
    for (int i = 0; i < limit; ++i) {
      const auto frame = session.NextFrame();
      if (!frame) break;
      const std::string& bytes = *frame->bytes;
      std::uint32_t id = 0;
      std::uint64_t time_ns = 0;
      if (frame->is_text) {
        heard.texts.push_back(json::parse(bytes));
      } else if (bytes.at(0) == 1) {
        std::memcpy(&id, bytes.data() + 1, sizeof(id));
        std::memcpy(&time_ns, bytes.data() + 5, sizeof(time_ns));
        EXPECT_EQ(time_ns, kSecond_ns);
        heard.messages.emplace_back(id, bytes.substr(13));
      } else {
        EXPECT_EQ(bytes.at(0), 2);
        EXPECT_EQ(bytes.size(), 9u);
        std::memcpy(&time_ns, bytes.data() + 1, sizeof(time_ns));
        heard.times_ns.push_back(time_ns);
      }
    }
    return heard;
  }
  Heard HearAll() { return HearAll(dut_); }
  void Say(const std::string& text) { EXPECT_FALSE(dut_.OnMessage(text, true)) << text; }
  void Subscribe(std::uint32_t id, std::uint32_t channel_id) {
    Say(json({{"op", "subscribe"}, {"subscriptions", {{{"id", id}, {"channelId", channel_id}}}}})
            .dump());
  }
  static std::vector<std::string> PayloadsIn(const Heard& heard) {
    std::vector<std::string> payloads;
    for (const auto& [id, payload] : heard.messages) payloads.push_back(payload);
    return payloads;
  }
  using Payloads = std::vector<std::string>;

  const ProtoSchema schema_{"vogmap.Thing", "descriptor"};
  FoxgloveFeed feed_{kRecent_bytes};
  WebCounts counts_;
  FoxgloveSession dut_{feed_, counts_};
};

TEST_F(FoxgloveSessionTest, GreetsAndAdvertises) {
  const Heard first = HearAll();
  ASSERT_EQ(first.texts.size(), 2u);
  EXPECT_EQ(first.texts[0]["op"], "serverInfo");
  EXPECT_EQ(first.texts[0]["capabilities"], json::array({"time"}));
  EXPECT_EQ(first.texts[1], json({{"op", "advertise"}, {"channels", json::array()}}));
  EXPECT_TRUE(first.times_ns.empty());
  Post("NAV", "a");
  Post("NAV", "b");
  const Heard second = HearAll();
  EXPECT_EQ(second.Only("advertise")["channels"], json::array({{{"id", 1},
                                                                {"topic", "NAV"},
                                                                {"encoding", "protobuf"},
                                                                {"schemaName", "vogmap.Thing"},
                                                                {"schema", "ZGVzY3JpcHRvcg=="},
                                                                {"schemaEncoding", "protobuf"}}}));
  EXPECT_EQ(second.times_ns, std::vector<std::uint64_t>{kSecond_ns});
  EXPECT_TRUE(second.messages.empty()) << "nothing without a subscription";
}

TEST_F(FoxgloveSessionTest, WhoComesLateGetsTheNewestOfEachKeyAndThenAll) {
  for (int i = 0; i < 3; ++i) {
    Post("STATUS", "slam " + std::to_string(i), "slam");
    Post("STATUS", "sim " + std::to_string(i), "sim");
  }
  Post("OTHER", "not asked for");
  HearAll();
  Subscribe(7, 1);
  EXPECT_EQ(PayloadsIn(HearAll()), (Payloads{"slam 2", "sim 2"}));
  for (int i = 3; i < 6; ++i) Post("STATUS", "slam " + std::to_string(i), "slam");
  const Heard heard = HearAll();
  EXPECT_EQ(PayloadsIn(heard), (Payloads{"slam 3", "slam 4", "slam 5"})) << "all that come";
  EXPECT_EQ(heard.messages[0].first, 7u);
  Say(R"({"op":"unsubscribe","subscriptionIds":[7]})");
  Post("STATUS", "slam 6", "slam");
  EXPECT_TRUE(HearAll().messages.empty());
  EXPECT_EQ(counts_.malformed, 0);
  EXPECT_EQ(counts_.skipped, 0);
}

TEST_F(FoxgloveSessionTest, TopicsAreToldInTheOrderInWhichTheyWereHeard) {
  Post("A", "");
  Post("B", "");
  HearAll();
  Subscribe(1, 1);
  Subscribe(2, 2);
  HearAll();
  for (const char* topic : {"B", "A", "A", "B"}) Post(topic, topic);
  EXPECT_EQ(PayloadsIn(HearAll()), (Payloads{"B", "A", "A", "B"}));
}

TEST_F(FoxgloveSessionTest, WhoIsSlowMissesWhatWasReplacedAndTheBacklogDoesNotGrow) {
  Post("NAV", "");
  Post("VOXELS", "of submap 0", "0");
  HearAll();
  Subscribe(1, 1);
  Subscribe(2, 2);
  HearAll();
  Post("VOXELS", "of submap 1", "1");
  const std::string long_text(90, 'x');
  for (int i = 0; i < 1000; ++i) Post("NAV", long_text + std::to_string(i));
  EXPECT_LE(feed_.channels().at(1).messages.size(), kRecent_bytes / 90);
  FoxgloveSession quick(feed_, counts_);
  HearAll(quick);
  const Payloads heard = PayloadsIn(HearAll());
  EXPECT_EQ(heard.front(), "of submap 1") << "nothing has replaced it";
  EXPECT_EQ(heard.back(), long_text + "999");
  EXPECT_LT(heard.size(), 15u);
  EXPECT_EQ(counts_.skipped + static_cast<std::int64_t>(heard.size()) - 1, 1000);
}

TEST_F(FoxgloveSessionTest, ATopicThatIsVoidIsAdvertisedAnew) {
  Post("VOXELS", "old", "0");
  HearAll();
  Subscribe(1, 1);
  HearAll();
  Post("VOXELS", "none", "", true);
  Post("VOXELS", "new", "0");
  const Heard heard = HearAll();
  EXPECT_EQ(heard.Only("unadvertise")["channelIds"], json::array({1}));
  EXPECT_EQ(heard.Only("advertise")["channels"][0]["id"], 2);
  EXPECT_EQ(heard.Only("advertise")["channels"][0]["topic"], "VOXELS");
  EXPECT_TRUE(heard.messages.empty());
  Say(R"({"op":"unsubscribe","subscriptionIds":[1]})");
  Subscribe(1, 2);
  const Heard anew = HearAll();
  EXPECT_EQ(PayloadsIn(anew), (Payloads{"none", "new"}));
  EXPECT_TRUE(anew.texts.empty());
  Post("OTHER", std::string(2 * kRecent_bytes, 'x'));  // Nothing of the old channel is counted.
  FoxgloveSession late(feed_, counts_);
  const json channels = HearAll(late).Only("advertise")["channels"];
  EXPECT_EQ(channels.size(), 2u);
}

TEST_F(FoxgloveSessionTest, TypesOfOneTopicHaveAChannelEach) {
  const ProtoSchema other{"vogmap.Other", ""};
  Post("tf", "a");
  feed_.Post({.topic = "tf", .key = "", .schema = &other, .bytes = "b", .log_ns = kSecond_ns});
  EXPECT_EQ(HearAll().Only("advertise")["channels"].size(), 2u);
}

TEST_F(FoxgloveSessionTest, WhatMakesNoSenseIsAnsweredCountedAndHarmless) {
  Post("NAV", "a");
  HearAll();
  Subscribe(5, 1);
  HearAll();
  const std::vector<std::string> nonsense = {
      "",
      "{",
      "[]",
      "17",
      "null",
      R"("subscribe")",
      R"({"op":17})",
      R"({"op":"fly"})",
      R"({"op":"advertise","channels":[{"id":1,"topic":"OPERATOR"}]})",
      R"({"op":"getParameters","parameterNames":[]})",
      R"({"op":"subscribe")",
      R"({"op":"subscribe"})",
      R"({"op":"subscribe","subscriptions":{}})",
      R"({"op":"subscribe","subscriptions":[17,null,[]]})",
      R"({"op":"subscribe","subscriptions":[{"id":"1","channelId":1}]})",
      R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
      R"({"op":"subscribe","subscriptions":[{"id":1.5,"channelId":1}]})",
      R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":1}]})",
      R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":99}]})",
      R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":1}]})",  // A second time.
      R"({"op":"unsubscribe"})",
      R"({"op":"unsubscribe","subscriptionIds":[6,"5",null]})",
      "{\"op\":\"\xFF\xFE\"}",
  };
  for (const std::string& text : nonsense) {
    Say(text);
    const Heard heard = HearAll();
    EXPECT_EQ(heard.texts.size(), 1u) << text;
    EXPECT_EQ(heard.Only("status")["level"], 2) << text;
  }
  EXPECT_FALSE(dut_.OnMessage(std::string("\1\1\0\0\0OPERATOR", 13), false));
  EXPECT_EQ(HearAll().Only("status")["level"], 2);
  EXPECT_EQ(counts_.malformed, static_cast<std::int64_t>(nonsense.size()) + 1);
  Post("NAV", "still here");
  EXPECT_EQ(PayloadsIn(HearAll()), Payloads{"still here"});
}

TEST_F(FoxgloveSessionTest, AHugeListIsOneAnswer) {
  Post("NAV", "a");
  HearAll();
  json list = json::array();
  for (int i = 0; i < 100'000; ++i) list.push_back({{"id", i}, {"channelId", 1 + i % 2}});
  Say(json({{"op", "subscribe"}, {"subscriptions", list}}).dump());
  const Heard heard = HearAll();
  EXPECT_EQ(heard.texts.size(), 1u);
  EXPECT_NE(heard.Only("status")["message"].get<std::string>().find("99999 of 100000"),
            std::string::npos);
  EXPECT_EQ(heard.messages.size(), 1u) << "the first one counts";
}

}  // namespace
}  // namespace vog
