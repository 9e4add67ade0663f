#pragma once

#include <deque>
#include <map>
#include <memory>
#include <queue>
#include <string>
#include <vector>

#include "lib/bus/bus.h"

namespace vog {

/// A bus inside one process and one thread, in simulated time, for any number of nodes. Events run
/// in the order (time, order of arrival), so that a run is a function of its inputs alone.
class QueueBus {
 public:
  /// What one handler call took, for those who watch the run.
  struct Handled {
    Time time;
    std::string node;
    std::string channel;
    double wall_s = 0;
    std::vector<std::string> published;  ///< Channels it wrote to.
  };
  using Observer = std::function<void(Time, const std::string& channel, Bytes)>;
  using HandledObserver = std::function<void(const Handled&)>;

  /// Its time begins at `start`, which is also its nodes' epoch.
  explicit QueueBus(Time start = {});
  ~QueueBus();

  /// The bus as the node called `name` sees it. What the node publishes arrives `latency` later:
  /// the time that its work would take on the vehicle.
  Bus& AddNode(const std::string& name, Duration latency = {});

  /// Queues a message from outside, such as a log event. @pre at >= now().
  void PublishAt(Time at, const std::string& channel, Bytes bytes);

  /// Calls `observer` with each message, when it is delivered and before any handler sees it.
  void Observe(Observer observer) { observer_ = std::move(observer); }
  /// Measures handlers with the wall clock, which they themselves never see.
  void ObserveHandled(HandledObserver observer) { handled_observer_ = std::move(observer); }

  /// Runs all events up to and including `end`, and leaves now() at `end`.
  void RunUntil(Time end);

  Time now() const { return now_; }

 private:
  class Node;
  struct Event {
    Time time;
    std::int64_t arrival;
    std::string channel;  // Empty for a tick.
    std::vector<std::uint8_t> bytes;
    std::function<void()> tick;
    bool operator>(const Event& other) const {
      return time != other.time ? time > other.time : arrival > other.arrival;
    }
  };
  struct Subscription {
    Node* node;
    Bus::Handler handler;
  };

  void At(Time at, std::function<void()> tick);
  void Deliver(const Event& event);
  void Handle(const Subscription& subscription, const Event& event);

  Time start_, now_;
  std::int64_t arrivals_ = 0;
  std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
  std::map<std::string, std::vector<Subscription>> subscriptions_;
  std::deque<Node> nodes_;
  Observer observer_;
  HandledObserver handled_observer_;
  std::vector<std::string>* published_ = nullptr;  // Of the handler that runs now.
};

}  // namespace vog
