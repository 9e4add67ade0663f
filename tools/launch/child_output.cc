#include "tools/launch/child_output.h"

#include <fcntl.h>
#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "lib/base/errors.h"

namespace vog {

ChildOutput::ChildOutput(std::filesystem::path file, std::uintmax_t max_bytes)
    : file_(std::move(file)), max_bytes_(max_bytes) {
  if (::openpty(&fd_, &child_fd_, nullptr, nullptr, nullptr) != 0)
    throw SystemError(std::string("no pseudo terminal: ") + std::strerror(errno));
  termios settings{};
  ::tcgetattr(child_fd_, &settings);
  settings.c_oflag &= ~static_cast<tcflag_t>(OPOST);
  ::tcsetattr(child_fd_, TCSANOW, &settings);
  ::fcntl(fd_, F_SETFL, O_NONBLOCK);
  ::fcntl(fd_, F_SETFD, FD_CLOEXEC);
  ::fcntl(child_fd_, F_SETFD, FD_CLOEXEC);
}

ChildOutput::~ChildOutput() {
  ::close(fd_);
  ::close(child_fd_);
}

std::string ChildOutput::Read() {
  constexpr std::size_t kMost = 65536;
  std::string text(kMost, '\0');
  std::size_t size = 0;
  while (size < kMost) {
    const ssize_t got = ::read(fd_, text.data() + size, kMost - size);
    if (got <= 0) break;
    size += static_cast<std::size_t>(got);
  }
  text.resize(size);
  if (!text.empty()) Keep(text);
  return text;
}

void ChildOutput::Keep(const std::string& text) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file_, error);
  if (!error && size + text.size() > max_bytes_)
    std::filesystem::rename(file_, file_.string() + ".1", error);
  std::ofstream stream(file_, std::ios::app | std::ios::binary);
  if (!(stream << text << std::flush)) lost_bytes_ += static_cast<std::int64_t>(text.size());
}

}  // namespace vog
