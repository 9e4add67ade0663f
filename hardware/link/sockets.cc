#include "hardware/link/sockets.h"

#include <netdb.h>
#include <sys/time.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <memory>

#include "lib/base/errors.h"

namespace vog {

Time SystemNow() {
  return Time(
      std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch()));
}

std::uint16_t ParsePort(const std::string& text) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (error != std::errc() || end != text.data() + text.size() || port == 0)
    throw UsageError("\"" + text + "\" is no port (1..65535)");
  return port;
}

sockaddr_in ResolveAddress(const std::string& host_and_port) {
  const std::size_t colon = host_and_port.rfind(':');
  if (colon == std::string::npos || colon == 0)
    throw UsageError("\"" + host_and_port + "\" is no HOST:PORT");
  const std::uint16_t port = ParsePort(host_and_port.substr(colon + 1));
  const std::string host = host_and_port.substr(0, colon);
  addrinfo hints{};
  hints.ai_family = AF_INET;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(host.c_str(), nullptr, &hints, &found); error != 0)
    throw SystemError(host + ": " + gai_strerror(error));
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owner(found, &freeaddrinfo);
  sockaddr_in address;
  std::memcpy(&address, found->ai_addr, sizeof address);
  address.sin_port = htons(port);
  return address;
}

void SetOption(int fd, int level, int option, int value, const char* what) {
  if (setsockopt(fd, level, option, &value, sizeof value) != 0)
    throw SystemError(std::string(what) + ": " + std::strerror(errno));
}

std::int64_t Receive(int fd, void* into, std::size_t size, ReceivedExtras& extras) {
  iovec part{into, size};
  alignas(cmsghdr) std::array<char, 256> control;
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const std::int64_t received = recvmsg(fd, &message, MSG_DONTWAIT);
  if (received < 0) return received;
  extras.truncated = (message.msg_flags & MSG_TRUNC) != 0;
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET) continue;
    if (c->cmsg_type == SCM_TIMESTAMP) {
      timeval stamp;
      std::memcpy(&stamp, CMSG_DATA(c), sizeof stamp);
      extras.time = FromUtime(std::int64_t{stamp.tv_sec} * 1'000'000 + stamp.tv_usec);
    } else if (c->cmsg_type == SO_RXQ_OVFL) {
      extras.dropped.emplace();
      std::memcpy(&*extras.dropped, CMSG_DATA(c), sizeof *extras.dropped);
    }
  }
  return received;
}

bool IsTryLater(int error) { return error == EAGAIN || error == EWOULDBLOCK || error == EINTR; }

}  // namespace vog
