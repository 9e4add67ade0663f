#pragma once

#include <fstream>
#include <string>

#include "hardware/link/link.h"

namespace vog {

/// The bytes of a file, as fast as they are read; writes go nowhere. Reads have no time.
class FileLink : public ByteLink {
 public:
  /// @throws UsageError where it cannot be opened.
  explicit FileLink(const std::string& path);

  int fd() const override { return -1; }
  ByteRead Read(std::span<std::uint8_t> into) override;
  void Write(std::span<const std::uint8_t>) override { ++counters_.dropped; }
  void Step(Time) override {}

 private:
  std::ifstream file_;
};

/// The frames of a log of `candump -l` with their times, as fast as they are read; lines that are
/// no frames are counted as errors. Writes go nowhere.
class CandumpLink : public CanLink {
 public:
  /// @throws UsageError where it cannot be opened.
  explicit CandumpLink(const std::string& path);

  int fd() const override { return -1; }
  CanRead Read() override;
  void Write(const CanFrame&) override { ++counters_.dropped; }
  void Step(Time) override {}

 private:
  std::ifstream file_;
};

}  // namespace vog
