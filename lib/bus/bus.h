#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "lib/base/time.h"

namespace vog {

using Bytes = std::span<const std::uint8_t>;

/// All that a node may see of the world outside: messages, ticks and the time. Handlers and ticks
/// run one at a time, on the thread that runs the bus.
class Bus {
 public:
  /// `now` is the vehicle's time at which the message arrived.
  using Handler = std::function<void(Time now, Bytes bytes)>;
  using Tick = std::function<void(Time now)>;

  virtual ~Bus() = default;

  virtual void Publish(const std::string& channel, Bytes bytes) = 0;
  /// For the parts of large messages: sent in order, but not faster than receivers can empty their
  /// sockets.
  virtual void PublishPaced(const std::string& channel, Bytes bytes) = 0;
  virtual void Subscribe(const std::string& channel, Handler handler) = 0;
  /// Housekeeping, such as status and asking again for what is missing. Results never depend on
  /// ticks.
  virtual void Every(Duration period, Tick tick) = 0;

  /// Calls `work` after messages have been handled, when no more of them wait: for work that only
  /// the newest of them matter to, which would otherwise fall behind on a slow machine. Where they
  /// never cease, after each thousand all the same. In lock step: after each message.
  virtual void WhenCaughtUp(std::function<void()> work) = 0;

  /// Grows from one start of the process to the next.
  virtual std::int64_t epoch() const = 0;
};

}  // namespace vog
