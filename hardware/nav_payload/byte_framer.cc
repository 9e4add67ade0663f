#include "hardware/nav_payload/byte_framer.h"

namespace vog {

std::vector<ByteVector> ByteFramer::Add(ByteSpan chunk) {
  buffer_.insert(buffer_.end(), chunk.begin(), chunk.end());
  std::vector<ByteVector> frames;
  ByteSpan rest = buffer_;
  while (!rest.empty()) {
    const HeadOfStream head = look_(rest);
    if (head.kind == HeadOfStream::kIncomplete) break;
    if (head.kind == HeadOfStream::kFrame) {
      frames.emplace_back(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(head.size));
      rest = rest.subspan(head.size);
    } else {
      rest = rest.subspan(1);
      ++garbage_bytes_;
    }
  }
  buffer_.erase(buffer_.begin(), buffer_.end() - static_cast<std::ptrdiff_t>(rest.size()));
  return frames;
}

}  // namespace vog
