#include "lib/bus/queue_bus.h"

#include <chrono>
#include <utility>

namespace vog {

class QueueBus::Node final : public Bus {
 public:
  Node(QueueBus& queue, std::string name, Duration latency)
      : queue_(queue), name_(std::move(name)), latency_(latency) {}

  void Publish(const std::string& channel, Bytes bytes) override {
    if (queue_.published_ != nullptr) queue_.published_->push_back(channel);
    queue_.PublishAt(queue_.now_ + latency_, channel, bytes);
  }
  void PublishPaced(const std::string& channel, Bytes bytes) override { Publish(channel, bytes); }
  void Subscribe(const std::string& channel, Handler handler) override {
    queue_.subscriptions_[channel].push_back({this, std::move(handler)});
  }
  void Every(Duration period, Tick tick) override { TickAt(queue_.now_ + period, period, tick); }
  void WhenCaughtUp(std::function<void()> work) override { works_.push_back(std::move(work)); }
  std::int64_t epoch() const override { return ToUtime(queue_.start_); }

  void Handle(const Subscription& subscription, const Event& event) const {
    subscription.handler(event.time, event.bytes);
    for (const auto& work : works_) work();
  }

  const std::string& name() const { return name_; }

 private:
  void TickAt(Time at, Duration period, const Tick& tick) {
    queue_.At(at, [this, at, period, tick] {
      tick(at);
      TickAt(at + period, period, tick);
    });
  }

  QueueBus& queue_;
  std::string name_;
  Duration latency_;
  std::vector<std::function<void()>> works_;
};

QueueBus::QueueBus(Time start) : start_(start), now_(start) {}
QueueBus::~QueueBus() = default;

Bus& QueueBus::AddNode(const std::string& name, Duration latency) {
  return nodes_.emplace_back(*this, name, latency);
}

void QueueBus::At(Time at, std::function<void()> tick) {
  events_.push({at, arrivals_++, {}, {}, std::move(tick)});
}

void QueueBus::PublishAt(Time at, const std::string& channel, Bytes bytes) {
  events_.push({at, arrivals_++, channel, {bytes.begin(), bytes.end()}, {}});
}

void QueueBus::RunUntil(Time end) {
  while (!events_.empty() && events_.top().time <= end) {
    const Event event = std::move(const_cast<Event&>(events_.top()));
    events_.pop();
    now_ = event.time;
    if (event.tick) {
      event.tick();
    } else {
      Deliver(event);
    }
  }
  now_ = end;
}

void QueueBus::Deliver(const Event& event) {
  if (observer_) observer_(event.time, event.channel, event.bytes);
  const auto found = subscriptions_.find(event.channel);
  if (found == subscriptions_.end()) return;
  for (const Subscription& subscription : found->second) Handle(subscription, event);
}

void QueueBus::Handle(const Subscription& subscription, const Event& event) {
  if (!handled_observer_) {
    subscription.node->Handle(subscription, event);
    return;
  }
  Handled handled{event.time, subscription.node->name(), event.channel, 0, {}};
  published_ = &handled.published;
  const auto start = std::chrono::steady_clock::now();
  subscription.node->Handle(subscription, event);
  handled.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  published_ = nullptr;
  handled_observer_(handled);
}

}  // namespace vog
