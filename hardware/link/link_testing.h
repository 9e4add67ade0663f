#pragma once

#include <gtest/gtest.h>
#include <poll.h>

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "hardware/link/link.h"

namespace vog {

/// Steps the link, 10 ms of its clock at a time, until `is_done` or so often that it never will be.
inline bool StepUntil(Link& link, const std::function<bool()>& is_done) {
  static Time now{};
  for (int i = 0; i < 2000; ++i) {
    if (is_done()) return true;
    now += std::chrono::milliseconds(10);
    link.Step(now);
    poll(nullptr, 0, 1);
  }
  return false;
}

inline void WriteText(ByteLink& link, std::string_view text) {
  link.Write({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

/// One read of at most `size` bytes.
inline std::string ReadText(ByteLink& link, std::size_t size = 4096) {
  std::string text(size, '\0');
  const ByteRead read = link.Read({reinterpret_cast<std::uint8_t*>(text.data()), text.size()});
  return text.substr(0, read.size);
}

/// Reads on until there are `size` bytes.
inline std::string Gather(ByteLink& link, std::size_t size) {
  std::string text;
  StepUntil(link, [&] {
    text += ReadText(link);
    return text.size() >= size;
  });
  return text;
}

/// All values that a byte can have.
inline std::string AllBytes() {
  std::string bytes;
  for (int value = 0; value < 256; ++value) bytes.push_back(static_cast<char>(value));
  return bytes;
}

/// A folder for a test's files that is gone after it.
class TestFolder {
 public:
  TestFolder() {
    std::string name = testing::TempDir() + "vog_link_XXXXXX";
    path_ = mkdtemp(name.data());
  }
  ~TestFolder() { std::filesystem::remove_all(path_); }
  TestFolder(const TestFolder&) = delete;
  TestFolder& operator=(const TestFolder&) = delete;

  std::string File(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace vog
