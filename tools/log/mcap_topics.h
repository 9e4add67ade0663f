#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "lib/foxglove/proto_converter.h"
#include "tools/log/mcap_writer.h"

namespace vog {

/// Writes Protobuf messages to an MCAP file by topic; schemas and channels come with the first
/// message that needs them.
class McapTopics {
 public:
  explicit McapTopics(McapWriter& writer) : writer_(writer) {}

  /// A topic with messages of several types has a channel for each.
  void Write(const ProtoMessage& message);

 private:
  std::uint16_t ChannelOf(const ProtoMessage& message);
  std::uint16_t NumberOf(const ProtoSchema& schema);

  McapWriter& writer_;
  std::map<std::pair<std::string, std::string>, std::uint16_t> channel_ids_;  // By topic and type.
  std::map<std::string, std::uint16_t> schema_ids_;  // By the type's full name.
};

}  // namespace vog
