#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "lib/base/files.h"

namespace vog {

/// A message on its way into an MCAP file.
struct McapMessage {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;      ///< When it was heard.
  std::uint64_t publish_time_ns = 0;  ///< When what it tells was true.
  std::string_view bytes;
};

/// Writes an MCAP file (mcap.dev/spec): chunks without compression, indexes, statistics, a summary
/// with its offsets, and all check sums. The same calls give the same bytes. Memory grows by an
/// index entry a chunk. All that writes throws SystemError; no file is left unless it was finished.
class McapWriter {
 public:
  explicit McapWriter(const std::filesystem::path& path,
                      std::size_t chunk_bytes = kDefaultChunk_bytes);

  /// A type of messages whose encoding is "protobuf"; `schema` is its FileDescriptorSet. Returns
  /// its number.
  std::uint16_t AddSchema(const std::string& name, std::string_view schema);
  /// Returns the number of the channel. @pre `schema_id` comes from AddSchema(). @throws UsageError
  /// for more channels than MCAP has numbers.
  std::uint16_t AddChannel(const std::string& topic, std::uint16_t schema_id);
  /// @pre `message.channel_id` comes from AddChannel().
  void Write(const McapMessage& message);
  /// Makes what was written a file. @pre called once, last.
  void Finish();

 private:
  static constexpr std::size_t kDefaultChunk_bytes = 1 << 20;

  struct IndexEntry {
    std::uint64_t log_time_ns, offset;
  };
  struct TimeSpan {
    void Add(std::uint64_t time_ns);
    std::uint64_t first_ns = 0, last_ns = 0;
    bool is_empty = true;
  };

  void Append(std::string_view bytes);
  void CloseChunk();
  std::string StatisticsRecord() const;
  void WriteSummary();

  AtomicFileWriter file_;
  std::size_t chunk_bytes_;
  std::uint64_t size_bytes_ = 0;  // Of the file up to now.
  unsigned long crc32_ = 0;       // Of the same.

  std::string chunk_;  // Records of the open chunk.
  TimeSpan chunk_times_;
  std::map<std::uint16_t, std::vector<IndexEntry>> chunk_index_;  // By channel.

  // All schema, channel and chunk index records: what the summary repeats.
  std::string schemas_, channels_, chunk_indexes_;
  std::uint16_t schema_count_ = 0;
  std::uint32_t chunk_count_ = 0;
  std::map<std::uint16_t, std::uint64_t> message_counts_;  // By channel, all of them.
  TimeSpan times_;
};

}  // namespace vog
