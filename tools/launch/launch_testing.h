#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <string>

#include "lib/base/time.h"
#include "lib/bus/stopwatch.h"
#include "tools/launch/pmd_file.h"

namespace vog {

/// A folder that goes with the test.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string pattern = ::testing::TempDir() + "vog-launch-XXXXXX";
    path_ = ::mkdtemp(pattern.data());
  }
  ~ScratchFolder() { std::filesystem::remove_all(path_); }

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline CommandSpec SpecOf(const std::string& name, const std::string& exec,
                          bool auto_respawn = false) {
  CommandSpec spec;
  spec.name = name;
  spec.exec = exec;
  spec.auto_respawn = auto_respawn;
  return spec;
}

/// Calls `step` every few milliseconds of real time until `is_done`, for children need it; false
/// when that takes too long.
inline bool StepUntil(const std::function<void(Time)>& step, const std::function<bool()>& is_done,
                      double limit_s = 20) {
  const Stopwatch waited;
  while (!is_done()) {
    if (waited.seconds() > limit_s) return false;
    WaitBriefly();
    step(FromUtime(1'000'000'000) + FromSeconds(waited.seconds()));
  }
  return true;
}

}  // namespace vog
