#include "tools/log/mcap_writer.h"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "lib/base/errors.h"

namespace vog {
namespace {

static_assert(std::endian::native == std::endian::little, "MCAP's numbers are little-endian");

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);

enum Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

/// The content of a record.
class Content {
 public:
  template <class Number>
  Content& Put(Number number) {
    char bytes[sizeof(Number)];
    std::memcpy(bytes, &number, sizeof(Number));
    return PutRaw({bytes, sizeof(Number)});
  }
  /// With a length of 32 bits, as strings, maps and arrays have it.
  Content& PutString(std::string_view text) {
    return Put(static_cast<std::uint32_t>(text.size())).PutRaw(text);
  }
  Content& PutRaw(std::string_view bytes) {
    bytes_.append(bytes);
    return *this;
  }

  const std::string& bytes() const { return bytes_; }
  /// The whole record.
  std::string As(Opcode opcode) const {
    return Content().Put(opcode).Put<std::uint64_t>(bytes_.size()).PutRaw(bytes_).bytes();
  }

 private:
  std::string bytes_;
};

/// Records of one kind in the summary.
struct Group {
  Opcode opcode;
  std::string_view records;
};

/// Goes on from the check sum of what came before.
unsigned long AddToCrc32(unsigned long crc32, std::string_view bytes) {
  return ::crc32_z(crc32, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
}

}  // namespace

void McapWriter::TimeSpan::Add(std::uint64_t time_ns) {
  first_ns = is_empty ? time_ns : std::min(first_ns, time_ns);
  last_ns = std::max(last_ns, time_ns);
  is_empty = false;
}

McapWriter::McapWriter(const std::filesystem::path& path, std::size_t chunk_bytes)
    : file_(path), chunk_bytes_(chunk_bytes) {
  Append(kMagic);
  Append(Content().PutString("").PutString("vogmap " VOG_VERSION).As(kHeader));
}

std::uint16_t McapWriter::AddSchema(const std::string& name, std::string_view schema) {
  const std::uint16_t id = ++schema_count_;  // 0 means none.
  const std::string record =
      Content().Put(id).PutString(name).PutString("protobuf").PutString(schema).As(kSchema);
  chunk_ += record;
  schemas_ += record;
  return id;
}

std::uint16_t McapWriter::AddChannel(const std::string& topic, std::uint16_t schema_id) {
  constexpr std::size_t kMostChannels = 1 << 16;
  if (message_counts_.size() == kMostChannels)
    throw UsageError("more channels than an MCAP file can have, " + std::to_string(kMostChannels));
  const auto id = static_cast<std::uint16_t>(message_counts_.size());
  const std::string record = Content()
                                 .Put(id)
                                 .Put(schema_id)
                                 .PutString(topic)
                                 .PutString("protobuf")
                                 .PutString("")  // No metadata.
                                 .As(kChannel);
  chunk_ += record;
  channels_ += record;
  message_counts_[id] = 0;
  return id;
}

void McapWriter::Write(const McapMessage& message) {
  chunk_index_[message.channel_id].push_back({message.log_time_ns, chunk_.size()});
  chunk_ += Content()
                .Put(message.channel_id)
                .Put(message.sequence)
                .Put(message.log_time_ns)
                .Put(message.publish_time_ns)
                .PutRaw(message.bytes)
                .As(kMessage);
  chunk_times_.Add(message.log_time_ns);
  times_.Add(message.log_time_ns);
  ++message_counts_[message.channel_id];
  if (chunk_.size() >= chunk_bytes_) CloseChunk();
}

void McapWriter::Finish() {
  CloseChunk();
  Append(Content().Put(static_cast<std::uint32_t>(crc32_)).As(kDataEnd));
  WriteSummary();
  Append(kMagic);
  file_.Commit();
}

void McapWriter::Append(std::string_view bytes) {
  file_.Write(bytes);
  crc32_ = AddToCrc32(crc32_, bytes);
  size_bytes_ += bytes.size();
}

void McapWriter::CloseChunk() {
  if (chunk_.empty()) return;
  const std::uint64_t chunk_start = size_bytes_;
  const std::uint64_t size = chunk_.size();
  Append(Content()
             .Put(chunk_times_.first_ns)
             .Put(chunk_times_.last_ns)
             .Put(size)
             .Put(Crc32(chunk_))
             .PutString("")  // No compression.
             .Put(size)
             .PutRaw(chunk_)
             .As(kChunk));
  const std::uint64_t indexes_start = size_bytes_;
  Content index_places;
  for (const auto& [channel_id, entries] : chunk_index_) {
    index_places.Put(channel_id).Put(size_bytes_);
    Content index;
    for (const IndexEntry& entry : entries) index.Put(entry.log_time_ns).Put(entry.offset);
    Append(Content().Put(channel_id).PutString(index.bytes()).As(kMessageIndex));
  }
  chunk_indexes_ += Content()
                        .Put(chunk_times_.first_ns)
                        .Put(chunk_times_.last_ns)
                        .Put(chunk_start)
                        .Put(indexes_start - chunk_start)
                        .PutString(index_places.bytes())
                        .Put(size_bytes_ - indexes_start)
                        .PutString("")
                        .Put(size)
                        .Put(size)
                        .As(kChunkIndex);
  ++chunk_count_;
  chunk_.clear();
  chunk_times_ = {};
  chunk_index_.clear();
}

std::string McapWriter::StatisticsRecord() const {
  std::uint64_t messages = 0;
  Content counts;
  for (const auto& [channel_id, count] : message_counts_) {
    counts.Put(channel_id).Put(count);
    messages += count;
  }
  constexpr std::uint32_t kNoAttachments = 0, kNoMetadata = 0;
  return Content()
      .Put(messages)
      .Put(schema_count_)
      .Put(static_cast<std::uint32_t>(message_counts_.size()))
      .Put(kNoAttachments)
      .Put(kNoMetadata)
      .Put(chunk_count_)
      .Put(times_.first_ns)
      .Put(times_.last_ns)
      .PutString(counts.bytes())
      .As(kStatistics);
}

void McapWriter::WriteSummary() {
  const std::uint64_t summary_start = size_bytes_;
  crc32_ = 0;  // That of the summary from here on.
  std::string offsets;
  const std::string statistics = StatisticsRecord();
  for (const auto& [opcode, records] :
       {Group{kSchema, schemas_}, Group{kChannel, channels_}, Group{kStatistics, statistics},
        Group{kChunkIndex, chunk_indexes_}}) {
    if (records.empty()) continue;
    offsets += Content()
                   .Put(opcode)
                   .Put(size_bytes_)
                   .Put<std::uint64_t>(records.size())
                   .As(kSummaryOffset);
    Append(records);
  }
  const std::uint64_t offsets_start = size_bytes_;
  Append(offsets);
  constexpr std::uint64_t kFooter_bytes = 20;
  Append(Content().Put(kFooter).Put(kFooter_bytes).Put(summary_start).Put(offsets_start).bytes());
  Append(Content().Put(static_cast<std::uint32_t>(crc32_)).bytes());
}

}  // namespace vog
