#pragma once

#include <string>

namespace vog {

/// A bar on the terminal; says nothing when standard error is no terminal.
class ProgressBar {
 public:
  ProgressBar();
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// Draws `share` (0..1) of the bar and `text` behind it.
  void Show(double share, const std::string& text);

 private:
  bool is_terminal_;
  std::string shown_;
};

}  // namespace vog
