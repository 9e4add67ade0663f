#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "lib/scan/scan.h"

namespace vog {

/// Gives each scan its odometry. A scan waits until there is odometry on both sides of it, so that
/// the result depends on the times in the messages and not on which of them came first.
class ScanSynchronizer {
 public:
  void Add(const OdometrySample& sample);
  void Add(Scan scan);

  /// The next scan that has found its odometry, in order of time.
  std::optional<RegisteredScan> Next();

  /// Scans given up: out of order, older than all odometry, across two segments, in a gap of the
  /// odometry, or too many waiting.
  std::int64_t dropped() const { return dropped_; }
  int waiting() const { return static_cast<int>(waiting_.size()); }

 private:
  void DropFront();

  OdometryHistory odometry_;
  std::deque<Scan> waiting_;
  Time newest_scan_ = Time::min();
  std::int64_t dropped_ = 0;
};

}  // namespace vog
