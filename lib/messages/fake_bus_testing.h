#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "lib/bus/bus.h"

namespace vog {

/// A bus for tests: keeps what is published, and delivers and ticks when it is told to.
class FakeBus final : public Bus {
 public:
  struct Sent {
    std::string channel;
    std::vector<std::uint8_t> bytes;
  };

  void Publish(const std::string& channel, Bytes bytes) override {
    sent.push_back({channel, {bytes.begin(), bytes.end()}});
  }
  void PublishPaced(const std::string& channel, Bytes bytes) override { Publish(channel, bytes); }
  void Subscribe(const std::string& channel, Handler handler) override {
    handlers_[channel].push_back(std::move(handler));
  }
  void Every(Duration, Tick tick) override { ticks_.push_back(std::move(tick)); }
  void WhenCaughtUp(std::function<void()> work) override { works_.push_back(std::move(work)); }
  std::int64_t epoch() const override { return current_epoch; }

  void Deliver(const Sent& message, Time now = {}) {
    Arrive(message, now);
    CatchUp();
  }
  /// A message behind which others wait.
  void Arrive(const Sent& message, Time now = {}) {
    for (const Handler& handler : handlers_[message.channel]) handler(now, message.bytes);
  }
  void CatchUp() {
    for (const auto& work : works_) work();
  }
  void TickAll(Time now = {}) {
    for (const Tick& tick : ticks_) tick(now);
  }
  std::vector<Sent> TakeSent() { return std::exchange(sent, {}); }

  std::vector<Sent> sent;
  std::int64_t current_epoch = 1;

 private:
  std::map<std::string, std::vector<Handler>> handlers_;
  std::vector<Tick> ticks_;
  std::vector<std::function<void()>> works_;
};

}  // namespace vog
