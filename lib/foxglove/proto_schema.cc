#include "lib/foxglove/proto_schema.h"

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

ProtoSchema SchemaOf(const pb::Descriptor& type) {
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
  return {type.full_name(), set.SerializeAsString()};
}

}  // namespace vog
