#pragma once

#include <google/protobuf/message.h>

#include <string>

namespace vog {

/// A type of Protobuf messages, as MCAP files and Foxglove's protocol tell it.
struct ProtoSchema {
  std::string name;  ///< With its package.
  /// A FileDescriptorSet with the type and all types that it needs, and no others; files come after
  /// those that they need.
  std::string descriptor_set;
};

ProtoSchema SchemaOf(const google::protobuf::Descriptor& type);

}  // namespace vog
