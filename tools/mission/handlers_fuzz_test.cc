#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

#include "lib/base/random.h"
#include "procs/sim/sim_node.h"
#include "tools/mission/lock_step.h"
#include "tools/mission/mission.h"

namespace vog {
namespace {

// Damaged messages at every handler of every process: nothing may crash, hang or grow.

struct Recorded {
  std::string channel;
  std::vector<std::uint8_t> bytes;
};

Config SmallMission() {
  Config config = ReadMission(std::string(VOG_SOURCE_DIR) + "/config/mission/propeller.toml", {});
  NumberRun(config);
  for (const char* setting :
       {"submap.scans_per_submap=8", "sonar.beams=12", "mission.max_submaps=3",
        "planner.tree_nodes=5", "bus.run_id=7", "submap.voxel_size_m=0.2"})
    config.Set(setting);
  return config;
}

class HandlersFuzzTest : public testing::Test {
 protected:
  HandlersFuzzTest() {
    folder_ = std::filesystem::path(testing::TempDir()) / "vog_handlers_fuzz";
    std::filesystem::remove_all(folder_);
  }
  ~HandlersFuzzTest() override { std::filesystem::remove_all(folder_); }

  /// What a short mission says, the same number of each channel at most.
  std::vector<Recorded> FlyAndRecord() {
    std::vector<Recorded> recorded;
    std::map<std::string, int> counts;
    const Config config = SmallMission();
    LockStepSystem system(config, {(folder_ / "flown").string(), ""},
                          [&](Time, const std::string& channel, Bytes bytes) {
                            constexpr int kMost = 40;
                            if (counts[channel]++ < kMost)
                              recorded.push_back({channel, {bytes.begin(), bytes.end()}});
                          });
    SimNode sim(system.bus().AddNode("vog-sim"), SimSettings::From(config));
    while (!system.progress().is_complete && sim.next_due() < Time(std::chrono::seconds(60))) {
      system.bus().RunUntil(sim.next_due());
      sim.AdvanceTo(sim.next_due());
    }
    return recorded;
  }

  static std::int64_t ResidentBytes() {
    std::int64_t pages = 0;
    std::ifstream statm("/proc/self/statm");
    statm >> pages >> pages;
    return pages * ::sysconf(_SC_PAGESIZE);
  }

  std::filesystem::path folder_;
};

std::size_t Place(Random& random, std::size_t size) {
  return static_cast<std::size_t>(random.Index(static_cast<int>(size)));
}

void FlipBits(std::vector<std::uint8_t>& bytes, Random& random) {
  for (int i = random.Index(8); i >= 0; --i)
    bytes[Place(random, bytes.size())] ^= static_cast<std::uint8_t>(1 << random.Index(8));
}

/// Writes a number that programs stumble over into eight bytes, or four.
void PutExtreme(std::vector<std::uint8_t>& bytes, Random& random) {
  constexpr std::uint64_t kExtremes[] = {0,
                                         ~0ull,
                                         0x7fffffffffffffff,
                                         0x8000000000000000,
                                         0x7ff0000000000000,
                                         0x7ff8000000000000,
                                         0xffefffffffffffff,
                                         0x3ff0000000000000,
                                         0x7fefffffffffffff,
                                         0x0000000100000000};
  const std::uint64_t value = kExtremes[random.Index(10)];
  const std::size_t size = random.Chance(0.5) ? 8 : 4;
  if (bytes.size() < size) return;
  const std::size_t at = Place(random, bytes.size() - size + 1);
  for (std::size_t i = 0; i < size; ++i)
    bytes[at + i] = static_cast<std::uint8_t>(value >> (8 * (7 - i)));
}

std::vector<std::uint8_t> Damaged(const std::vector<Recorded>& recorded, std::size_t which,
                                  Random& random) {
  std::vector<std::uint8_t> bytes = recorded[which].bytes;
  if (bytes.empty()) return bytes;
  switch (random.Index(5)) {
    case 0:
      FlipBits(bytes, random);
      break;
    case 1:
      bytes.resize(Place(random, bytes.size()));
      break;
    case 2:
      for (int i = 0; i < 3; ++i) PutExtreme(bytes, random);
      break;
    case 3: {  // The end of another message.
      const auto& other = recorded[Place(random, recorded.size())].bytes;
      const std::size_t keep = Place(random, bytes.size());
      bytes.resize(keep);
      if (keep < other.size())
        bytes.insert(bytes.end(), other.begin() + static_cast<std::ptrdiff_t>(keep), other.end());
      break;
    }
    default:
      break;  // Whole, but at a moment of its own.
  }
  return bytes;
}

/// Makes the message the newest of a sender that has not spoken before, of the same run: behind
/// what is refused at once there is more to break.
void MakeNewest(const std::vector<std::uint8_t>& original, Time now, std::int64_t sequence,
                std::vector<std::uint8_t>& bytes) {
  // The type's 8 bytes, then utime_us, run_id, epoch and sequence of header_t.
  constexpr std::size_t kUtimeAt = 8, kSequenceAt = 32, kSenderAt = 44;
  if (bytes.size() <= kSenderAt || original.size() <= kSenderAt) return;
  std::copy_n(original.begin(), kSenderAt, bytes.begin());
  bytes[kSenderAt] = 'x';
  const auto put = [&](std::int64_t value, std::size_t at) {
    for (std::size_t i = 0; i < 8; ++i)
      bytes[at + i] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * (7 - i)));
  };
  put(ToUtime(now), kUtimeAt);
  put(sequence, kSequenceAt);
}

TEST_F(HandlersFuzzTest, DamagedMessagesDoNoHarm) {
  const char* wanted = std::getenv("VOG_FUZZ_INPUTS");
  const int inputs = wanted != nullptr ? std::atoi(wanted) : 3000;
  const std::vector<Recorded> recorded = FlyAndRecord();
  std::set<std::string> channels;
  for (const Recorded& message : recorded) channels.insert(message.channel);
  for (const char* channel :
       {"RUN", "VEHICLE_NAV", "SONAR_RETURNS", "NAV", "SCAN", "SUBMAP", "SUBMAP_POSES", "GRAPH",
        "REVISITS", "POSE", "PLAN", "MISSION_STATUS", "CONTROL", "MAP_STATUS", "STATUS"})
    ASSERT_TRUE(channels.count(channel)) << channel;
  std::int64_t statuses = 0, plans = 0, poses = 0;
  const auto observe = [&](Time, const std::string& channel, Bytes) {
    statuses += channel == "STATUS";
    plans += channel == "PLAN";
    poses += channel == "SUBMAP_POSES";
  };
  const Config config = SmallMission();
  const std::int64_t resident_before = ResidentBytes();
  // A flipped bit may make processes deaf for a sender; new ones hear again.
  constexpr int kInputsOfASystem = 500;
  for (int first = 0; first < inputs; first += kInputsOfASystem) {
    std::filesystem::remove_all(folder_ / "fuzzed");
    LockStepSystem system(config, {(folder_ / "fuzzed").string(), ""}, observe);
    QueueBus& bus = system.bus();
    SimNode sim(bus.AddNode("vog-sim"), SimSettings::From(config));
    for (int input = first; input < std::min(inputs, first + kInputsOfASystem); ++input) {
      Random random(1, "fuzz", static_cast<std::uint64_t>(input));
      const std::size_t which = Place(random, recorded.size());
      std::vector<std::uint8_t> bytes = Damaged(recorded, which, random);
      if (random.Chance(0.9)) MakeNewest(recorded[which].bytes, bus.now(), 1000 + input, bytes);
      bus.PublishAt(bus.now(), recorded[which].channel, bytes);
      bus.RunUntil(sim.next_due());
      sim.AdvanceTo(sim.next_due());
    }
    // All six still tell that they live, once a second.
    const std::int64_t before = statuses;
    bus.RunUntil(bus.now() + std::chrono::seconds(3));
    EXPECT_GE(statuses - before, 3 * 6) << first;
  }
  EXPECT_LT(ResidentBytes() - resident_before, 400'000'000);
  EXPECT_GT(poses, inputs / 500) << "missions do not go on";
  EXPECT_GT(plans, inputs / 100);
}

}  // namespace
}  // namespace vog
