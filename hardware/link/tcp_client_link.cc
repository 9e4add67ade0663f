#include "hardware/link/tcp_client_link.h"

#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <cerrno>

#include "hardware/link/sockets.h"

namespace vog {

TcpClientLink::TcpClientLink(const std::string& address) : address_(ResolveAddress(address)) {}

UniqueFd TcpClientLink::Open() {
  UniqueFd fd(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!fd.is_open()) return fd;
  SetOption(fd.get(), IPPROTO_TCP, TCP_NODELAY, 1, "TCP_NODELAY");
  // A vehicle that was switched off says nothing: the kernel asks after some seconds.
  SetOption(fd.get(), SOL_SOCKET, SO_KEEPALIVE, 1, "SO_KEEPALIVE");
  SetOption(fd.get(), IPPROTO_TCP, TCP_KEEPIDLE, 5, "TCP_KEEPIDLE");
  SetOption(fd.get(), IPPROTO_TCP, TCP_KEEPINTVL, 1, "TCP_KEEPINTVL");
  SetOption(fd.get(), IPPROTO_TCP, TCP_KEEPCNT, 5, "TCP_KEEPCNT");
  const auto* address = reinterpret_cast<const sockaddr*>(&address_);
  if (connect(fd.get(), address, sizeof address_) != 0 && errno != EINPROGRESS) fd.Close();
  return fd;
}

StreamLink::Progress TcpClientLink::CheckOpening(int fd) {
  pollfd ready{fd, POLLOUT, 0};
  if (poll(&ready, 1, 0) <= 0) return Progress::kPending;
  int error = 0;
  socklen_t size = sizeof error;
  if (getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size) != 0) error = errno;
  if (error == 0) return Progress::kDone;
  ++counters_.errors;
  return Progress::kFailed;
}

std::int64_t TcpClientLink::SendSome(int fd, std::span<const std::uint8_t> bytes) {
  return send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
}

}  // namespace vog
