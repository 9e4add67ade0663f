#pragma once

#include <atomic>
#include <deque>
#include <exception>
#include <lcm/lcm-cpp.hpp>
#include <string>

#include "lib/base/config.h"
#include "lib/bus/bus.h"

namespace vog {

/// Where the time of a live process comes from.
enum class ClockSource {
  kSystem,   ///< The machine, anchored once to UTC, so that setting its clock does no harm.
  kMessage,  ///< The newest time that any message has told: for simulators and replays.
};

struct BusOptions {
  std::string url = "udpm://239.255.76.67:7667?ttl=0";
  std::string channel_prefix;
  std::int64_t run_id = 0;
  ClockSource clock = ClockSource::kSystem;

  void Visit(OptionsVisitor& v) {
    v("url", url, "LCM provider; ttl=0 keeps the traffic on this machine");
    v("channel_prefix", channel_prefix, "put before each channel's name");
    v("run_id", run_id, AtLeast(0), "of this run; 0 takes the first one heard");
    v("clock", clock,
      Names<ClockSource>{{ClockSource::kSystem, "system"}, {ClockSource::kMessage, "message"}},
      "the vehicle's own clock, or the times in the messages (simulator, replay)");
  }
};

/// The bus of a real process: LCM for messages, the system clock for ticks.
class LcmBus final : public Bus {
 public:
  /// @throws SystemError if LCM cannot be opened, or does not hear itself: most often a machine
  /// without a multicast route.
  explicit LcmBus(const BusOptions& options);

  void Publish(const std::string& channel, Bytes bytes) override;
  void PublishPaced(const std::string& channel, Bytes bytes) override;
  void Subscribe(const std::string& channel, Handler handler) override;
  /// Ticks follow the system clock; `now` is the vehicle's time all the same.
  void Every(Duration period, Tick tick) override;
  void WhenCaughtUp(std::function<void()> work) override { works_.push_back(std::move(work)); }
  std::int64_t epoch() const override { return epoch_; }

  /// Calls `handler(now, channel, bytes)` with every message there is, but for those by which buses
  /// find out whether they hear themselves.
  void SubscribeAll(std::function<void(Time, const std::string&, Bytes)> handler);

  /// Handles messages and ticks until `stop`. Rethrows what a handler threw.
  void Run(const std::atomic<bool>& stop);
  /// The same for at most `timeout`.
  void RunFor(Duration timeout);

  /// Sends all that is still waiting to be paced.
  void Flush();

 private:
  // Their handlers are plain functions: GCC's sanitizer misreads LCM's calls through pointers to
  // members.
  struct Subscription {
    LcmBus* bus;
    Handler handler;
    static void OnMessage(const lcm::ReceiveBuffer* buffer, const std::string& channel,
                          Subscription* self);
  };
  struct Listener {
    LcmBus* bus;
    std::function<void(Time, const std::string&, Bytes)> handler;
    static void OnMessage(const lcm::ReceiveBuffer* buffer, const std::string& channel,
                          Listener* self);
  };
  struct Timer {
    Time next;
    Duration period;
    Tick tick;
  };
  struct Waiting {
    std::string channel;
    std::vector<std::uint8_t> bytes;
  };

  void CheckLoopback();
  Time VehicleTime(Bytes bytes);
  Time SystemTime() const;
  template <class Handle>
  void Guard(Handle handle);
  void RunTimers();
  void SendPaced();
  void HandleMessages(Duration limit);
  void CatchUp();
  Duration WaitTime(Duration limit) const;

  BusOptions options_;
  lcm::LCM lcm_;
  Duration utc_offset_{};  // From the monotonic clock.
  std::int64_t epoch_ = 0;
  Time newest_message_{};
  Time last_told_{};                        // By the last message, sense or not.
  std::deque<Subscription> subscriptions_;  // Deques: LCM keeps their addresses.
  std::deque<Listener> listeners_;
  std::deque<Timer> timers_;
  std::deque<std::function<void()>> works_;
  int handled_ = 0;  // Messages, since works_ were called.
  std::deque<Waiting> waiting_;
  Time next_paced_{};
  std::exception_ptr failure_;  // Kept until LCM's C frames are off the stack.
};

}  // namespace vog
