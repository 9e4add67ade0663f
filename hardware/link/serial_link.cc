#include "hardware/link/serial_link.h"

#include <asm/termbits.h>  // termios2; <termios.h> has no rates but the usual.
#include <fcntl.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "lib/base/errors.h"

namespace vog {
namespace {

/// 0 or errno.
int Lock(int fd) {
  if (flock(fd, LOCK_EX | LOCK_NB) != 0) return errno == EWOULDBLOCK ? EBUSY : errno;
  return ioctl(fd, TIOCEXCL) == 0 ? 0 : errno;
}

/// 0 or errno.
int SetRaw(int fd, int baud) {
  termios2 settings{};
  if (ioctl(fd, TCGETS2, &settings) != 0) return errno;
  settings.c_iflag = settings.c_oflag = settings.c_lflag = 0;
  settings.c_cflag = CS8 | CREAD | CLOCAL | BOTHER;
  settings.c_ispeed = settings.c_ospeed = static_cast<speed_t>(baud);
  // With 1, reading nothing is EAGAIN and reading the end of a line that hung up is 0.
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
  return ioctl(fd, TCSETS2, &settings) == 0 ? 0 : errno;
}

/// The line, or nothing and errno.
UniqueFd OpenSerial(const std::string& device, int baud) {
  UniqueFd fd(open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!fd.is_open()) return fd;
  int error = Lock(fd.get());
  if (error == 0) error = SetRaw(fd.get(), baud);
  if (error == 0) return fd;
  fd.Close();
  errno = error;
  return fd;
}

/// What goes away by itself when the device is plugged in.
bool IsAbsent(int error) {
  return error == ENOENT || error == ENODEV || error == ENXIO || error == EIO;
}

}  // namespace

SerialLink::SerialLink(std::string device, int baud) : device_(std::move(device)), baud_(baud) {
  UniqueFd fd = OpenSerial(device_, baud_);
  const int error = errno;
  if (fd.is_open()) {
    Adopt(std::move(fd));
  } else if (error == EBUSY) {
    throw SystemError(device_ + ": in use by another program");
  } else if (!IsAbsent(error)) {
    throw SystemError(device_ + ": " + std::strerror(error));
  }
}

UniqueFd SerialLink::Open() { return OpenSerial(device_, baud_); }

std::int64_t SerialLink::SendSome(int fd, std::span<const std::uint8_t> bytes) {
  return write(fd, bytes.data(), bytes.size());
}

}  // namespace vog
