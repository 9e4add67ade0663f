#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "lib/foxglove/proto_converter.h"

namespace vog {

/// What clients of Foxglove's protocol may subscribe to: a channel a topic and type, with its
/// newest messages. Of each key a channel keeps the newest message, for who comes late; of all
/// others the last ones, for who follows, up to a bound that does not depend on how many read or
/// how slowly. Who is slower than that misses what was replaced meanwhile and nothing else.
class FoxgloveFeed {
 public:
  static constexpr std::size_t kDefaultRecent_bytes = 8 << 20;

  struct Message {
    std::shared_ptr<const std::string> bytes;  ///< Log time (ns, 64 bits, little-endian), payload.
    std::string key;
    std::int64_t number = 0;  ///< Counted by the channel, from 1.
    bool is_recent = true;    ///< Kept also when another one has its key.
  };
  struct Channel {
    std::string description;                     ///< JSON, as "advertise" has it.
    std::map<std::int64_t, Message> messages;    ///< By revision.
    std::map<std::string, std::int64_t> newest;  ///< Revisions, by key.
    std::int64_t posted = 0;

    bool IsNewest(std::int64_t revision, const Message& message) const {
      return newest.at(message.key) == revision;
    }
  };
  using Channels = std::map<std::uint32_t, Channel>;  // By id.

  explicit FoxgloveFeed(std::size_t recent_bytes = kDefaultRecent_bytes)
      : max_recent_bytes_(recent_bytes) {}

  /// A message that voids its topic ends the channel; the topic goes on with another id.
  void Post(const ProtoMessage& message);

  const Channels& channels() const { return channels_; }
  /// Nothing is known of ids below; no channel has this one or a higher one.
  std::uint32_t next_id() const { return next_id_; }
  /// How many channels have ended.
  std::int64_t ended() const { return ended_; }
  /// Of the newest message of all.
  std::int64_t revision() const { return revision_; }
  /// When it was heard.
  std::uint64_t time_ns() const { return time_ns_; }

 private:
  std::uint32_t IdOf(const ProtoMessage& message);
  void End(const std::string& topic);
  void Forget(Channel& channel, std::int64_t revision);
  void LimitRecent();

  std::size_t max_recent_bytes_;
  Channels channels_;
  std::map<std::pair<std::string, std::string>, std::uint32_t> ids_;  // By topic and type.
  std::deque<std::pair<std::uint32_t, std::int64_t>> recent_;         // Channels and revisions.
  std::size_t recent_bytes_ = 0;
  std::uint32_t next_id_ = 1;
  std::int64_t revision_ = 0, ended_ = 0;
  std::uint64_t time_ns_ = 0;
};

}  // namespace vog
