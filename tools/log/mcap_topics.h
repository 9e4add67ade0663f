#pragma once

#include <google/protobuf/message.h>

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "tools/log/mcap_writer.h"

namespace vog {

/// Of a message in an MCAP file [ns].
struct MessageTimes {
  std::uint64_t log_ns = 0, publish_ns = 0;
};

/// Writes Protobuf messages to an MCAP file by topic; schemas and channels come with the first
/// message that needs them.
class McapTopics {
 public:
  explicit McapTopics(McapWriter& writer) : writer_(writer) {}

  /// A topic with messages of several types has a channel for each.
  void Write(const std::string& topic, const google::protobuf::Message& message,
             const MessageTimes& times, std::uint32_t sequence);

 private:
  std::uint16_t ChannelOf(const std::string& topic, const google::protobuf::Descriptor& type);
  std::uint16_t SchemaOf(const google::protobuf::Descriptor& type);

  McapWriter& writer_;
  std::map<std::pair<std::string, std::string>, std::uint16_t> channel_ids_;  // By topic and type.
  std::map<std::string, std::uint16_t> schema_ids_;  // By the type's full name.
};

/// A FileDescriptorSet with a type and all types that it needs, and no others; files come after
/// those that they need.
std::string FileDescriptorSetOf(const google::protobuf::Descriptor& type);

}  // namespace vog
