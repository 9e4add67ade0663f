#include "procs/map_service/map_server_node.h"

#include <gtest/gtest.h>

#include "lib/submap/submaps_testing.h"
#include "procs/map_service/node_testing.h"

namespace vog {
namespace {

class MapServerNodeTest : public testing::Test {
 protected:
  static VogMap MakeMap() {
    Random random(1, "map_server");
    VogMap map(0.1, SensorModel(SensorModelOptions{}));
    map.Place(MakeSubmap(0, GridOf(0.1, {{{5, 0, 0}, 100}, {{4, 0, 0}, -50}}), random),
              Pose3::Identity());
    return map;
  }

  std::vector<map_reply_t> Ask(const map_request_t& request) {
    bench_.Forget();
    bench_.Say(outputs::kMapRequest, request, bench_.queue.now());
    bench_.RunFor(Duration(0));
    return bench_.SaidLarge<map_reply_t>(outputs::kMapReply);
  }

  Bench bench_;
  ProcessBus bus_{bench_.queue, "dut", 1};
  MapServerNode dut_{bus_, MakeMap(), 0};
};

TEST_F(MapServerNodeTest, AnswersForASavedMap) {
  map_request_t request{};
  request.request_id = 42;
  request.kind = "ray";
  request.method = "cached";
  request.origin_W_m[0] = request.origin_W_m[1] = request.origin_W_m[2] = 0.05;
  request.direction_W[0] = 1;
  request.range_m = 3;
  const auto replies = Ask(request);
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_EQ(replies[0].request_id, 42);
  EXPECT_EQ(replies[0].error, "");
  ASSERT_EQ(replies[0].count, 6);
  EXPECT_EQ(replies[0].log_odds[5], ToLogOdds(SensorModel(SensorModelOptions{}).Clamp(100)));
  EXPECT_EQ(replies[0].header.run_id, Bench::kRun);  // That of who asks first.
  request.kind = "nonsense";
  ASSERT_EQ(Ask(request).size(), 1u);
  EXPECT_NE(Ask(request)[0].error, "");
}

TEST_F(MapServerNodeTest, LeavesToOthersWhatASavedMapDoesNotHave) {
  map_request_t request{};
  for (const char* kind : {"poses", "submaps"}) {
    request.kind = kind;
    EXPECT_TRUE(Ask(request).empty()) << kind;
  }
  bench_.RunFor(std::chrono::seconds(1));
  EXPECT_EQ(bench_.CounterOf("vog-map-server", "submaps"), 1);
  EXPECT_EQ(bench_.CounterOf("vog-map-server", "answers"), 0);
}

}  // namespace
}  // namespace vog
