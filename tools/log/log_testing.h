#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "lib/bus/lcm_log.h"

namespace vog {

/// A test with a folder for logs.
class LogTest : public ::testing::Test {
 protected:
  LogTest() {
    std::string pattern = ::testing::TempDir() + "vog-log-XXXXXX";
    folder_ = ::mkdtemp(pattern.data());
  }
  ~LogTest() override { std::filesystem::remove_all(folder_); }

  std::string PathOf(const std::string& name) const { return (folder_ / name).string(); }

  static LogEvent EventAt(double s, const std::string& channel, const std::string& text) {
    return {FromUtime(5'000'000) + FromSeconds(s), channel, {text.begin(), text.end()}};
  }
  std::string Write(const std::string& name, const std::vector<LogEvent>& events) const {
    LcmLogWriter writer(PathOf(name));
    for (const LogEvent& event : events) writer.Write(event.time, event.channel, event.bytes);
    return PathOf(name);
  }
  static std::vector<LogEvent> Read(const std::string& path) {
    LcmLogReader reader(path);
    std::vector<LogEvent> events;
    while (auto event = reader.Next()) events.push_back(*event);
    return events;
  }
  /// What the messages of a log say, one after the other.
  static std::string TextOf(const std::string& path) {
    std::string text;
    for (const LogEvent& event : Read(path)) text.append(event.bytes.begin(), event.bytes.end());
    return text;
  }

  std::filesystem::path folder_;
};

}  // namespace vog
