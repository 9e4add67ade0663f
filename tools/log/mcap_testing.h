#pragma once

#include <cstdint>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "lib/base/files.h"

namespace vog {

/// Takes MCAP's numbers and strings off the front of bytes. @throws std::out_of_range at their end.
class McapCursor {
 public:
  explicit McapCursor(std::string_view bytes) : bytes_(bytes) {}

  template <class Number>
  Number Take() {
    Number number;
    std::memcpy(&number, TakeRaw(sizeof(Number)).data(), sizeof(Number));
    return number;
  }
  std::string TakeString() { return std::string(TakeRaw(Take<std::uint32_t>())); }
  std::string_view TakeRaw(std::size_t size) {
    if (size > bytes_.size()) throw std::out_of_range("MCAP: cut short");
    const std::string_view taken = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return taken;
  }
  std::string_view rest() const { return bytes_; }
  bool AtEnd() const { return bytes_.empty(); }

 private:
  std::string_view bytes_;
};

struct McapRecord {
  std::uint8_t opcode;
  std::uint64_t start;  ///< Of the whole record, from the start of the bytes it was found in.
  std::string content;

  std::uint64_t end() const { return start + 9 + content.size(); }
};

/// The records that `bytes` consist of; the first one starts at `start`.
inline std::vector<McapRecord> RecordsIn(std::string_view bytes, std::uint64_t start = 0) {
  std::vector<McapRecord> records;
  for (McapCursor cursor(bytes); !cursor.AtEnd(); start = records.back().end()) {
    const auto opcode = cursor.Take<std::uint8_t>();
    const auto size = cursor.Take<std::uint64_t>();
    records.push_back({opcode, start, std::string(cursor.TakeRaw(size))});
  }
  return records;
}

/// Those of one kind.
inline std::vector<McapRecord> RecordsOf(const std::vector<McapRecord>& records,
                                         std::uint8_t opcode) {
  std::vector<McapRecord> found;
  for (const McapRecord& record : records) {
    if (record.opcode == opcode) found.push_back(record);
  }
  return found;
}

inline constexpr std::string_view kMcapMagic("\x89MCAP0\r\n", 8);

/// What a chunk record holds.
inline std::string RecordsOfChunk(const McapRecord& chunk) {
  McapCursor cursor(chunk.content);
  cursor.TakeRaw(28);  // Times, size, check sum.
  cursor.TakeString();
  return std::string(cursor.TakeRaw(cursor.Take<std::uint64_t>()));
}

/// The content of an MCAP file, read from its start.
struct McapContent {
  struct Schema {
    std::string name, encoding, data;
  };
  struct Channel {
    std::uint16_t schema_id;
    std::string topic, encoding;
  };
  struct Message {
    std::uint16_t channel_id;
    std::uint32_t sequence;
    std::uint64_t log_time_ns, publish_time_ns;
    std::string bytes;
  };
  std::map<std::uint16_t, Schema> schemas;
  std::map<std::uint16_t, Channel> channels;
  std::vector<Message> messages;

  explicit McapContent(const std::string& path) {
    const std::string bytes = ReadFile(path);
    const auto middle = std::string_view(bytes).substr(8, bytes.size() - 16);
    for (const McapRecord& chunk : RecordsOf(RecordsIn(middle), 0x06)) {
      for (const McapRecord& record : RecordsIn(RecordsOfChunk(chunk))) Add(record);
    }
  }

  std::vector<Message> On(const std::string& topic) const {
    std::vector<Message> found;
    for (const Message& message : messages) {
      if (channels.at(message.channel_id).topic == topic) found.push_back(message);
    }
    return found;
  }

 private:
  void Add(const McapRecord& record) {
    McapCursor cursor(record.content);
    const auto id = cursor.Take<std::uint16_t>();
    if (record.opcode == 0x03) {
      Schema& schema = schemas[id];
      schema.name = cursor.TakeString();
      schema.encoding = cursor.TakeString();
      schema.data = cursor.TakeString();
    } else if (record.opcode == 0x04) {
      Channel& channel = channels[id];
      channel.schema_id = cursor.Take<std::uint16_t>();
      channel.topic = cursor.TakeString();
      channel.encoding = cursor.TakeString();
    } else if (record.opcode == 0x05) {
      Message& message = messages.emplace_back();
      message.channel_id = id;
      message.sequence = cursor.Take<std::uint32_t>();
      message.log_time_ns = cursor.Take<std::uint64_t>();
      message.publish_time_ns = cursor.Take<std::uint64_t>();
      message.bytes = cursor.rest();
    }
  }
};

}  // namespace vog
