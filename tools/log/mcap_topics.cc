#include "tools/log/mcap_topics.h"

namespace vog {

void McapTopics::Write(const ProtoMessage& message) {
  writer_.Write(
      {ChannelOf(message), message.sequence, message.log_ns, message.publish_ns, message.bytes});
}

std::uint16_t McapTopics::ChannelOf(const ProtoMessage& message) {
  const std::pair key(message.topic, message.schema->name);
  const auto found = channel_ids_.find(key);
  if (found != channel_ids_.end()) return found->second;
  return channel_ids_[key] = writer_.AddChannel(message.topic, NumberOf(*message.schema));
}

std::uint16_t McapTopics::NumberOf(const ProtoSchema& schema) {
  const auto found = schema_ids_.find(schema.name);
  if (found != schema_ids_.end()) return found->second;
  return schema_ids_[schema.name] = writer_.AddSchema(schema.name, schema.descriptor_set);
}

}  // namespace vog
