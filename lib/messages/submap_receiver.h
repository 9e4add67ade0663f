#pragma once

#include <functional>

#include "lib/messages/submap_assembler.h"
#include "vog/submap_t.hpp"

namespace vog {

/// Collects the closed submaps that the map service sends on SUBMAP, knows from MAP_STATUS which
/// are missing and asks for those again: after a loss, a late start, or a restart on either side.
class SubmapReceiver {
 public:
  struct Callbacks {
    /// A whole submap, each number once, in any order.
    std::function<void(const SubmapPtr&)> on_submap;
    /// The service holds another map than the one received: forget all submaps, they come again.
    std::function<void()> on_reset;
    /// Every MAP_STATUS, after the receiver has looked at it.
    std::function<void(const map_status_t&)> on_status;
  };

  SubmapReceiver(Endpoint& endpoint, Callbacks callbacks);

  /// Submaps that the map service has told of; -1 before it was heard.
  int announced() const { return announced_; }
  /// Whether all those are here.
  bool IsComplete() const;

  /// Digest of the contents received, up to the first that is missing: MAP_STATUS.digest when all
  /// is well.
  std::int64_t digest() const { return DigestOf(announced_); }

  std::int64_t dropped() const { return submaps_.dropped(); }

 private:
  void OnChunk(const chunk_t& chunk);
  void OnMapStatus(const map_status_t& status);
  bool Contradicts(const map_status_t& status) const;
  void AskForMissing(Time now);
  std::int64_t DigestOf(int submaps) const;

  Endpoint& endpoint_;
  Callbacks callbacks_;
  SubmapAssembler submaps_;
  int announced_ = -1;
  int announced_before_ = -1;  // A tick ago: what was announced since may still be under way.
  std::int64_t next_request_ = 1;
};

/// Asks SLAM to tell SUBMAP_POSES and GRAPH again.
void AskForPoses(Endpoint& endpoint, Time now);

/// Check sum of all that a submap says, whenever and by whichever epoch it is sent: the version of
/// its chunks.
std::uint32_t ContentChecksum(submap_t message);

/// Digest of the check sums of submaps 0, 1, ... in order, as MAP_STATUS carries it.
std::int64_t AppendToDigest(std::int64_t digest, std::uint32_t checksum);

}  // namespace vog
