#pragma once

#include <netinet/in.h>

#include <string>

#include "hardware/link/stream_link.h"

namespace vog {

/// The client's end of a TCP connection. It is opened by the first Step(), and again whenever the
/// server closes it.
class TcpClientLink : public StreamLink {
 public:
  /// "HOST:PORT"; a name is looked up once, here. @throws UsageError, SystemError.
  explicit TcpClientLink(const std::string& address);

 protected:
  UniqueFd Open() override;
  Progress CheckOpening(int fd) override;
  std::int64_t SendSome(int fd, std::span<const std::uint8_t> bytes) override;

 private:
  sockaddr_in address_;
};

}  // namespace vog
