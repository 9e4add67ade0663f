#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "procs/viewer/frame.h"

namespace vog {

/// The small frames of a run over time. Bounded: when it holds too much, the kind that takes most
/// gives up every other frame of its older half, so that the past becomes coarse but stays whole.
class History {
 public:
  explicit History(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  /// @pre in the order of time, kind by kind; a frame that is older than the last one of its kind
  /// is passed over.
  void Add(FrameKind kind, std::int64_t utime_us, const Frame& frame);

  /// How things were: of each kind the newest frame that is not newer than `utime_us`.
  std::vector<Frame> At(std::int64_t utime_us) const;

  void Clear();

  std::size_t bytes() const { return bytes_; }

 private:
  struct Entry {
    std::int64_t utime_us;
    Frame frame;
  };
  struct Line {
    std::vector<Entry> entries;
    std::size_t bytes = 0;
  };

  bool Thin();

  std::size_t max_bytes_;
  std::map<FrameKind, Line> lines_;
  std::size_t bytes_ = 0;
};

}  // namespace vog
