#include "lib/messages/endpoint.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>
#include <sstream>

#include "lib/base/random.h"
#include "lib/messages/fake_bus_testing.h"

namespace vog {
namespace {

constexpr std::int64_t kRun = 7;

nav_t SomeNav(double x_m) {
  nav_t nav{};
  nav.X_OB.position_m[0] = x_m;
  return nav;
}

/// A sender and a receiver of NAV, with the wire between them in the test's hands.
class EndpointTest : public testing::Test {
 protected:
  EndpointTest() {
    receiver_.Subscribe(outputs::kNav, [this](Time, const nav_t& nav) { heard_.push_back(nav); });
  }

  FakeBus::Sent Say(Endpoint& sender, FakeBus& bus, double x_m = 0) {
    sender.Publish(outputs::kNav, SomeNav(x_m), FromUtime(123));
    return bus.TakeSent().at(0);
  }
  FakeBus::Sent Say(double x_m = 0) { return Say(sender_, sender_bus_, x_m); }

  FakeBus sender_bus_, receiver_bus_;
  Endpoint sender_{sender_bus_, "sender", kRun};
  Endpoint receiver_{receiver_bus_, "receiver", kRun};
  std::vector<nav_t> heard_;
};

TEST_F(EndpointTest, MessagesArriveWithTheirHeads) {
  sender_bus_.current_epoch = 99;
  for (int i = 0; i < 3; ++i) receiver_bus_.Deliver(Say(i));
  ASSERT_EQ(heard_.size(), 3u);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(heard_[i].X_OB.position_m[0], i);
    EXPECT_EQ(heard_[i].header.utime_us, 123);
    EXPECT_EQ(heard_[i].header.run_id, kRun);
    EXPECT_EQ(heard_[i].header.epoch, 99);
    EXPECT_EQ(heard_[i].header.sequence, i);
    EXPECT_EQ(heard_[i].header.sender, "sender");
  }
  EXPECT_EQ(receiver_.counts().received, 3);
}

TEST_F(EndpointTest, AnObserverSeesWhatIsAcceptedAsItCame) {
  std::vector<FakeBus::Sent> seen;
  receiver_.Observe([&](Time now, const std::string& channel, const header_t&, Bytes bytes) {
    EXPECT_EQ(now, FromUtime(5));
    EXPECT_EQ(heard_.size(), seen.size() + 1) << "after the handler";
    seen.push_back({channel, {bytes.begin(), bytes.end()}});
  });
  const auto message = Say();
  receiver_bus_.Deliver(message, FromUtime(5));
  receiver_bus_.Deliver(message, FromUtime(5));  // Twice: stale.
  receiver_bus_.Deliver({"NAV", {1, 2, 3}}, FromUtime(5));
  ASSERT_EQ(seen.size(), 1u);
  EXPECT_EQ(seen[0].channel, "NAV");
  EXPECT_EQ(seen[0].bytes, message.bytes);
}

TEST_F(EndpointTest, ChannelsCountForThemselves) {
  Say();
  sender_.Publish(inputs::kDepth, depth_t{}, Time{});
  depth_t depth{};
  ASSERT_TRUE(Decode(sender_bus_.TakeSent().at(0).bytes, depth));
  EXPECT_EQ(depth.header.sequence, 0);
}

TEST_F(EndpointTest, AStateMayCountItsOwnEpochs) {
  sender_.Publish(outputs::kNav, SomeNav(0), Time{}, 1234);
  receiver_bus_.Deliver(sender_bus_.TakeSent().at(0));
  ASSERT_EQ(heard_.size(), 1u);
  EXPECT_EQ(heard_[0].header.epoch, 1234);
}

TEST_F(EndpointTest, RepeatedAndLateMessagesAreCountedAndDropped) {
  const auto a = Say(0), b = Say(1), c = Say(2);
  for (const auto& message : {a, a, b, c, b, a, c}) receiver_bus_.Deliver(message);
  EXPECT_EQ(heard_.size(), 3u);
  EXPECT_EQ(receiver_.counts().stale, 4);
  EXPECT_EQ(receiver_.counts().missed, 0);
}

TEST_F(EndpointTest, LostMessagesAreCounted) {
  Random random(1, "endpoint");
  int lost = 0, since = 0;
  for (int i = 0; i < 300; ++i) {
    const auto message = Say(i);
    ++since;
    if (i > 0 && random.Chance(0.3)) continue;
    receiver_bus_.Deliver(message);
    lost += since - 1;
    since = 0;
  }
  EXPECT_GT(lost, 50);
  EXPECT_EQ(receiver_.counts().missed, lost);
}

TEST_F(EndpointTest, WhoStartsLateHasMissedNothing) {
  Say();
  Say();
  receiver_bus_.Deliver(Say());
  EXPECT_EQ(heard_.size(), 1u);
  EXPECT_EQ(receiver_.counts().missed, 0);
}

TEST_F(EndpointTest, ARestartedSenderIsHeardAndItsFormerSelfIsNot) {
  for (int i = 0; i < 5; ++i) receiver_bus_.Deliver(Say());
  const auto late = Say();
  FakeBus restarted_bus;
  restarted_bus.current_epoch = 2;
  Endpoint restarted(restarted_bus, "sender", kRun);
  receiver_bus_.Deliver(Say(restarted, restarted_bus, 50));
  ASSERT_EQ(heard_.size(), 6u);
  EXPECT_EQ(heard_.back().X_OB.position_m[0], 50);
  receiver_bus_.Deliver(late);
  EXPECT_EQ(heard_.size(), 6u);
  EXPECT_EQ(receiver_.counts().stale, 1);
  EXPECT_EQ(receiver_.counts().missed, 0);
}

// The machine's clock was set back between its two starts.
TEST_F(EndpointTest, ASenderRestartedInAnEarlierEpochIsHeardSoon) {
  sender_bus_.current_epoch = 3'600'000'000;
  for (int i = 0; i < 5; ++i) receiver_bus_.Deliver(Say());
  FakeBus restarted_bus;
  Endpoint restarted(restarted_bus, "sender", kRun);
  for (int i = 0; i < 5; ++i) receiver_bus_.Deliver(Say(restarted, restarted_bus, 50));
  EXPECT_EQ(heard_.size(), 5u + 3u);
  EXPECT_EQ(receiver_.counts().stale, 2);
  receiver_bus_.Deliver(Say());
  EXPECT_EQ(heard_.size(), 5u + 3u + 1u) << "a higher epoch is always heard";
}

TEST_F(EndpointTest, RemainsOfAFormerSelfAreNotBelieved) {
  std::vector<FakeBus::Sent> late;
  for (int i = 0; i < 9; ++i) late.push_back(Say());
  FakeBus restarted_bus;
  restarted_bus.current_epoch = 2;
  Endpoint restarted(restarted_bus, "sender", kRun);
  for (int i = 0; i < 8; i += 2) {  // Two at a time, and one of them twice or late.
    receiver_bus_.Deliver(Say(restarted, restarted_bus));
    for (const int j : {i + 1, i + 1, i, i + 1}) receiver_bus_.Deliver(late[j]);
  }
  EXPECT_EQ(heard_.size(), 4u);
}

// A flipped bit in a count must not make the rest of what its sender says stale.
TEST_F(EndpointTest, ADamagedCountDoesNotSilenceItsSender) {
  receiver_bus_.Deliver(Say(0));
  nav_t damaged{};
  ASSERT_TRUE(Decode(Say(1).bytes, damaged));
  for (const std::int64_t sequence :
       {std::numeric_limits<std::int64_t>::max(), std::int64_t{1} << 40, std::int64_t{-1}}) {
    damaged.header.sequence = sequence;
    receiver_bus_.Deliver({outputs::kNav.name, Encode(damaged)});
    EXPECT_EQ(heard_.size(), 1u) << sequence;
  }
  EXPECT_EQ(receiver_.counts().malformed, 1);
  EXPECT_EQ(receiver_.counts().stale, 2);
  for (int i = 2; i < 6; ++i) receiver_bus_.Deliver(Say(i));
  EXPECT_EQ(heard_.size(), 5u);
  EXPECT_EQ(receiver_.counts().missed, 1) << "the one that was damaged";
  // A smaller one is taken for lost messages; it silences for three.
  damaged.header.sequence = 500;
  receiver_bus_.Deliver({outputs::kNav.name, Encode(damaged)});
  EXPECT_EQ(heard_.size(), 6u);
  for (int i = 6; i < 12; ++i) receiver_bus_.Deliver(Say(i));
  EXPECT_EQ(heard_.size(), 10u);
}

TEST_F(EndpointTest, ADamagedCountAtFirstDoesNotEither) {
  nav_t damaged{};
  ASSERT_TRUE(Decode(Say(0).bytes, damaged));
  damaged.header.sequence = std::int64_t{1} << 50;
  receiver_bus_.Deliver({outputs::kNav.name, Encode(damaged)});
  for (int i = 0; i < 6; ++i) receiver_bus_.Deliver(Say(i));
  EXPECT_EQ(heard_.size(), 1u + 4u);
}

TEST_F(EndpointTest, WhoReallyHasSaidThatMuchIsHeardSoon) {
  receiver_bus_.Deliver(Say(0));
  nav_t later{};
  ASSERT_TRUE(Decode(Say(1).bytes, later));
  for (int i = 0; i < 4; ++i) {
    later.header.sequence = (std::int64_t{1} << 30) + i;
    receiver_bus_.Deliver({outputs::kNav.name, Encode(later)});
  }
  EXPECT_EQ(heard_.size(), 3u);
}

TEST_F(EndpointTest, SendersOnOneChannelDoNotDisturbEachOther) {
  FakeBus other_bus;
  other_bus.current_epoch = 77;
  Endpoint other(other_bus, "other", kRun);
  for (int i = 0; i < 4; ++i) {
    receiver_bus_.Deliver(Say(other, other_bus));
    receiver_bus_.Deliver(Say());
  }
  EXPECT_EQ(heard_.size(), 8u);
  EXPECT_EQ(receiver_.counts().stale, 0);
}

TEST_F(EndpointTest, MessagesOfAnotherRunAreCountedAndDropped) {
  FakeBus other_bus;
  Endpoint other(other_bus, "sender", kRun + 1);
  receiver_bus_.Deliver(Say(other, other_bus));
  EXPECT_TRUE(heard_.empty());
  EXPECT_EQ(receiver_.counts().other_run, 1);
  receiver_bus_.Deliver(Say());
  EXPECT_EQ(heard_.size(), 1u);
}

TEST_F(EndpointTest, RunZeroTakesTheFirstRunHeard) {
  FakeBus bus;
  Endpoint dut(bus, "dut", 0);
  int heard = 0;
  dut.Subscribe(outputs::kNav, [&](Time, const nav_t&) { ++heard; });
  bus.Deliver(Say());
  EXPECT_EQ(dut.run_id(), kRun);
  FakeBus other_bus;
  Endpoint other(other_bus, "other", kRun + 1);
  bus.Deliver(Say(other, other_bus));
  EXPECT_EQ(heard, 1);
  EXPECT_EQ(dut.counts().other_run, 1);
}

TEST_F(EndpointTest, BytesThatAreNoMessageAreCountedAndDropped) {
  const FakeBus::Sent good = Say();
  std::int64_t malformed = 0;
  const auto expect_malformed = [&](std::vector<std::uint8_t> bytes) {
    receiver_bus_.Deliver({good.channel, std::move(bytes)});
    EXPECT_EQ(receiver_.counts().malformed, ++malformed);
  };
  for (std::size_t size = 0; size < good.bytes.size(); ++size)
    expect_malformed({good.bytes.begin(), good.bytes.begin() + size});
  auto longer = good.bytes;
  longer.push_back(0);
  expect_malformed(longer);
  expect_malformed(Encode(depth_t{}));  // Another type.
  Random random(2, "endpoint");
  for (int i = 0; i < 200; ++i) {
    std::vector<std::uint8_t> noise(random.Index(400));
    for (auto& byte : noise) byte = static_cast<std::uint8_t>(random.Index(256));
    expect_malformed(noise);
  }
  EXPECT_TRUE(heard_.empty());
  receiver_.NoteMalformed();
  EXPECT_EQ(receiver_.counts().malformed, malformed + 1);
  receiver_bus_.Deliver(good);
  EXPECT_EQ(heard_.size(), 1u);
}

TEST_F(EndpointTest, TimesThatNoClockShowsAreMalformed) {
  const FakeBus::Sent good = Say();
  std::int64_t malformed = 0;
  for (const std::int64_t utime_us :
       {std::int64_t{-1}, std::numeric_limits<std::int64_t>::min(),
        std::numeric_limits<std::int64_t>::max(), std::int64_t{1} << 52}) {
    nav_t message{};
    ASSERT_TRUE(Decode(good.bytes, message));
    message.header.utime_us = utime_us;
    receiver_bus_.Deliver({good.channel, Encode(message)});
    EXPECT_EQ(receiver_.counts().malformed, ++malformed);
  }
  EXPECT_TRUE(heard_.empty());
  receiver_bus_.Deliver(good);
  EXPECT_EQ(heard_.size(), 1u);
}

TEST_F(EndpointTest, ImpossibleLengthsAreMalformed) {
  chunk_t chunk{};
  chunk.bytes = {1, 2, 3, 4};
  chunk.size = 4;
  const std::vector<std::uint8_t> good = Encode(chunk);
  const std::size_t at = good.size() - 8;  // Of `size`, big-endian.
  for (const int size : {3, 5, 0, 1000, -1, -4, 0x40000004, std::numeric_limits<int>::max(),
                         std::numeric_limits<int>::min()}) {
    std::vector<std::uint8_t> bytes = good;
    for (int i = 0; i < 4; ++i)
      bytes[at + i] = static_cast<std::uint8_t>(static_cast<std::uint32_t>(size) >> (24 - 8 * i));
    EXPECT_FALSE(Decode(bytes, chunk)) << size;
  }
  EXPECT_TRUE(Decode(good, chunk));
}

TEST_F(EndpointTest, NoFlippedBitOfAnArrayMessageDoesHarm) {
  scan_t scan{};
  scan.beams = 3;
  scan.bearing_rad = scan.range_m = scan.strength = {1, 2, 3};
  scan.status = {0, 1, 2};
  map_status_t status{};
  submap_poses_t poses{};
  poses.count = 1;
  poses.submap_id = {7};
  poses.X_WM.resize(1);
  poses.covariance_WM.resize(1);
  poses.covariance_MN.resize(1);
  const auto flip_all = [](auto message) {
    const std::vector<std::uint8_t> good = Encode(message);
    int decoded = 0;
    for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
      std::vector<std::uint8_t> bytes = good;
      bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
      decoded += Decode(bytes, message);
    }
    return decoded;
  };
  EXPECT_GT(flip_all(scan), 0);
  EXPECT_GT(flip_all(poses), 0);
  EXPECT_GT(flip_all(status), 0);
}

// LCM's own decoder would copy two gigabytes from behind the message.
TEST_F(EndpointTest, AStringWithoutEvenItsFinalZeroIsRefused) {
  status_t status{};
  status.process = "vog-slam";
  const std::vector<std::uint8_t> good = Encode(status);
  constexpr std::size_t kSenderLengthAt = 8 + 4 * 8;
  for (const std::uint8_t first : {0x80, 0xff, 0x00}) {
    std::vector<std::uint8_t> bytes = good;
    std::fill_n(bytes.begin() + kSenderLengthAt, 4, std::uint8_t{0});
    bytes[kSenderLengthAt] = first;
    EXPECT_FALSE(Decode(bytes, status)) << int{first};
  }
}

TEST_F(EndpointTest, AChannelIsSubscribedOnce) {
  EXPECT_THROW(receiver_.Subscribe(outputs::kNav, [](Time, const nav_t&) {}), std::logic_error);
}

TEST_F(EndpointTest, StatusTellsHealthAndCounts) {
  receiver_.ReportStatus([](std::map<std::string, std::int64_t>& counters) {
    counters["apples"] = 5;
    return "fault: no pears";
  });
  const auto message = Say();
  receiver_bus_.Deliver(message);
  receiver_bus_.Deliver(message);
  receiver_bus_.Deliver({"NAV", {1, 2}});
  receiver_bus_.TickAll(FromUtime(5));
  status_t status{};
  const auto sent = receiver_bus_.TakeSent();
  ASSERT_EQ(sent.size(), 1u);
  EXPECT_EQ(sent[0].channel, "STATUS");
  ASSERT_TRUE(Decode(sent[0].bytes, status));
  EXPECT_EQ(status.header.utime_us, 5);
  EXPECT_EQ(status.process, "receiver");
  EXPECT_EQ(status.health, "fault: no pears");
  std::map<std::string, std::int64_t> counters;
  for (const counter_t& counter : status.counter) counters[counter.name] = counter.value;
  EXPECT_EQ(counters, (std::map<std::string, std::int64_t>{{"apples", 5},
                                                           {"malformed", 1},
                                                           {"missed", 0},
                                                           {"other_run", 0},
                                                           {"received", 1},
                                                           {"stale", 1}}));
}

TEST_F(EndpointTest, StatusMayTellATimeOfItsOwn) {
  receiver_.ReportStatus([](auto&) { return "ok"; }, [] { return FromUtime(77); });
  receiver_bus_.TickAll(FromUtime(5));
  status_t status{};
  ASSERT_TRUE(Decode(receiver_bus_.TakeSent().at(0).bytes, status));
  EXPECT_EQ(status.header.utime_us, 77);
}

/// Calls `visit` with each channel there is.
template <class Visit>
void ForEachInput(Visit visit) {
  visit(inputs::kRun), visit(inputs::kVehicleNav), visit(inputs::kDvl), visit(inputs::kImu);
  visit(inputs::kDepth), visit(inputs::kSonarReturns), visit(inputs::kSonarFrame);
  visit(inputs::kTruth);
}
template <class Visit>
void ForEachOutput(Visit visit) {
  visit(outputs::kNav), visit(outputs::kScan), visit(outputs::kSubmap);
  visit(outputs::kSubmapPoses), visit(outputs::kGraph), visit(outputs::kPose);
  visit(outputs::kPlan), visit(outputs::kMissionStatus), visit(outputs::kControl);
  visit(outputs::kVehicleCommand), visit(outputs::kMapStatus), visit(outputs::kMapRequest);
  visit(outputs::kMapReply), visit(outputs::kStatus);
}

TEST(ChannelsTest, EveryMessageStartsWithItsTime) {
  // LcmBus reads it there without knowing the type.
  const auto expect_time_first = []<class Message>(const Channel<Message>& channel) {
    Message message{};
    message.header.utime_us = 0x0102030405060708;
    const std::vector<std::uint8_t> bytes = Encode(message);
    for (int i = 0; i < 8; ++i) EXPECT_EQ(bytes.at(8 + i), i + 1) << channel.name;
    EXPECT_TRUE(Decode(bytes, message)) << channel.name;
  };
  ForEachInput(expect_time_first);
  ForEachOutput(expect_time_first);
}

TEST(ChannelsTest, TheRegexNamesTheInputsAndEachNameIsOfOneChannel) {
  std::set<std::string> alternatives, names;
  std::istringstream regex(kInputsRegex);
  for (std::string name; std::getline(regex, name, '|');) alternatives.insert(name);
  ForEachInput([&](const auto& channel) { EXPECT_TRUE(names.insert(channel.name).second); });
  EXPECT_EQ(alternatives, names);
  ForEachOutput(
      [&](const auto& channel) { EXPECT_TRUE(names.insert(channel.name).second) << channel.name; });
}

/// Large messages, and the chunks that they travel in.
class ChunksTest : public testing::Test {
 protected:
  std::vector<std::uint8_t> RandomBytes(int size) {
    std::vector<std::uint8_t> bytes(size);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random_.Index(256));
    return bytes;
  }

  /// The chunks of a reply with `octree` in it.
  std::vector<chunk_t> ChunksOf(std::int64_t item, std::int64_t version,
                                const std::vector<std::uint8_t>& octree) {
    map_reply_t reply{};
    reply.octree = octree;
    reply.size = static_cast<int>(octree.size());
    sender_.PublishLarge(outputs::kMapReply, item, version, reply, FromUtime(9));
    std::vector<chunk_t> chunks;
    for (const auto& sent : bus_.TakeSent()) {
      EXPECT_EQ(sent.channel, "MAP_REPLY");
      EXPECT_LT(sent.bytes.size(), 65000u);  // A datagram.
      EXPECT_TRUE(Decode(sent.bytes, chunks.emplace_back()));
    }
    return chunks;
  }

  static std::vector<std::uint8_t> OctreeIn(const ChunkAssembler::Whole& whole) {
    map_reply_t reply{};
    EXPECT_TRUE(Decode(whole.bytes, reply));
    EXPECT_EQ(reply.header.sender, "sender");
    EXPECT_EQ(reply.header.run_id, kRun);
    EXPECT_EQ(reply.header.utime_us, 9);
    return reply.octree;
  }

  void Shuffle(std::vector<chunk_t>& chunks) {
    for (std::size_t i = chunks.size(); i > 1; --i)
      std::swap(chunks[i - 1], chunks[random_.Index(static_cast<int>(i))]);
  }

  /// Adds all chunks; the last must complete the message and no other.
  void ExpectCompletes(const std::vector<chunk_t>& chunks,
                       const std::vector<std::uint8_t>& octree) {
    for (std::size_t i = 0; i < chunks.size(); ++i) {
      const auto whole = dut_.Add(chunks[i]);
      ASSERT_EQ(whole.has_value(), i + 1 == chunks.size());
      if (whole) {
        EXPECT_EQ(whole->item, chunks[i].item);
        EXPECT_EQ(whole->version, chunks[i].version);
        EXPECT_TRUE(OctreeIn(*whole) == octree);
      }
    }
  }

  Random random_{3, testing::UnitTest::GetInstance()->current_test_info()->name()};
  FakeBus bus_;
  Endpoint sender_{bus_, "sender", kRun};
  ChunkAssembler dut_;
};

TEST_F(ChunksTest, MessagesOfAnySizeComeTogetherInAnyOrder) {
  const int head = static_cast<int>(ChunksOf(0, 0, {})[0].bytes.size());
  for (const int size : {0, 1, 32000 - head - 1, 32000 - head, 32000 - head + 1, 300000}) {
    const auto octree = RandomBytes(size);
    std::vector<chunk_t> chunks = ChunksOf(5, 6, octree);
    EXPECT_EQ(chunks.size(), static_cast<std::size_t>((size + head + 31999) / 32000));
    ExpectCompletes(chunks, octree);
    Shuffle(chunks);
    ExpectCompletes(chunks, octree);
  }
  EXPECT_EQ(dut_.dropped(), 0);
}

TEST_F(ChunksTest, RepeatedChunksDoNoHarm) {
  const auto octree = RandomBytes(100000);
  const auto chunks = ChunksOf(5, 6, octree);
  for (std::size_t i = 0; i + 1 < chunks.size(); ++i)
    for (int k = 0; k < 3; ++k) EXPECT_FALSE(dut_.Add(chunks[i]));
  EXPECT_TRUE(dut_.Add(chunks.back()));
}

TEST_F(ChunksTest, ALostChunkIsMadeUpForByTheNextSending) {
  const auto octree = RandomBytes(100000);
  auto chunks = ChunksOf(5, 6, octree);
  for (std::size_t i = 1; i < chunks.size(); ++i) EXPECT_FALSE(dut_.Add(chunks[i]));
  const auto again = ChunksOf(5, 6, octree);
  const auto whole = dut_.Add(again[0]);
  ASSERT_TRUE(whole);
  EXPECT_TRUE(OctreeIn(*whole) == octree);
}

TEST_F(ChunksTest, ItemsMayComeInterleaved) {
  const auto a = RandomBytes(90000), b = RandomBytes(90000);
  const auto chunks_a = ChunksOf(1, 6, a), chunks_b = ChunksOf(2, 6, b);
  std::optional<ChunkAssembler::Whole> whole_a, whole_b;
  for (std::size_t i = 0; i < chunks_a.size(); ++i) {
    whole_a = dut_.Add(chunks_a[i]);
    whole_b = dut_.Add(chunks_b[i]);
  }
  ASSERT_TRUE(whole_a && whole_b);
  EXPECT_TRUE(OctreeIn(*whole_a) == a);
  EXPECT_TRUE(OctreeIn(*whole_b) == b);
}

TEST_F(ChunksTest, DamagedBytesAreCountedAndDropped) {
  const auto octree = RandomBytes(100000);
  for (int i = 0; i < 20; ++i) {
    auto chunks = ChunksOf(5, 6, octree);
    chunk_t& chunk = chunks[random_.Index(static_cast<int>(chunks.size()))];
    chunk.bytes[random_.Index(chunk.size)] ^= 1 << random_.Index(8);
    for (const chunk_t& damaged : chunks) EXPECT_FALSE(dut_.Add(damaged));
    EXPECT_EQ(dut_.dropped(), i + 1);
    ExpectCompletes(ChunksOf(5, 6, octree), octree);
  }
}

TEST_F(ChunksTest, VersionsAndEpochsAreNeverMixed) {
  const auto octree = RandomBytes(60000);
  const auto old_chunks = ChunksOf(5, 6, RandomBytes(60000));
  const auto new_version = ChunksOf(5, 7, octree);
  bus_.current_epoch = 2;
  const auto new_epoch = ChunksOf(5, 7, octree);
  EXPECT_FALSE(dut_.Add(old_chunks[0]));
  EXPECT_FALSE(dut_.Add(new_version[1]));
  EXPECT_EQ(dut_.dropped(), 1);  // What was there of the old one.
  EXPECT_FALSE(dut_.Add(new_epoch[0]));
  EXPECT_EQ(dut_.dropped(), 2);
  EXPECT_TRUE(dut_.Add(new_epoch[1]));
}

TEST_F(ChunksTest, ImpossiblePartNumbersAreCountedAndDropped) {
  const chunk_t good = ChunksOf(5, 6, RandomBytes(60000))[0];
  int dropped = 0;
  for (const auto& [part, parts] :
       {std::pair(0, 0), {-1, 2}, {2, 2}, {5, -1}, {0, 1 << 30}, {1 << 30, 2}}) {
    chunk_t chunk = good;
    chunk.part = part;
    chunk.parts = parts;
    EXPECT_FALSE(dut_.Add(chunk));
    EXPECT_EQ(dut_.dropped(), ++dropped);
  }
}

TEST_F(ChunksTest, TheOldestOfTooManyItemsIsGivenUp) {
  const auto octree = RandomBytes(40000);
  for (int item = 0; item < 100; ++item) dut_.Add(ChunksOf(item, 1, octree)[0]);
  EXPECT_EQ(dut_.dropped(), 36);
  EXPECT_FALSE(dut_.Add(ChunksOf(0, 1, octree)[1]));
  EXPECT_TRUE(dut_.Add(ChunksOf(99, 1, octree)[1]));
}

}  // namespace
}  // namespace vog
