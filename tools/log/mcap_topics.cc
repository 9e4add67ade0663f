#include "tools/log/mcap_topics.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <algorithm>
#include <set>
#include <vector>

namespace vog {
namespace {

namespace pb = google::protobuf;

/// Adds to `types` a type and those of its fields.
void Collect(const pb::Descriptor& type, std::set<const pb::Descriptor*>& types) {
  if (!types.insert(&type).second) return;
  for (int i = 0; i < type.field_count(); ++i) {
    if (const pb::Descriptor* const field = type.field(i)->message_type()) Collect(*field, types);
  }
}

/// Appends to `files` a file after those that it needs.
void Collect(const pb::FileDescriptor& file, std::vector<const pb::FileDescriptor*>& files) {
  if (std::find(files.begin(), files.end(), &file) != files.end()) return;
  for (int i = 0; i < file.dependency_count(); ++i) Collect(*file.dependency(i), files);
  files.push_back(&file);
}

}  // namespace

void McapTopics::Write(const std::string& topic, const pb::Message& message,
                       const MessageTimes& times, std::uint32_t sequence) {
  const std::uint16_t channel_id = ChannelOf(topic, *message.GetDescriptor());
  writer_.Write(
      {channel_id, sequence, times.log_ns, times.publish_ns, message.SerializeAsString()});
}

std::uint16_t McapTopics::ChannelOf(const std::string& topic, const pb::Descriptor& type) {
  const std::pair key(topic, type.full_name());
  const auto found = channel_ids_.find(key);
  if (found != channel_ids_.end()) return found->second;
  return channel_ids_[key] = writer_.AddChannel(topic, SchemaOf(type));
}

std::uint16_t McapTopics::SchemaOf(const pb::Descriptor& type) {
  const auto found = schema_ids_.find(type.full_name());
  if (found != schema_ids_.end()) return found->second;
  return schema_ids_[type.full_name()] =
             writer_.AddSchema(type.full_name(), FileDescriptorSetOf(type));
}

std::string FileDescriptorSetOf(const pb::Descriptor& type) {
  std::set<const pb::Descriptor*> types;
  Collect(type, types);
  std::vector<const pb::FileDescriptor*> files;
  Collect(*type.file(), files);
  pb::FileDescriptorSet set;
  for (const pb::FileDescriptor* const file : files) {
    pb::FileDescriptorProto& copy = *set.add_file();
    file->CopyTo(&copy);
    copy.clear_message_type();
    for (int i = 0; i < file->message_type_count(); ++i) {
      if (types.contains(file->message_type(i)))
        file->message_type(i)->CopyTo(copy.add_message_type());
    }
  }
  return set.SerializeAsString();
}

}  // namespace vog
