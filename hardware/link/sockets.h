#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <cstdint>
#include <optional>
#include <string>

#include "lib/base/time.h"

namespace vog {

/// The system's clock.
Time SystemNow();

/// "10.0.1.112:29500" or "vehicle:29500", IPv4. A name is looked up, which may wait.
/// @throws UsageError where it is no address, SystemError where nobody has that name.
sockaddr_in ResolveAddress(const std::string& host_and_port);

/// 1..65535. @throws UsageError.
std::uint16_t ParsePort(const std::string& text);

/// Sets an integer option. @throws SystemError saying `what` it was for.
void SetOption(int fd, int level, int option, int value, const char* what);

/// What the kernel says beside received data.
struct ReceivedExtras {
  std::optional<Time> time;              ///< SO_TIMESTAMP
  std::optional<std::uint32_t> dropped;  ///< SO_RXQ_OVFL: lost since the socket was opened.
  bool truncated = false;                ///< There was more than fitted.
};

/// One datagram or frame: its size, or -1 and errno.
std::int64_t Receive(int fd, void* into, std::size_t size, ReceivedExtras& extras);

/// Whether errno says that nothing was wrong: try later.
bool IsTryLater(int error);

}  // namespace vog
