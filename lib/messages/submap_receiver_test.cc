#include "lib/messages/submap_receiver.h"

#include <gtest/gtest.h>

#include "lib/base/files.h"
#include "lib/messages/convert.h"
#include "lib/messages/fake_bus_testing.h"
#include "lib/submap/octree_file.h"
#include "lib/submap/submaps_testing.h"

namespace vog {
namespace {

submap_t MessageOf(const Submap& submap) { return ToMessage(submap, ToOctreeBytes(submap.grid)); }

/// What a map service does towards a receiver: it announces submaps and sends those asked for.
class Service {
 public:
  void Add(SubmapPtr submap) { submaps_.push_back(std::move(submap)); }

  std::vector<FakeBus::Sent> Send(SubmapId id) {
    const submap_t message = MessageOf(*submaps_.at(id));
    endpoint_->PublishLarge(outputs::kSubmap, id, ContentChecksum(message), message, Time{});
    return bus_.TakeSent();
  }

  FakeBus::Sent Status() {
    map_status_t status{};
    status.submaps = static_cast<int>(submaps_.size());
    for (const SubmapPtr& submap : submaps_)
      status.digest = AppendToDigest(status.digest, ContentChecksum(MessageOf(*submap)));
    return Say(status);
  }
  FakeBus::Sent Say(const map_status_t& status) {
    endpoint_->Publish(outputs::kMapStatus, status, Time{});
    return bus_.TakeSent().at(0);
  }
  FakeBus::Sent Say(const chunk_t& chunk) {
    endpoint_->Publish(outputs::kSubmap, chunk, Time{});
    return bus_.TakeSent().at(0);
  }

  void Restart() {
    ++bus_.current_epoch;
    endpoint_ = std::make_unique<Endpoint>(bus_, "map_service", 7);
    submaps_.clear();
  }

  const std::vector<SubmapPtr>& submaps() const { return submaps_; }
  const Endpoint& endpoint() const { return *endpoint_; }

 private:
  FakeBus bus_;
  std::unique_ptr<Endpoint> endpoint_ = std::make_unique<Endpoint>(bus_, "map_service", 7);
  std::vector<SubmapPtr> submaps_;
};

class SubmapReceiverTest : public testing::Test {
 protected:
  SubmapReceiverTest() {
    for (int id = 0; id < 4; ++id) service_.Add(RandomSubmap(id, 0.1, random_));
  }

  void Deliver(const std::vector<FakeBus::Sent>& messages) {
    for (const auto& message : messages) bus_.Deliver(message);
  }

  /// A tick of the receiver; returns the ids that it asks for.
  std::vector<int> AskedFor() {
    bus_.TickAll();
    std::vector<int> ids;
    for (const auto& sent : bus_.TakeSent()) {
      map_request_t request{};
      EXPECT_EQ(sent.channel, "MAP_REQUEST");
      EXPECT_TRUE(Decode(sent.bytes, request));
      EXPECT_EQ(request.kind, "submaps");
      ids.insert(ids.end(), request.submap_id.begin(), request.submap_id.end());
    }
    return ids;
  }

  void ExpectHasAll() const {
    ASSERT_EQ(received_.size(), service_.submaps().size());
    for (const SubmapPtr& submap : service_.submaps())
      EXPECT_EQ(TableOf(received_.at(submap->id())->grid), TableOf(submap->grid));
    EXPECT_TRUE(dut_.IsComplete());
  }

  /// A chunk that carries `bytes` whole.
  static chunk_t ChunkOf(std::int64_t item, const std::vector<std::uint8_t>& bytes) {
    chunk_t chunk{};
    chunk.item = item;
    chunk.version = 1;
    chunk.parts = 1;
    chunk.crc32 = Crc32(AsText(bytes));
    chunk.bytes = bytes;
    chunk.size = static_cast<int>(bytes.size());
    return chunk;
  }

  Random random_{1, testing::UnitTest::GetInstance()->current_test_info()->name()};
  Service service_;
  FakeBus bus_;
  Endpoint endpoint_{bus_, "dut", 7};
  std::map<SubmapId, SubmapPtr> received_;
  int resets_ = 0, statuses_ = 0;
  SubmapReceiver dut_{endpoint_,
                      {[this](const SubmapPtr& submap) {
                         EXPECT_TRUE(received_.emplace(submap->id(), submap).second) << "twice";
                       },
                       [this] {
                         ++resets_;
                         received_.clear();
                       },
                       [this](const map_status_t&) { ++statuses_; }}};
};

TEST_F(SubmapReceiverTest, CollectsWhatTheServiceSends) {
  EXPECT_EQ(dut_.announced(), -1);
  EXPECT_FALSE(dut_.IsComplete());
  for (int id = 0; id < 4; ++id) Deliver(service_.Send(id));
  EXPECT_FALSE(dut_.IsComplete());  // Nobody has told how many there are.
  bus_.Deliver(service_.Status());
  EXPECT_EQ(dut_.announced(), 4);
  ExpectHasAll();
  map_status_t told{};
  ASSERT_TRUE(Decode(service_.Status().bytes, told));
  EXPECT_EQ(dut_.digest(), told.digest);
  EXPECT_EQ(resets_, 0);
  EXPECT_EQ(statuses_, 1);
  EXPECT_TRUE(AskedFor().empty());
  EXPECT_TRUE(AskedFor().empty());
}

TEST_F(SubmapReceiverTest, SubmapsSentTwiceComeOnce) {
  for (const int id : {2, 0, 2, 1, 0, 3, 3}) Deliver(service_.Send(id));
  bus_.Deliver(service_.Status());
  ExpectHasAll();
}

TEST_F(SubmapReceiverTest, AsksForWhatIsMissingATickLater) {
  Deliver(service_.Send(1));
  EXPECT_TRUE(AskedFor().empty());  // Nothing announced yet.
  bus_.Deliver(service_.Status());
  EXPECT_TRUE(AskedFor().empty());  // It may still be under way.
  EXPECT_EQ(AskedFor(), (std::vector<int>{0, 2, 3}));
  Deliver(service_.Send(2));
  EXPECT_EQ(AskedFor(), (std::vector<int>{0, 3}));
  for (const int id : {0, 3}) Deliver(service_.Send(id));
  EXPECT_TRUE(AskedFor().empty());
  ExpectHasAll();
}

TEST_F(SubmapReceiverTest, AsksForFewAtATime) {
  map_status_t status{};
  status.submaps = 1000;
  bus_.Deliver(service_.Say(status));
  EXPECT_TRUE(AskedFor().empty());
  const std::vector<int> ids = AskedFor();
  ASSERT_EQ(ids.size(), 16u);
  EXPECT_EQ(ids.front(), 0);
  EXPECT_EQ(ids.back(), 15);
}

TEST_F(SubmapReceiverTest, CompletesOverANetworkThatLosesRepeatsAndReorders) {
  service_.Restart();
  for (int id = 0; id < 12; ++id)  // Of several chunks each.
    service_.Add(MakeSubmap(id, GridOf(0.1, RandomTable(20000, 20, random_)), random_));
  EXPECT_GT(service_.Send(0).size(), 1u);
  const auto deliver_badly = [&](std::vector<FakeBus::Sent> messages) {
    for (std::size_t i = 1; i < messages.size(); ++i)
      if (random_.Chance(0.1)) std::swap(messages[i - 1], messages[i]);
    for (const auto& message : messages) {
      if (random_.Chance(0.1)) continue;
      bus_.Deliver(message);
      if (random_.Chance(0.1)) bus_.Deliver(message);
    }
  };
  for (int id = 0; id < 12; ++id) deliver_badly(service_.Send(id));
  for (int tick = 0; tick < 50 && !dut_.IsComplete(); ++tick) {
    deliver_badly({service_.Status()});
    for (const int id : AskedFor()) deliver_badly(service_.Send(id));
  }
  ExpectHasAll();
  EXPECT_EQ(resets_, 0);
}

TEST_F(SubmapReceiverTest, ForgetsAllWhenTheServiceHoldsAnotherMap) {
  for (int id = 0; id < 4; ++id) Deliver(service_.Send(id));
  bus_.Deliver(service_.Status());
  service_.Restart();
  for (int id = 0; id < 4; ++id) service_.Add(RandomSubmap(id, 0.1, random_));
  bus_.Deliver(service_.Status());
  EXPECT_EQ(resets_, 1);
  EXPECT_TRUE(received_.empty());
  EXPECT_FALSE(dut_.IsComplete());
  EXPECT_TRUE(AskedFor().empty());
  EXPECT_EQ(AskedFor().size(), 4u);
  for (int id = 0; id < 4; ++id) Deliver(service_.Send(id));
  bus_.Deliver(service_.Status());
  ExpectHasAll();
  EXPECT_EQ(resets_, 1);
}

TEST_F(SubmapReceiverTest, ForgetsAllWhenTheServiceHoldsFewer) {
  for (int id = 0; id < 4; ++id) Deliver(service_.Send(id));
  bus_.Deliver(service_.Status());
  service_.Restart();
  bus_.Deliver(service_.Status());
  EXPECT_EQ(resets_, 1);
  EXPECT_EQ(dut_.announced(), 0);
  ExpectHasAll();
}

TEST_F(SubmapReceiverTest, KeepsAllWhenTheServiceRestartsWithTheSameMap) {
  for (int id = 0; id < 4; ++id) Deliver(service_.Send(id));
  bus_.Deliver(service_.Status());
  const auto same = service_.submaps();
  service_.Restart();
  for (const SubmapPtr& submap : same) service_.Add(submap);
  bus_.Deliver(service_.Status());
  for (int id = 0; id < 4; ++id) Deliver(service_.Send(id));
  ExpectHasAll();
  EXPECT_EQ(resets_, 0);
}

TEST_F(SubmapReceiverTest, ASubmapOfAnotherContentMeansAnotherMap) {
  for (int id = 0; id < 4; ++id) Deliver(service_.Send(id));
  service_.Restart();
  for (int id = 0; id < 4; ++id) service_.Add(RandomSubmap(id, 0.1, random_));
  for (int id = 0; id < 4; ++id) Deliver(service_.Send(id));
  EXPECT_EQ(resets_, 1);
  bus_.Deliver(service_.Status());
  ExpectHasAll();
}

TEST_F(SubmapReceiverTest, ChunksThatAreNoSubmapAreCountedAndDropped) {
  const std::vector<std::uint8_t> good = Encode(MessageOf(*service_.submaps()[1]));
  std::int64_t malformed = 0;
  const auto expect_malformed = [&](const chunk_t& chunk) {
    bus_.Deliver(service_.Say(chunk));
    EXPECT_EQ(endpoint_.counts().malformed, ++malformed);
    EXPECT_TRUE(received_.empty());
  };
  expect_malformed(ChunkOf(-1, good));
  expect_malformed(ChunkOf(std::int64_t{1} << 40, good));
  expect_malformed(ChunkOf(2, good));  // It says of itself that it is number 1.
  expect_malformed(ChunkOf(1, {good.begin(), good.end() - 1}));
  expect_malformed(ChunkOf(1, {1, 2, 3}));
  submap_t broken = MessageOf(*service_.submaps()[1]);
  broken.octree_zlib.back() ^= 1;
  expect_malformed(ChunkOf(1, Encode(broken)));

  chunk_t damaged = ChunkOf(1, good);
  damaged.bytes[damaged.bytes.size() / 2] ^= 1;
  bus_.Deliver(service_.Say(damaged));
  EXPECT_EQ(dut_.dropped(), 1);
  EXPECT_TRUE(received_.empty());

  bus_.Deliver(service_.Say(ChunkOf(1, good)));
  EXPECT_EQ(received_.size(), 1u);
}

TEST_F(SubmapReceiverTest, AnImpossibleStatusIsCountedAndDropped) {
  for (int id = 0; id < 4; ++id) Deliver(service_.Send(id));
  map_status_t status{};
  status.submaps = -3;
  bus_.Deliver(service_.Say(status));
  EXPECT_EQ(endpoint_.counts().malformed, 1);
  status.submaps = 4;
  for (const int first : {-1, 5}) {
    status.first = first;
    bus_.Deliver(service_.Say(status));
  }
  EXPECT_EQ(endpoint_.counts().malformed, 3);
  EXPECT_EQ(resets_, 0);
  EXPECT_EQ(dut_.announced(), -1);
}

TEST(ContentChecksumTest, IsOfTheContentAndNotOfItsHead) {
  Random random(2, "content_checksum");
  const SubmapPtr submap = RandomSubmap(3, 0.1, random);
  const submap_t message = MessageOf(*submap);
  submap_t other = message;
  other.header.utime_us = 5;
  other.header.epoch = 6;
  other.header.sender = "somebody else";
  EXPECT_EQ(ContentChecksum(other), ContentChecksum(message));
  other = message;
  other.scans += 1;
  EXPECT_NE(ContentChecksum(other), ContentChecksum(message));
  Submap changed = *submap;
  changed.grid.At({0, 0, 0}) = 99;
  EXPECT_NE(ContentChecksum(MessageOf(changed)), ContentChecksum(message));
}

TEST(ContentChecksumTest, DigestsDependOnTheOrder) {
  const auto digest = [](std::uint32_t a, std::uint32_t b) {
    return AppendToDigest(AppendToDigest(0, a), b);
  };
  EXPECT_EQ(digest(1, 2), digest(1, 2));
  EXPECT_NE(digest(1, 2), digest(2, 1));
  EXPECT_NE(digest(1, 2), AppendToDigest(0, 1));
  EXPECT_NE(AppendToDigest(0, 0), 0);
}

}  // namespace
}  // namespace vog
