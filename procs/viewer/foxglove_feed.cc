#include "procs/viewer/foxglove_feed.h"

#include <bit>
#include <nlohmann/json.hpp>

#include "lib/base/base64.h"

namespace vog {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers go out as they lie in memory");

std::string DescriptionOf(std::uint32_t id, const ProtoMessage& message) {
  const std::string schema = ToBase64(message.schema->descriptor_set);
  return nlohmann::json({{"id", id},
                         {"topic", message.topic},
                         {"encoding", "protobuf"},
                         {"schemaName", message.schema->name},
                         {"schema", schema},
                         {"schemaEncoding", "protobuf"}})
      .dump();
}

std::shared_ptr<const std::string> BytesOf(const ProtoMessage& message) {
  std::string bytes(reinterpret_cast<const char*>(&message.log_ns), sizeof(message.log_ns));
  return std::make_shared<const std::string>(bytes + message.bytes);
}

}  // namespace

void FoxgloveFeed::Post(const ProtoMessage& message) {
  if (message.voids_earlier) End(message.topic);
  const std::uint32_t id = IdOf(message);
  Channel& channel = channels_.at(id);
  const auto [newest, is_first] = channel.newest.try_emplace(message.key, ++revision_);
  if (!is_first) {
    const std::int64_t replaced = std::exchange(newest->second, revision_);
    Forget(channel, replaced);
  }
  const Message& posted =
      channel.messages[revision_] = {BytesOf(message), message.key, ++channel.posted};
  recent_.emplace_back(id, revision_);
  recent_bytes_ += posted.bytes->size();
  time_ns_ = message.log_ns;
  LimitRecent();
}

std::uint32_t FoxgloveFeed::IdOf(const ProtoMessage& message) {
  const auto [found, is_new] = ids_.try_emplace({message.topic, message.schema->name}, next_id_);
  if (is_new) channels_[next_id_++].description = DescriptionOf(found->second, message);
  return found->second;
}

void FoxgloveFeed::End(const std::string& topic) {
  for (auto id = ids_.lower_bound({topic, ""}); id != ids_.end() && id->first.first == topic;) {
    for (const auto& [revision, message] : channels_.at(id->second).messages)
      if (message.is_recent) recent_bytes_ -= message.bytes->size();
    std::erase_if(recent_, [&](const auto& entry) { return entry.first == id->second; });
    channels_.erase(id->second);
    id = ids_.erase(id);
    ++ended_;
  }
}

/// Unless the message is still to be kept.
void FoxgloveFeed::Forget(Channel& channel, std::int64_t revision) {
  const auto message = channel.messages.find(revision);
  if (!message->second.is_recent && !channel.IsNewest(revision, message->second))
    channel.messages.erase(message);
}

void FoxgloveFeed::LimitRecent() {
  while (recent_bytes_ > max_recent_bytes_) {
    const auto [id, revision] = recent_.front();
    recent_.pop_front();
    Channel& channel = channels_.at(id);
    Message& oldest = channel.messages.at(revision);
    oldest.is_recent = false;
    recent_bytes_ -= oldest.bytes->size();
    Forget(channel, revision);
  }
}

}  // namespace vog
