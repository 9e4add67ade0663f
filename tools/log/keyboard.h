#pragma once

#include <termios.h>

#include <string>
#include <string_view>
#include <vector>

namespace vog {

enum class Key { kPause, kStep, kFaster, kSlower, kForward, kBack, kQuit };

/// The keys that an operator's terminal has sent; others are passed over.
std::vector<Key> ParseKeys(std::string_view bytes);

/// A player's keys, one at a time and without an echo, where standard input is a terminal in the
/// foreground. Elsewhere there are none.
class Keyboard {
 public:
  Keyboard();
  ~Keyboard();
  Keyboard(const Keyboard&) = delete;
  Keyboard& operator=(const Keyboard&) = delete;

  bool IsThere() const { return is_there_; }
  /// What was pressed since; does not wait.
  std::vector<Key> Read() const;

 private:
  bool is_there_;
  termios before_{};
};

}  // namespace vog
