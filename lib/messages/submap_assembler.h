#pragma once

#include <cstdint>
#include <map>

#include "lib/messages/endpoint.h"
#include "lib/submap/submap.h"

namespace vog {

/// Makes submaps of the chunks on SUBMAP, and knows which ones it has made.
class SubmapAssembler {
 public:
  struct Result {
    SubmapPtr submap;  ///< The one that became whole; nullptr where none did.
    /// It contradicts an earlier one of its number: all before it are void.
    bool is_of_another_map = false;
    bool is_malformed = false;
  };

  /// A chunk of what is known already adds nothing.
  Result Add(const chunk_t& chunk);
  void Clear() { checksums_.clear(); }

  /// Of the submaps made: the versions of their chunks.
  const std::map<SubmapId, std::uint32_t>& checksums() const { return checksums_; }
  std::int64_t dropped() const { return chunks_.dropped(); }

 private:
  ChunkAssembler chunks_;
  std::map<SubmapId, std::uint32_t> checksums_;
};

}  // namespace vog
