#include "tools/mission/progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace vog {

ProgressBar::ProgressBar() : is_terminal_(::isatty(STDERR_FILENO) != 0) {}

ProgressBar::~ProgressBar() {
  if (!shown_.empty()) std::fputs("\n", stderr);
}

void ProgressBar::Show(double share, const std::string& text) {
  if (!is_terminal_) return;
  constexpr int kWidth = 24;
  const int filled = static_cast<int>(std::clamp(share, 0.0, 1.0) * kWidth);
  const std::string line =
      "[" + std::string(filled, '#') + std::string(kWidth - filled, '.') + "] " + text;
  if (line == shown_) return;
  shown_ = line;
  std::fprintf(stderr, "\r\033[K%s", line.c_str());
  std::fflush(stderr);
}

}  // namespace vog
