#include "tools/log/keyboard.h"

#include <poll.h>
#include <unistd.h>

#include <array>

namespace vog {

std::vector<Key> ParseKeys(std::string_view bytes) {
  constexpr std::array<std::pair<std::string_view, Key>, 11> kKeys = {{{"\033[C", Key::kForward},
                                                                       {"\033[D", Key::kBack},
                                                                       {"\033OC", Key::kForward},
                                                                       {"\033OD", Key::kBack},
                                                                       {" ", Key::kPause},
                                                                       {"s", Key::kStep},
                                                                       {"+", Key::kFaster},
                                                                       {"=", Key::kFaster},
                                                                       {"-", Key::kSlower},
                                                                       {"q", Key::kQuit},
                                                                       {"Q", Key::kQuit}}};
  std::vector<Key> keys;
  while (!bytes.empty()) {
    std::size_t taken = 1;
    for (const auto& [sent, key] : kKeys) {
      if (!bytes.starts_with(sent)) continue;
      keys.push_back(key);
      taken = sent.size();
    }
    bytes.remove_prefix(taken);
  }
  return keys;
}

Keyboard::Keyboard()
    : is_there_(::isatty(STDIN_FILENO) != 0 && ::tcgetpgrp(STDIN_FILENO) == ::getpgrp() &&
                ::tcgetattr(STDIN_FILENO, &before_) == 0) {
  if (!is_there_) return;
  termios settings = before_;
  settings.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  ::tcsetattr(STDIN_FILENO, TCSANOW, &settings);
}

Keyboard::~Keyboard() {
  if (is_there_) ::tcsetattr(STDIN_FILENO, TCSANOW, &before_);
}

std::vector<Key> Keyboard::Read() const {
  pollfd wanted{STDIN_FILENO, POLLIN, 0};
  if (!is_there_ || ::poll(&wanted, 1, 0) != 1 || (wanted.revents & POLLIN) == 0) return {};
  std::array<char, 64> bytes{};
  const ssize_t size = ::read(STDIN_FILENO, bytes.data(), bytes.size());
  return size > 0 ? ParseKeys({bytes.data(), static_cast<std::size_t>(size)}) : std::vector<Key>();
}

}  // namespace vog
