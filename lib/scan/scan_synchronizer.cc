#include "lib/scan/scan_synchronizer.h"

#include <utility>

namespace vog {
namespace {

constexpr std::size_t kMaxWaiting = 256;

}  // namespace

void ScanSynchronizer::DropFront() {
  waiting_.pop_front();
  ++dropped_;
}

void ScanSynchronizer::Add(const OdometrySample& sample) {
  if (!odometry_.empty()) {
    const OdometrySample& newest = odometry_.newest();
    if (sample.segment < newest.segment) return;
    if (sample.segment == newest.segment && sample.time <= newest.time) return;
  }
  odometry_.Add(sample);
  // Without a waiting scan, the newest sample is all that a later scan may need.
  odometry_.ForgetBefore(waiting_.empty() ? newest_scan_ : waiting_.front().time);
}

void ScanSynchronizer::Add(Scan scan) {
  if (scan.time <= newest_scan_) {
    ++dropped_;
    return;
  }
  newest_scan_ = scan.time;
  waiting_.push_back(std::move(scan));
  if (waiting_.size() > kMaxWaiting) DropFront();
}

std::optional<RegisteredScan> ScanSynchronizer::Next() {
  while (!waiting_.empty() && !odometry_.empty()) {
    const Time time = waiting_.front().time;
    if (time > odometry_.newest().time) return std::nullopt;
    const auto sample = odometry_.At(time);
    if (!sample) {
      DropFront();
      continue;
    }
    RegisteredScan registered{std::move(waiting_.front()), *sample};
    waiting_.pop_front();
    return registered;
  }
  return std::nullopt;
}

}  // namespace vog
