#include "hardware/nav_payload/can_records.h"

#include <gtest/gtest.h>

#include <cmath>

#include "hardware/nav_payload/random_formats_testing.h"

namespace vog {
namespace {

CanData RandomData(Random& random) {
  CanData data;
  for (auto& byte : data) byte = random.Index(256);
  return data;
}

/// The places (byte * 8 + bit) of a signal's bits, from the lowest, as the DBC format defines them.
std::vector<int> PlacesOf(const CanSignal& signal) {
  std::vector<int> places;
  int place = signal.start;
  for (int i = 0; i < signal.length; ++i) {
    if (signal.is_motorola) {
      places.insert(places.begin(), place);
      place = place % 8 == 0 ? place + 15 : place - 1;
    } else {
      places.push_back(place++);
    }
  }
  return places;
}

/// A signal of either order that lies within the eight bytes.
CanSignal RandomSignal(Random& random) {
  for (;;) {
    CanSignal signal{random.Index(64),
                     1 + random.Index(53),
                     random.Chance(0.5),
                     random.Chance(0.5),
                     random.Uniform(0.001, 2),
                     random.Uniform(-100, 100),
                     -1e300,
                     1e300};
    const auto places = PlacesOf(signal);
    if (*std::max_element(places.begin(), places.end()) < 64) return signal;
  }
}

TEST(CanSignalTest, AgreesWithALoopOverBits) {
  for (int i = 0; i < 20'000; ++i) {
    Random random(1, "signal", i);
    const CanSignal signal = RandomSignal(random);
    const CanData data = RandomData(random);
    const auto places = PlacesOf(signal);
    std::int64_t expected = 0;
    for (int k = 0; k < signal.length; ++k)
      expected |= std::int64_t{data[places[k] / 8] >> places[k] % 8 & 1} << k;
    if (signal.is_signed && (expected >> (signal.length - 1) & 1) != 0)
      expected -= std::int64_t{1} << signal.length;
    ASSERT_EQ(ExtractRaw(signal, data), expected);

    CanData target = RandomData(random), by_bits = target;
    InsertRaw(signal, expected, target);
    for (int k = 0; k < signal.length; ++k) {
      auto& byte = by_bits[places[k] / 8];
      const int bit = 1 << places[k] % 8;
      byte = static_cast<std::uint8_t>(expected >> k & 1 ? byte | bit : byte & ~bit);
    }
    ASSERT_EQ(target, by_bits);
    const double value = signal.offset + signal.scale * static_cast<double>(expected);
    ASSERT_NEAR(Extract(signal, target).value(), value, 1e-9 * std::abs(value));
  }
}

TEST(CanSignalTest, NumbersAreHeldWithinTheirRangeAndRefusedOutsideIt) {
  const CanSignal signal{8, 8, false, false, 0.5, 0, 10, 100};
  CanData data{};
  Insert(signal, 1000, data);
  EXPECT_EQ(Extract(signal, data), 100);
  InsertRaw(signal, 250, data);
  EXPECT_FALSE(Extract(signal, data));
}

/// What comes back, over frames.
std::vector<CanRecord> Exchange(const CanRecord& record) {
  CanRecordWriter writer;
  CanRecordReader reader;
  std::vector<CanRecord> records;
  for (const CanFrame& frame : writer.Write(record)) {
    if (const auto back = reader.Add(frame)) records.push_back(*back);
  }
  return records;
}

TEST(CanRecordsTest, EveryRecordComesBackOnceWithTheSameFrames) {
  for (int i = 0; i < 2000; ++i) {
    const CanRecord record = RandomCanRecord(i);
    const auto back = Exchange(record);
    ASSERT_EQ(back.size(), 1u);
    ASSERT_EQ(back[0].index(), record.index());
    const auto sent = CanRecordWriter().Write(record), again = CanRecordWriter().Write(back[0]);
    ASSERT_EQ(again.size(), sent.size());
    // A pose's angles may differ by a step after their way through a matrix.
    if (!std::holds_alternative<VehicleNavRecord>(record)) {
      EXPECT_EQ(again, sent);
    }
  }
}

TEST(CanRecordsTest, ThePoseIsWithinItsSteps) {
  for (int i = 0; i < 500; ++i) {
    const VehicleNavRecord nav = RandomVehicleNav(i);
    const auto back = std::get<VehicleNavRecord>(Exchange(nav).at(0));
    EXPECT_EQ(back.time, nav.time);
    EXPECT_EQ(back.origin, nav.origin);
    EXPECT_LT((back.X_OB.translation() - nav.X_OB.translation()).norm(), 1e-3);
    EXPECT_LT(Log(Ominus(back.X_OB, nav.X_OB)).tail<3>().norm(), 1e-6);
    EXPECT_LT((back.velocity_B_m_s - nav.velocity_B_m_s).norm(), 1e-3);
    EXPECT_NEAR(back.yaw_rate_rad_s, nav.yaw_rate_rad_s, 2.6e-4);
  }
}

TEST(CanRecordsTest, TheDopplerLogKeepsItsLockAndItsEchoes) {
  const CanDvl dvl{{FromUtime(1'500'000'000'123'456), 0, {0.25, -0.5, 0.125}, true},
                   {1.5, std::nullopt, 2.5, 80.0}};
  const auto back = std::get<CanDvl>(Exchange(dvl).at(0));
  EXPECT_EQ(back.record.time, dvl.record.time);
  EXPECT_TRUE(back.record.valid);
  EXPECT_TRUE(back.record.velocity_B_m_s.isApprox(dvl.record.velocity_B_m_s, 1e-9));
  EXPECT_NEAR(back.range_m[0].value(), 1.5, 1e-9);
  EXPECT_FALSE(back.range_m[1]);
}

TEST(CanRecordsTest, ARecordThatLostAFrameIsLeftOutAndNoticed) {
  const CanRecord nav = RandomVehicleNav(1);
  const std::size_t frames = CanRecordWriter().Write(nav).size();
  for (std::size_t lost = 0; lost < frames; ++lost) {
    CanRecordWriter writer;
    CanRecordReader reader;
    std::vector<std::int64_t> sequences;
    for (int i = 0; i < 40; ++i) {
      const auto sent = writer.Write(nav);
      for (std::size_t k = 0; k < frames; ++k) {
        if (i == 20 && k == lost) continue;
        if (const auto record = reader.Add(sent[k]))
          sequences.push_back(std::get<VehicleNavRecord>(*record).sequence);
      }
    }
    EXPECT_EQ(sequences.size(), 39u);
    EXPECT_EQ(sequences.back(), 39);
    EXPECT_EQ(reader.lost_records(), 1);
    EXPECT_EQ(reader.rejected_frames(), 0);
  }
}

TEST(CanRecordsTest, RepeatedFramesGiveNoRecordTwice) {
  CanRecordWriter writer;
  CanRecordReader reader;
  const auto sent = writer.Write(DepthRecord{Time{}, 0, 3});
  int records = 0;
  for (int i = 0; i < 3; ++i) {
    for (const CanFrame& frame : sent) records += reader.Add(frame).has_value();
  }
  EXPECT_EQ(records, 1);
  EXPECT_EQ(reader.stray_frames(), 4);
}

TEST(CanRecordsTest, NoFrameWithUpToThreeFlippedBitsIsTaken) {
  for (int i = 0; i < 50; ++i) {
    for (const CanFrame& good : CanRecordWriter().Write(RandomCanRecord(i))) {
      for (int bits = 0; bits < 64 * 4; ++bits) {
        Random random(i, "flips", bits);
        CanFrame bad = good;
        for (int k = random.Index(3); k >= 0; --k)
          bad.data[random.Index(8)] ^= 1 << random.Index(8);
        if (bad == good) continue;
        CanRecordReader reader;
        EXPECT_FALSE(reader.Add(bad));
        EXPECT_EQ(reader.rejected_frames(), 1);
      }
    }
  }
}

TEST(CanRecordsTest, OtherFramesAreNotOurs) {
  CanFrame frame = CanRecordWriter().Write(VehicleHeartbeat{{Time{}, 5, true}}).at(0);
  CanRecordReader reader;
  EXPECT_TRUE(reader.Add(frame));
  for (auto change : {+[](CanFrame& f) { f.extended = true; }, +[](CanFrame& f) { f.error = true; },
                      +[](CanFrame& f) { f.id = 0x7FF; }}) {
    CanFrame other = frame;
    change(other);
    EXPECT_FALSE(reader.Add(other));
  }
  EXPECT_EQ(reader.rejected_frames(), 0);
  frame.size = 7;
  EXPECT_FALSE(reader.Add(frame));
  EXPECT_EQ(reader.rejected_frames(), 1);
}

}  // namespace
}  // namespace vog
