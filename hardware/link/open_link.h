#pragma once

#include <memory>
#include <string>

#include "hardware/link/link.h"
#include "lib/base/config.h"

namespace vog {

/// Where a device is, as configuration files say it.
///
///   serial:/dev/ttyUSB0?baud=115200    a serial line; baud is 9600 unless it is said
///   tcp:10.0.1.112:29500               a TCP server
///   udp:50700?peer=10.0.1.117:700      datagrams to a port of ours, and to whom to send
///   pty:/tmp/vehicle                   the far end of the serial line of that name
///   file:recording.bin                 recorded bytes
///   can:can0?filter=110:7F0,200:700    a CAN interface; filters ID:MASK, of 8 digits: extended
///   candump:recording.log              recorded frames
struct LinkOptions {
  std::string url;

  void Visit(OptionsVisitor& v) {
    v("url", url,
      "where the device is: serial:DEVICE?baud=N, tcp:HOST:PORT, udp:PORT?peer=HOST:PORT, "
      "pty:NAME, file:PATH, can:INTERFACE?filter=ID:MASK,..., candump:PATH; empty: nowhere, "
      "messages take its place");
  }
};

/// All but the last two. @throws UsageError on one line where the URL says none of them, and
/// whatever the link throws.
std::unique_ptr<ByteLink> OpenByteLink(const LinkOptions& options);
/// can and candump, likewise.
std::unique_ptr<CanLink> OpenCanLink(const LinkOptions& options);

}  // namespace vog
