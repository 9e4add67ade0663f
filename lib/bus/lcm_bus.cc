#include "lib/bus/lcm_bus.h"

#include <algorithm>
#include <utility>

#include "lib/base/errors.h"

namespace vog {
namespace {

constexpr Duration kMaxLeap = std::chrono::seconds(60);
constexpr Duration kMaxWait = std::chrono::milliseconds(50);
// One part of at most 32 KB each: 16 MB/s, which leaves a receiver's default socket buffer half
// empty.
constexpr Duration kPacedPeriod = std::chrono::milliseconds(2);
constexpr int kQueueCapacity = 20000;
constexpr int kMaxBurst = 1000;
constexpr const char* kSelfTestChannel = "VOG_SELF_TEST";
constexpr const char* kLibrarysSelfTestChannel = "LCM_SELF_TEST";

template <class Clock>
Duration SinceEpoch() {
  return std::chrono::duration_cast<Duration>(Clock::now().time_since_epoch());
}

/// Every message of ours starts with LCM's 8 bytes of type and then its utime_us, big-endian.
std::int64_t UtimeIn(Bytes bytes) {
  if (bytes.size() < 16) return 0;
  std::uint64_t utime_us = 0;
  for (int i = 8; i < 16; ++i) utime_us = utime_us << 8 | bytes[i];
  return static_cast<std::int64_t>(utime_us);
}

Bytes BytesOf(const lcm::ReceiveBuffer* buffer) {
  return {static_cast<const std::uint8_t*>(buffer->data), buffer->data_size};
}

std::string WithReceiveBuffer(std::string url) {
  if (url.starts_with("udpm") && url.find("recv_buf_size") == std::string::npos)
    url += std::string(url.find('?') == std::string::npos ? "?" : "&") + "recv_buf_size=4194304";
  return url;
}

}  // namespace

LcmBus::LcmBus(const BusOptions& options)
    : options_(options), lcm_(WithReceiveBuffer(options.url)) {
  if (!lcm_.good()) throw SystemError("LCM cannot open " + options.url);
  utc_offset_ = SinceEpoch<std::chrono::system_clock>() - SinceEpoch<std::chrono::steady_clock>();
  epoch_ = ToUtime(SystemTime());
  CheckLoopback();
}

void LcmBus::CheckLoopback() {
  bool heard = false;
  lcm::Subscription* const subscription = lcm_.subscribeFunction(
      kSelfTestChannel,
      +[](const lcm::ReceiveBuffer*, const std::string&, bool* echo) { *echo = true; }, &heard);
  constexpr int kAttempts = 20;
  for (int i = 0; i < kAttempts && !heard; ++i) {
    lcm_.publish(kSelfTestChannel, "", 0);
    lcm_.handleTimeout(50);
  }
  lcm_.unsubscribe(subscription);
  if (!heard)
    throw SystemError("LCM does not hear itself on " + options_.url +
                      ": no multicast route? As root: ip link set lo multicast on; "
                      "ip route add 239.0.0.0/8 dev lo");
}

Time LcmBus::SystemTime() const {
  return Time(SinceEpoch<std::chrono::steady_clock>() + utc_offset_);
}

Time LcmBus::VehicleTime(Bytes bytes) {
  if (options_.clock == ClockSource::kSystem) return SystemTime();
  const Time told = FromUtime(std::max<std::int64_t>(0, UtimeIn(bytes)));
  // Bytes that make no sense must not push the time away: a leap counts when it is told twice.
  const bool is_near = told - newest_message_ < kMaxLeap || told - last_told_ < kMaxLeap;
  last_told_ = told;
  if (is_near) newest_message_ = std::max(newest_message_, told);
  return newest_message_;
}

void LcmBus::Publish(const std::string& channel, Bytes bytes) {
  lcm_.publish(options_.channel_prefix + channel, bytes.data(),
               static_cast<unsigned>(bytes.size()));
}

void LcmBus::PublishPaced(const std::string& channel, Bytes bytes) {
  waiting_.push_back({channel, {bytes.begin(), bytes.end()}});
  SendPaced();
}

void LcmBus::SendPaced() {
  const Time now = SystemTime();
  if (waiting_.empty() || now < next_paced_) return;
  Publish(waiting_.front().channel, waiting_.front().bytes);
  waiting_.pop_front();
  next_paced_ = now + kPacedPeriod;
}

void LcmBus::Flush() {
  while (!waiting_.empty()) {
    lcm_.handleTimeout(1);
    SendPaced();
  }
}

template <class Handle>
void LcmBus::Guard(Handle handle) {
  if (failure_) return;
  try {
    handle();
  } catch (...) {
    failure_ = std::current_exception();
  }
}

void LcmBus::Subscribe(const std::string& channel, Handler handler) {
  subscriptions_.push_back({this, std::move(handler)});
  lcm_.subscribeFunction(options_.channel_prefix + channel, &Subscription::OnMessage,
                         &subscriptions_.back())
      ->setQueueCapacity(kQueueCapacity);
}

void LcmBus::SubscribeAll(std::function<void(Time, const std::string&, Bytes)> handler) {
  listeners_.push_back({this, std::move(handler)});
  lcm_.subscribeFunction(options_.channel_prefix + ".*", &Listener::OnMessage, &listeners_.back())
      ->setQueueCapacity(kQueueCapacity);
}

void LcmBus::Subscription::OnMessage(const lcm::ReceiveBuffer* buffer, const std::string&,
                                     Subscription* self) {
  LcmBus& bus = *self->bus;
  bus.Guard([&] { self->handler(bus.VehicleTime(BytesOf(buffer)), BytesOf(buffer)); });
}

void LcmBus::Listener::OnMessage(const lcm::ReceiveBuffer* buffer, const std::string& channel,
                                 Listener* self) {
  if (channel == kSelfTestChannel || channel == kLibrarysSelfTestChannel) return;
  LcmBus& bus = *self->bus;
  bus.Guard([&] {
    self->handler(bus.VehicleTime(BytesOf(buffer)),
                  channel.substr(bus.options_.channel_prefix.size()), BytesOf(buffer));
  });
}

void LcmBus::Every(Duration period, Tick tick) {
  timers_.push_back({SystemTime() + period, period, std::move(tick)});
}

void LcmBus::RunTimers() {
  const Time now = SystemTime();
  for (Timer& timer : timers_) {
    if (timer.next > now) continue;
    timer.tick(options_.clock == ClockSource::kSystem ? now : newest_message_);
    // Ticks that a busy handler has missed are not made up for.
    timer.next = std::max(timer.next + timer.period, now);
  }
}

Duration LcmBus::WaitTime(Duration limit) const {
  const Time now = SystemTime();
  Duration wait = std::min(limit, kMaxWait);
  for (const Timer& timer : timers_) wait = std::min(wait, timer.next - now);
  if (!waiting_.empty()) wait = std::min(wait, next_paced_ - now);
  return std::max(wait, Duration::zero());
}

void LcmBus::HandleMessages(Duration limit) {
  const Duration wait = handled_ > 0 ? Duration::zero() : WaitTime(limit);
  const int status = lcm_.handleTimeout(
      static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(wait).count()));
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  if (status > 0) ++handled_;
  if (status > 0 ? handled_ >= kMaxBurst : handled_ > 0) CatchUp();
}

void LcmBus::CatchUp() {
  handled_ = 0;
  for (const auto& work : works_) work();
}

void LcmBus::Run(const std::atomic<bool>& stop) {
  while (!stop) RunFor(Duration::zero());
}

void LcmBus::RunFor(Duration timeout) {
  const Time end = SystemTime() + timeout;
  do {
    RunTimers();
    SendPaced();
    HandleMessages(timeout > Duration::zero() ? end - SystemTime() : kMaxWait);
  } while (SystemTime() < end);
}

}  // namespace vog
