#include "lib/bus/lcm_log.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "lib/base/errors.h"
#include "lib/base/files.h"
#include "lib/base/random.h"

namespace vog {

void PrintTo(const LogEvent& event, std::ostream* out) {
  *out << event.channel << " of " << event.bytes.size() << " bytes";
}

namespace {

namespace fs = std::filesystem;

constexpr int kHeadBytes = 28;  // Of an event: magic, number, time, two lengths.

class LcmLogTest : public testing::Test {
 protected:
  LcmLogTest() {
    fs::create_directories(folder_);
    for (int i = 0; i < 20; ++i) {
      LogEvent event{FromUtime(1'700'000'000'000'000 + 1000 * i), "CHANNEL_" + std::to_string(i),
                     std::vector<std::uint8_t>(random_.Index(60))};
      for (auto& byte : event.bytes) byte = static_cast<std::uint8_t>(random_.Index(256));
      events_.push_back(event);
    }
    events_[3].bytes.clear();
    LcmLogWriter writer(path_);
    for (const LogEvent& event : events_) writer.Write(event.time, event.channel, event.bytes);
  }
  ~LcmLogTest() override { fs::remove_all(folder_); }

  /// All events of a log that holds `bytes`.
  std::vector<LogEvent> EventsIn(const std::string& bytes) const {
    const std::string path = (folder_ / "other.log").string();
    fs::remove(path);  // Some file systems flush a file that is truncated, which takes long.
    std::ofstream(path, std::ios::binary) << bytes;
    LcmLogReader reader(path);
    std::vector<LogEvent> events;
    while (auto event = reader.Next()) events.push_back(*event);
    return events;
  }

  static std::string ErrorOf(const std::string& path) {
    try {
      LcmLogReader reader(path);
    } catch (const UsageError& error) {
      return error.what();
    }
    return "no error";
  }

  /// Where event i begins in the file.
  std::size_t StartOf(std::size_t i) const {
    std::size_t at = 0;
    for (std::size_t k = 0; k < i; ++k)
      at += kHeadBytes + events_[k].channel.size() + events_[k].bytes.size();
    return at;
  }

  std::vector<LogEvent> FirstEvents(std::size_t count) const {
    return {events_.begin(), events_.begin() + static_cast<std::ptrdiff_t>(count)};
  }

  Random random_{1, "lcm_log"};
  fs::path folder_ =
      fs::path(testing::TempDir()) /
      (std::string("lcm_log_") + testing::UnitTest::GetInstance()->current_test_info()->name());
  std::string path_ = (folder_ / "a.log").string();
  std::vector<LogEvent> events_;
};

TEST_F(LcmLogTest, ReadsBackWhatWasWritten) {
  LcmLogReader reader(path_);
  for (const LogEvent& event : events_) {
    const auto read = reader.Next();
    ASSERT_TRUE(read);
    EXPECT_TRUE(*read == event) << event.channel;
  }
  EXPECT_FALSE(reader.Next());
  EXPECT_FALSE(reader.Next());
}

TEST_F(LcmLogTest, WritingTheSameEventsGivesTheSameBytes) {
  const std::string again = (folder_ / "b.log").string();
  {
    LcmLogWriter writer(again);
    for (const LogEvent& event : events_) writer.Write(event.time, event.channel, event.bytes);
  }
  EXPECT_TRUE(ReadFile(again) == ReadFile(path_));
  EXPECT_EQ(ReadFile(path_).size(), StartOf(events_.size()));
}

TEST_F(LcmLogTest, ALogCutShortGivesItsWholeEvents) {
  const std::string bytes = ReadFile(path_);
  std::size_t whole = 0;
  for (std::size_t size = 4; size <= bytes.size(); ++size) {
    while (whole < events_.size() && StartOf(whole + 1) <= size) ++whole;
    ASSERT_TRUE(EventsIn(bytes.substr(0, size)) == FirstEvents(whole)) << size;
  }
  EXPECT_EQ(whole, events_.size());
}

TEST_F(LcmLogTest, ADamagedByteCostsNoMoreThanItsEventAndTheOneBefore) {
  const std::string bytes = ReadFile(path_);
  std::size_t event = 0;
  for (std::size_t at = 4; at < bytes.size(); at += 3) {
    if (StartOf(event + 1) <= at) ++event;
    const std::size_t in_event = at - StartOf(event);
    if (in_event >= 20 && in_event < 28) continue;  // Lengths: they may swallow what follows.
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(~damaged[at]);
    const auto read = EventsIn(damaged);
    ASSERT_LE(read.size(), events_.size()) << at;
    for (std::size_t i = 0; i < events_.size(); ++i) {
      const bool is_lost = std::find(read.begin(), read.end(), events_[i]) == read.end();
      ASSERT_TRUE(!is_lost || i == event || i + 1 == event) << at << ": lost " << i;
    }
  }
}

TEST_F(LcmLogTest, DamagedLengthsNeverCrash) {
  const std::string bytes = ReadFile(path_);
  for (std::size_t i = 0; i < events_.size(); ++i)
    for (int bit = 0; bit < 64; ++bit) {
      std::string damaged = bytes;
      damaged[StartOf(i) + 20 + bit / 8] ^= 1 << bit % 8;
      const auto read = EventsIn(damaged);
      ASSERT_LE(read.size(), events_.size());
      for (std::size_t k = 0; k + 1 < i; ++k) ASSERT_EQ(read.at(k), events_[k]) << i << " " << bit;
    }
}

TEST_F(LcmLogTest, StrayBytesCostTheEventBeforeThem) {
  std::string bytes = ReadFile(path_);
  std::vector<LogEvent> expected = events_;
  for (const int i : {15, 9, 1}) {
    bytes.insert(StartOf(i), "stray bytes");
    expected.erase(expected.begin() + i - 1);
  }
  EXPECT_TRUE(EventsIn(bytes) == expected);
}

TEST_F(LcmLogTest, AnEmptyLogHasNoEvents) { EXPECT_TRUE(EventsIn("").empty()); }

TEST_F(LcmLogTest, SaysWhatIsWrong) {
  const std::string none = (folder_ / "none.log").string();
  EXPECT_EQ(ErrorOf(none), none + ": no such log");
  EXPECT_EQ(ErrorOf(folder_.string()), folder_.string() + ": no such log");
  const std::string text = (folder_ / "text.log").string();
  std::ofstream(text) << "this is not a log";
  EXPECT_EQ(ErrorOf(text), text + ": not an LCM event log");
  const std::string nowhere = (folder_ / "none" / "a.log").string();
  try {
    LcmLogWriter writer(nowhere);
    FAIL();
  } catch (const SystemError& error) {
    EXPECT_EQ(error.what(), nowhere + ": cannot create the log");
  }
}

TEST_F(LcmLogTest, AFullDiskIsTold) {
  LcmLogWriter writer("/dev/full");
  const std::vector<std::uint8_t> bytes(100'000);
  EXPECT_THROW(writer.Write(Time{}, "X", bytes), SystemError);
}

TEST_F(LcmLogTest, SeeksToATime) {
  const std::string path = (folder_ / "long.log").string();
  {
    LcmLogWriter writer(path);
    const std::vector<std::uint8_t> bytes(1000);
    for (int i = 0; i < 1000; ++i) writer.Write(FromUtime(10 * i), "A", bytes);
  }
  LcmLogReader reader(path);
  for (const int wanted : {5000, 0, 9990, 4321, 10, -7}) {
    reader.SeekTo(FromUtime(wanted));
    const auto event = reader.Next();
    ASSERT_TRUE(event) << wanted;
    EXPECT_EQ(ToUtime(event->time), std::max(0, (wanted + 9) / 10 * 10)) << wanted;
    const auto next = reader.Next();
    EXPECT_EQ(next.has_value(), wanted < 9990) << wanted;
    EXPECT_TRUE(!next || next->time > event->time) << wanted;
  }
  reader.SeekTo(FromUtime(10'000));
  EXPECT_FALSE(reader.Next());
  reader.SeekTo(FromUtime(0));
  EXPECT_TRUE(reader.Next());
}

TEST_F(LcmLogTest, FlushedMessagesAreInTheFile) {
  const std::string path = (folder_ / "flushed.log").string();
  LcmLogWriter writer(path);
  writer.Write(events_[0].time, events_[0].channel, events_[0].bytes);
  writer.Flush();
  EXPECT_EQ(writer.size_bytes(), fs::file_size(path));
  EXPECT_THROW(
      {
        LcmLogWriter full("/dev/full");
        full.Write(events_[0].time, "A", events_[0].bytes);
        full.Flush();
      },
      SystemError);
}

}  // namespace
}  // namespace vog
