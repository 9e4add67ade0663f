#include "hardware/link/pty_link.h"

#include <fcntl.h>
#include <pty.h>
#include <termios.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "lib/base/errors.h"

namespace vog {

PtyLink::PtyLink(std::filesystem::path name) : name_(std::move(name)) {
  UniqueFd fd = Open();
  if (!fd.is_open()) throw SystemError("pty:" + name_.string() + ": " + std::strerror(errno));
  Adopt(std::move(fd));
}

PtyLink::~PtyLink() {
  std::error_code error;
  std::filesystem::remove(name_, error);
}

UniqueFd PtyLink::Open() {
  int fd = -1, device = -1;
  if (openpty(&fd, &device, nullptr, nullptr, nullptr) != 0) return UniqueFd();
  UniqueFd opened(fd);
  device_ = UniqueFd(device);
  for (const int each : {fd, device}) fcntl(each, F_SETFD, FD_CLOEXEC);
  fcntl(fd, F_SETFL, O_NONBLOCK);
  termios settings{};
  tcgetattr(device, &settings);
  cfmakeraw(&settings);
  tcsetattr(device, TCSANOW, &settings);
  const std::filesystem::path path = ptsname(fd);
  std::error_code error;
  if (std::filesystem::is_symlink(name_)) std::filesystem::remove(name_, error);
  std::filesystem::create_symlink(path, name_, error);
  if (!error) return opened;
  errno = error.value();
  return UniqueFd();
}

std::int64_t PtyLink::SendSome(int fd, std::span<const std::uint8_t> bytes) {
  const std::int64_t sent = write(fd, bytes.data(), bytes.size());
  if (sent >= 0 || errno != EAGAIN) return sent;
  tcflush(device_.get(), TCIFLUSH);
  ++counters_.dropped;
  return static_cast<std::int64_t>(bytes.size());
}

}  // namespace vog
