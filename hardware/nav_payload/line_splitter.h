#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hardware/frames/bytes.h"

namespace vog {

/// Cuts a stream of bytes, in chunks of any size, into lines of printable ASCII. Carriage return
/// and line feed both end a line; empty lines are left out. A byte that is not printable discards
/// what came of its line so far, and so does a line longer than `max_length`: that is garbage.
class LineSplitter {
 public:
  explicit LineSplitter(std::size_t max_length = 512) : max_length_(max_length) {}

  /// The lines that `chunk` completes, without their ends.
  std::vector<std::string> Add(ByteSpan chunk);

  /// Kept for the next chunk: at most `max_length`.
  std::size_t buffered_bytes() const { return line_.size(); }
  std::int64_t garbage_bytes() const { return garbage_bytes_; }

 private:
  void Append(char c);
  void Discard();

  std::size_t max_length_;
  std::string line_;
  bool is_too_long_ = false;  ///< Nothing is taken before this line's end.
  std::int64_t garbage_bytes_ = 0;
};

}  // namespace vog
