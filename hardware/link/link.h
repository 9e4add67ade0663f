#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>

#include "hardware/frames/can_frame.h"
#include "lib/base/time.h"

namespace vog {

/// What went over a link since it was made.
struct LinkCounters {
  std::int64_t bytes_in = 0, bytes_out = 0;  ///< Of CAN frames: their data.
  std::int64_t reconnects = 0;               ///< Times that it was opened again.
  std::int64_t dropped = 0;  ///< Writes, datagrams or frames, of either direction, that were lost.
  std::int64_t errors = 0;   ///< Of the system, of damaged recordings; error frames of CAN.
  std::int64_t stalls = 0;   ///< Times that the system could take no more: its buffers were full.
};

enum class ReadOutcome {
  kData,
  kNothing,  ///< For now.
  kClosed,   ///< Until Step() has opened it again; of recordings: their end.
};

/// `size` bytes were read; of datagrams one.
struct ByteRead {
  ReadOutcome outcome = ReadOutcome::kNothing;
  std::size_t size = 0;
  Time time{};  ///< When they came, by the system's clock. Datagrams have the kernel's stamp.
};

struct CanRead {
  ReadOutcome outcome = ReadOutcome::kNothing;
  CanFrame frame{};
};

/// What the links have in common. None of their functions waits: a loop polls fd() and calls
/// Step() every 10 ms or so.
class Link {
 public:
  virtual ~Link() = default;

  /// To poll for input; -1 where there is none to poll, or it is closed. Changes with Step().
  virtual int fd() const = 0;

  /// Opens again what was closed, 10 ms to 5 s after the last attempt, and sends what waits. `now`
  /// comes from any clock that never goes back.
  virtual void Step(Time now) = 0;

  const LinkCounters& counters() const { return counters_; }

 protected:
  LinkCounters counters_;
};

/// For STATUS: what went wrong with a link, as far as every user of one tells it.
void CountLink(const Link& link, std::map<std::string, std::int64_t>& counters);

/// Bytes to and from a device.
class ByteLink : public Link {
 public:
  virtual ByteRead Read(std::span<std::uint8_t> into) = 0;

  /// Sends all of `bytes` or, where too much waits already or the link is closed, drops all of
  /// them.
  virtual void Write(std::span<const std::uint8_t> bytes) = 0;
};

/// Frames to and from a CAN bus.
class CanLink : public Link {
 public:
  virtual CanRead Read() = 0;

  /// Sends the frame or, where too many wait already or the link is closed, drops it.
  virtual void Write(const CanFrame& frame) = 0;
};

}  // namespace vog
