#pragma once

#include <netinet/in.h>

#include <optional>
#include <string>

#include "hardware/link/link.h"
#include "hardware/link/unique_fd.h"

namespace vog {

/// Datagrams: each Read() gives one, each Write() sends one to the peer. The kernel's buffers are
/// the queues; what it lost is counted as dropped, a datagram larger than the reader's buffer as an
/// error.
class UdpLink : public ByteLink {
 public:
  /// Receives at `port` from anybody. `peer`, "HOST:PORT", is who is sent to; without one, writes
  /// are dropped. @throws UsageError, SystemError (the port is taken).
  UdpLink(std::uint16_t port, const std::optional<std::string>& peer);

  int fd() const override { return fd_.get(); }
  ByteRead Read(std::span<std::uint8_t> into) override;
  void Write(std::span<const std::uint8_t> bytes) override;
  void Step(Time) override {}

 private:
  UniqueFd fd_;
  std::optional<sockaddr_in> peer_;
  std::uint32_t kernel_dropped_ = 0;
};

}  // namespace vog
