#include "procs/viewer/history.h"

#include <algorithm>

namespace vog {
namespace {

// What an entry takes besides its frame's bytes.
constexpr std::size_t kOverhead_bytes = 96;

std::size_t CostOf(const Frame& frame) { return frame.bytes->size() + kOverhead_bytes; }

}  // namespace

void History::Add(FrameKind kind, std::int64_t utime_us, const Frame& frame) {
  Line& line = lines_[kind];
  if (!line.entries.empty() && utime_us < line.entries.back().utime_us) return;
  line.entries.push_back({utime_us, frame});
  line.bytes += CostOf(frame);
  bytes_ += CostOf(frame);
  while (bytes_ > max_bytes_ && Thin()) {
  }
}

bool History::Thin() {
  const auto largest = std::max_element(
      lines_.begin(), lines_.end(),
      [](const auto& a, const auto& b) { return a.second.bytes < b.second.bytes; });
  Line& line = largest->second;
  if (line.entries.size() < 4) return false;
  std::vector<Entry> kept;
  for (std::size_t i = 0; i < line.entries.size(); ++i) {
    // The first one stays: it tells how things began.
    if (i < line.entries.size() / 2 && i % 2 == 1) {
      line.bytes -= CostOf(line.entries[i].frame);
      bytes_ -= CostOf(line.entries[i].frame);
    } else {
      kept.push_back(std::move(line.entries[i]));
    }
  }
  line.entries = std::move(kept);
  return true;
}

std::vector<Frame> History::At(std::int64_t utime_us) const {
  std::vector<Frame> frames;
  for (const auto& [kind, line] : lines_) {
    const auto after = std::upper_bound(
        line.entries.begin(), line.entries.end(), utime_us,
        [](std::int64_t time, const Entry& entry) { return time < entry.utime_us; });
    if (after != line.entries.begin()) frames.push_back(std::prev(after)->frame);
  }
  return frames;
}

void History::Clear() {
  lines_.clear();
  bytes_ = 0;
}

}  // namespace vog
