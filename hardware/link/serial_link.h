#pragma once

#include <string>

#include "hardware/link/stream_link.h"

namespace vog {

/// A serial line: 8 data bits, no parity, 1 stop bit, raw, no flow control, at any rate that the
/// device can do. Nobody else may open it meanwhile. A device that is not there, or was unplugged,
/// is opened when it comes.
class SerialLink : public StreamLink {
 public:
  /// @throws SystemError where another program has it open, or it is no serial line.
  SerialLink(std::string device, int baud);

 protected:
  UniqueFd Open() override;
  Progress CheckOpening(int) override { return Progress::kDone; }
  std::int64_t SendSome(int fd, std::span<const std::uint8_t> bytes) override;

 private:
  std::string device_;
  int baud_;
};

}  // namespace vog
