#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "lib/bus/bus.h"
#include "lib/messages/channels.h"

namespace vog {

/// Encodes a message that lcm-gen made.
template <class Message>
std::vector<std::uint8_t> Encode(const Message& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

/// Decodes `bytes`; false for bytes of another type, cut short or too long.
template <class Message>
bool Decode(Bytes bytes, Message& message) {
  if (bytes.size() > std::numeric_limits<int>::max()) return false;
  const int size = static_cast<int>(bytes.size());
  try {
    return message.decode(bytes.data(), 0, size) == size;
  } catch (const std::exception&) {  // An impossible length in the bytes.
    return false;
  }
}

/// Calls `handle(message)` if `bytes` came on `channel` and are a message of its type.
template <class Message, class Handle>
void HandleIf(const std::string& came_on, Bytes bytes, const Channel<Message>& channel,
              Handle handle) {
  if (came_on != channel.name) return;
  Message message{};
  if (Decode(bytes, message)) handle(message);
}

/// How one process talks on a bus: it fills the headers of what it says, and of what it hears it
/// passes on only messages of its own run that are whole and newer than the last of the same
/// sender. The rest is counted, told in STATUS, and harmless.
class Endpoint {
 public:
  /// `run_id` 0 takes the run of the first message heard.
  Endpoint(Bus& bus, std::string process, std::int64_t run_id);
  Endpoint(const Endpoint&) = delete;
  Endpoint& operator=(const Endpoint&) = delete;

  template <class Message>
  void Publish(const Channel<Message>& channel, Message message, Time time) {
    FillHeader(channel.name, time, message.header);
    bus_.Publish(channel.name, Encode(message));
  }

  /// The same, of a state that counts its own epochs.
  template <class Message>
  void Publish(const Channel<Message>& channel, Message message, Time time, std::int64_t epoch) {
    FillHeader(channel.name, time, message.header);
    message.header.epoch = epoch;
    bus_.Publish(channel.name, Encode(message));
  }

  /// Sends a message of any size as chunks of version `version` of `item`.
  template <class Message>
  void PublishLarge(const Channel<chunk_t>& channel, std::int64_t item, std::int64_t version,
                    Message message, Time time) {
    message.header = {};
    message.header.utime_us = ToUtime(time);
    message.header.run_id = run_id_;
    message.header.epoch = bus_.epoch();
    message.header.sender = process_;
    PublishChunks(channel, item, version, Encode(message), time);
  }

  /// Calls `handler(now, message)` for each accepted message. @pre once a channel: a second handler
  /// would see every message as one that came twice.
  template <class Message, class Handler>
  void Subscribe(const Channel<Message>& channel, Handler handler) {
    if (!subscribed_.insert(channel.name).second)
      throw std::logic_error(std::string("subscribed twice to ") + channel.name);
    bus_.Subscribe(channel.name, [this, name = channel.name, handler](Time now, Bytes bytes) {
      Message message{};
      if (!Decode(bytes, message) || !IsPossible(message.header)) {
        ++counts_.malformed;
      } else if (Accept(name, message.header)) {
        handler(now, message);
        if (observer_) observer_(now, name, message.header, bytes);
      }
    });
  }

  bool IsSubscribedTo(const std::string& channel) const { return subscribed_.contains(channel); }

  /// Called after the handler with each accepted message as it came: for who passes on what is
  /// said.
  using Observer = std::function<void(Time now, const std::string& channel, const header_t& header,
                                      Bytes bytes)>;
  void Observe(Observer observer) { observer_ = std::move(observer); }

  /// To be called by a handler that finds impossible values in a message.
  void NoteMalformed() { ++counts_.malformed; }

  /// Tells STATUS once a second; `report` adds the node's own counters and returns its health.
  using Report = std::function<std::string(std::map<std::string, std::int64_t>&)>;
  void ReportStatus(Report report);
  /// The same at the time that `now` tells: for who makes the time that others follow.
  void ReportStatus(Report report, std::function<Time()> now);

  Bus& bus() { return bus_; }
  std::int64_t run_id() const { return run_id_; }
  std::int64_t epoch() const { return bus_.epoch(); }

  struct Counts {
    std::int64_t received = 0, malformed = 0, other_run = 0, stale = 0, missed = 0;
  };
  const Counts& counts() const { return counts_; }

 private:
  struct Heard {
    std::int64_t epoch, sequence;
    // Messages of a lower epoch, or that leap far, that came since, one after another.
    std::int64_t doubted_epoch = 0, doubted_sequence = 0;
    int doubted_in_a_row = 0;
  };

  static bool IsPossible(const header_t& header) {
    return IsUtime(header.utime_us) && header.sequence >= 0;
  }
  void FillHeader(const std::string& channel, Time time, header_t& header);
  static bool IsFresh(const header_t& header, Heard& heard);
  bool Accept(const std::string& channel, const header_t& header);
  void PublishChunks(const Channel<chunk_t>& channel, std::int64_t item, std::int64_t version,
                     const std::vector<std::uint8_t>& bytes, Time time);
  void PublishStatus(Time now, const Report& report);

  Bus& bus_;
  std::string process_;
  std::int64_t run_id_;
  std::set<std::string> subscribed_;
  Observer observer_;
  std::map<std::string, std::int64_t> next_sequence_;
  std::map<std::pair<std::string, std::string>, Heard> heard_;  // By channel and sender.
  Counts counts_;
};

/// Puts the chunks of large messages together again.
class ChunkAssembler {
 public:
  struct Whole {
    std::int64_t item, version;
    std::vector<std::uint8_t> bytes;
  };

  /// Returns the message that `chunk` completed. Chunks that contradict each other or fail the
  /// check sum are counted and dropped. At most a few items are under way at once; older ones are
  /// given up.
  std::optional<Whole> Add(const chunk_t& chunk);

  std::int64_t dropped() const { return dropped_; }

 private:
  struct Partial {
    std::int64_t epoch, version, crc32;
    std::vector<std::vector<std::uint8_t>> parts;
    int missing;
    std::int64_t order;
  };

  void LimitPartials();

  std::map<std::int64_t, Partial> partials_;  // By item.
  std::int64_t order_ = 0;
  std::int64_t dropped_ = 0;
};

}  // namespace vog
