#include "hardware/link/udp_link.h"

#include <sys/socket.h>

#include <cerrno>
#include <cstring>

#include "hardware/link/sockets.h"
#include "lib/base/errors.h"

namespace vog {

UdpLink::UdpLink(std::uint16_t port, const std::optional<std::string>& peer)
    : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)) {
  if (!fd_.is_open()) throw SystemError(std::string("no UDP socket: ") + std::strerror(errno));
  if (peer) peer_ = ResolveAddress(*peer);
  SetOption(fd_.get(), SOL_SOCKET, SO_TIMESTAMP, 1, "SO_TIMESTAMP");
  SetOption(fd_.get(), SOL_SOCKET, SO_RXQ_OVFL, 1, "SO_RXQ_OVFL");
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_ANY);
  if (bind(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw SystemError("UDP port " + std::to_string(port) + ": " + std::strerror(errno));
}

ByteRead UdpLink::Read(std::span<std::uint8_t> into) {
  ReceivedExtras extras;
  const std::int64_t size = Receive(fd_.get(), into.data(), into.size(), extras);
  if (size < 0) {
    counters_.errors += !IsTryLater(errno);
    return {};
  }
  if (extras.dropped) {
    counters_.dropped += *extras.dropped - kernel_dropped_;
    kernel_dropped_ = *extras.dropped;
  }
  counters_.errors += extras.truncated;
  counters_.bytes_in += size;
  return {ReadOutcome::kData, static_cast<std::size_t>(size), extras.time.value_or(SystemNow())};
}

void UdpLink::Write(std::span<const std::uint8_t> bytes) {
  const auto* address = reinterpret_cast<const sockaddr*>(peer_ ? &*peer_ : nullptr);
  if (peer_ && sendto(fd_.get(), bytes.data(), bytes.size(), 0, address, sizeof *peer_) >= 0) {
    counters_.bytes_out += static_cast<std::int64_t>(bytes.size());
    return;
  }
  ++counters_.dropped;
  if (!peer_) return;
  if (IsTryLater(errno) || errno == ENOBUFS) {
    ++counters_.stalls;
  } else {
    ++counters_.errors;
  }
}

}  // namespace vog
