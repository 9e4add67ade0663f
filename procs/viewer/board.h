#pragma once

#include <cstdint>
#include <map>
#include <utility>

#include "procs/viewer/frame.h"

namespace vog {

/// All that a page should know now: under each key its newest frame. A reader remembers how far it
/// has read and takes what is newer, so that one who comes late, one who is slow and one who
/// follows do the same: the slow one skips what was replaced meanwhile, and nobody's backlog grows.
class Board {
 public:
  using Key = std::pair<FrameKind, std::int64_t>;

  void Post(const Key& key, Frame frame) {
    if (const auto old = revisions_.find(key); old != revisions_.end()) frames_.erase(old->second);
    revisions_[key] = ++revision_;
    frames_[revision_] = std::move(frame);
  }

  /// The oldest frame that was posted after `revision`, which becomes that frame's; nullptr when
  /// there is none.
  const Frame* After(std::int64_t& revision) const {
    const auto next = frames_.upper_bound(revision);
    if (next == frames_.end()) return nullptr;
    revision = next->first;
    return &next->second;
  }

  /// Takes all away; readers see by generation() that what they know is void.
  void Clear() {
    revisions_.clear();
    frames_.clear();
    ++generation_;
  }

  std::int64_t generation() const { return generation_; }
  std::size_t size() const { return frames_.size(); }

 private:
  std::map<Key, std::int64_t> revisions_;
  std::map<std::int64_t, Frame> frames_;  // By revision.
  std::int64_t revision_ = 0, generation_ = 0;
};

}  // namespace vog
