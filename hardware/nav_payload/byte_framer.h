#pragma once

#include <cstdint>
#include <vector>

#include "hardware/frames/bytes.h"

namespace vog {

/// What stands at the head of a stream of bytes.
struct HeadOfStream {
  enum Kind { kFrame, kIncomplete, kGarbage };
  Kind kind = kGarbage;
  std::size_t size = 0;  ///< Of the frame [bytes].
};

/// Cuts a stream of bytes, in chunks of any size, into the frames that `look` finds. A byte with
/// which no frame begins is garbage; the search goes on behind it, so that a good frame inside a
/// damaged one is found. A false head holds the stream up for at most the largest frame's bytes.
class ByteFramer {
 public:
  using Look = HeadOfStream (*)(ByteSpan bytes);

  /// @pre `look` says kFrame or kGarbage where it is given as many bytes as the largest frame has.
  explicit ByteFramer(Look look) : look_(look) {}

  /// The frames that `chunk` completes.
  std::vector<ByteVector> Add(ByteSpan chunk);

  /// Kept for the next chunk: fewer than the largest frame's.
  std::size_t buffered_bytes() const { return buffer_.size(); }
  std::int64_t garbage_bytes() const { return garbage_bytes_; }

 private:
  Look look_;
  ByteVector buffer_;
  std::int64_t garbage_bytes_ = 0;
};

}  // namespace vog
