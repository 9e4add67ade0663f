#include "hardware/nav_payload/line_splitter.h"

#include <utility>

namespace vog {

std::vector<std::string> LineSplitter::Add(ByteSpan chunk) {
  std::vector<std::string> lines;
  for (const std::uint8_t byte : chunk) {
    const char c = static_cast<char>(byte);
    if (c != '\n' && c != '\r') {
      Append(c);
      continue;
    }
    if (!line_.empty()) lines.push_back(std::exchange(line_, {}));
    is_too_long_ = false;
  }
  return lines;
}

void LineSplitter::Append(char c) {
  const bool is_printable = (c >= ' ' && c <= '~') || c == '\t';
  is_too_long_ = is_too_long_ || line_.size() == max_length_;
  if (is_printable && !is_too_long_) {
    line_.push_back(c);
  } else {
    Discard();
  }
}

void LineSplitter::Discard() {
  garbage_bytes_ += static_cast<std::int64_t>(line_.size()) + 1;
  line_.clear();
}

}  // namespace vog
