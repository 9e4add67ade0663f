#include "tools/log/log_recorder.h"

#include <algorithm>

#include "lib/base/errors.h"
#include "tools/log/log_testing.h"

namespace vog {
namespace {

class LogRecorderTest : public LogTest {
 protected:
  static void Write(LogRecorder& recorder, const std::string& text) {
    const LogEvent event = EventAt(0, "A", text);
    recorder.Write(event.time, event.channel, event.bytes);
  }
  std::vector<std::string> Files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_))
      names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
  }
};

TEST_F(LogRecorderTest, OneFileOfAnySize) {
  {
    LogRecorder recorder({PathOf("x.log")});
    Write(recorder, "a");
    Write(recorder, "b");
    recorder.Tick();
    EXPECT_EQ(TextOf(PathOf("x.log")), "ab");
    Write(recorder, "c");
    EXPECT_EQ(recorder.written(), 3);
  }
  EXPECT_EQ(TextOf(PathOf("x.log")), "abc");
  EXPECT_THROW(LogRecorder({PathOf("x.log")}), UsageError);
  EXPECT_THROW(LogRecorder({PathOf("no/such.log")}), SystemError);
}

TEST_F(LogRecorderTest, RotatesAndGoesOnAfterWhatIsThere) {
  const std::string part(400, 'x');
  {
    LogRecorder recorder({PathOf("x.log"), 1000});
    for (int i = 0; i < 7; ++i) Write(recorder, part);
  }
  EXPECT_EQ(Files(), (std::vector<std::string>{"x.log.000", "x.log.001", "x.log.002"}));
  EXPECT_EQ(Read(PathOf("x.log.000")).size(), 3u);
  EXPECT_EQ(Read(PathOf("x.log.002")).size(), 1u);
  LogRecorder recorder({PathOf("x.log"), 1000, 2});
  EXPECT_EQ(Files(), (std::vector<std::string>{"x.log.002", "x.log.003"}));
  Write(recorder, "new");
  recorder.Tick();
  EXPECT_EQ(TextOf(PathOf("x.log.003")), "new");
}

}  // namespace
}  // namespace vog
