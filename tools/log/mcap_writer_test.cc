#include "tools/log/mcap_writer.h"

#include "lib/base/errors.h"
#include "tools/log/log_testing.h"
#include "tools/log/mcap_testing.h"

namespace vog {
namespace {

/// Files of two topics, five messages and chunks of two messages or three.
class McapWriterTest : public LogTest {
 protected:
  McapWriterTest() {
    WriteExample(PathOf("a.mcap"));
    bytes_ = ReadFile(PathOf("a.mcap"));
    records_ = RecordsIn(std::string_view(bytes_).substr(8, bytes_.size() - 16), 8);
  }

  static void WriteExample(const std::string& path) {
    McapWriter writer(path, 200);
    const std::uint16_t x = writer.AddChannel("x", writer.AddSchema("test.X", "schema of X"));
    writer.Write({x, 7, 1000, 900, "first"});
    const std::uint16_t schema = writer.AddSchema("test.Y", "schema of Y");
    const std::uint16_t y = writer.AddChannel("y", schema);
    writer.Write({y, 8, 3000, 2900, "second"});
    writer.Write({x, 9, 2000, 1900, std::string_view("th\0rd", 5)});
    writer.Write({x, 10, 4000, 3900, ""});
    writer.Write({x, 11, 5000, 4900, std::string(500, 'l')});
    writer.Finish();
  }

  std::vector<McapRecord> Of(std::uint8_t opcode) const { return RecordsOf(records_, opcode); }
  const McapRecord& StartingAt(std::uint64_t start) const {
    for (const McapRecord& record : records_) {
      if (record.start == start) return record;
    }
    throw std::out_of_range("no record starts there");
  }

  std::string bytes_;
  std::vector<McapRecord> records_;
};

TEST_F(McapWriterTest, RecordsStandInTheirOrder) {
  EXPECT_TRUE(bytes_.starts_with(kMcapMagic));
  EXPECT_TRUE(bytes_.ends_with(kMcapMagic));
  std::string order;
  for (const McapRecord& record : records_) order += "0123456789ABCDEF"[record.opcode];
  EXPECT_EQ(order,
            "1"
            "677"
            "67"
            "F"
            "33"
            "44"
            "B"
            "88"
            "EEEE"
            "2");
  McapCursor header(records_.front().content);
  EXPECT_EQ(header.TakeString(), "") << "no profile";
  EXPECT_EQ(header.TakeString(), "vogmap " VOG_VERSION);
}

TEST_F(McapWriterTest, WhatIsWrittenIsRead) {
  const McapContent content(PathOf("a.mcap"));
  ASSERT_EQ(content.schemas.size(), 2u);
  EXPECT_EQ(content.schemas.at(1).name, "test.X");
  EXPECT_EQ(content.schemas.at(2).data, "schema of Y");
  EXPECT_EQ(content.schemas.at(2).encoding, "protobuf");
  ASSERT_EQ(content.channels.size(), 2u);
  EXPECT_EQ(content.channels.at(1).topic, "y");
  EXPECT_EQ(content.channels.at(1).schema_id, 2);
  EXPECT_EQ(content.channels.at(1).encoding, "protobuf");
  ASSERT_EQ(content.messages.size(), 5u);
  EXPECT_EQ(content.messages[2].bytes, std::string("th\0rd", 5));
  EXPECT_EQ(content.messages[2].sequence, 9u);
  EXPECT_EQ(content.messages[2].log_time_ns, 2000u);
  EXPECT_EQ(content.messages[2].publish_time_ns, 1900u);
  EXPECT_EQ(content.messages[4].bytes, std::string(500, 'l'));
}

TEST_F(McapWriterTest, IndexesLeadToEveryMessage) {
  std::size_t found = 0;
  for (const McapRecord& chunk_index : Of(0x08)) {
    McapCursor cursor(chunk_index.content);
    const auto first_ns = cursor.Take<std::uint64_t>(), last_ns = cursor.Take<std::uint64_t>();
    const McapRecord& chunk = StartingAt(cursor.Take<std::uint64_t>());
    EXPECT_EQ(chunk.opcode, 0x06);
    EXPECT_EQ(chunk.end() - chunk.start, cursor.Take<std::uint64_t>());
    const std::string places = cursor.TakeString();
    const auto indexes_size = cursor.Take<std::uint64_t>();
    EXPECT_EQ(cursor.TakeString(), "");
    const std::string records = RecordsOfChunk(chunk);
    EXPECT_EQ(cursor.Take<std::uint64_t>(), records.size());
    EXPECT_EQ(cursor.Take<std::uint64_t>(), records.size());
    EXPECT_TRUE(cursor.AtEnd());

    std::uint64_t indexes_end = chunk.end();
    for (McapCursor place(places); !place.AtEnd();) {
      const auto channel_id = place.Take<std::uint16_t>();
      const McapRecord& message_index = StartingAt(place.Take<std::uint64_t>());
      EXPECT_EQ(message_index.opcode, 0x07);
      EXPECT_EQ(message_index.start, indexes_end);
      indexes_end = message_index.end();
      McapCursor index(message_index.content);
      EXPECT_EQ(index.Take<std::uint16_t>(), channel_id);
      const std::string entries = index.TakeString();
      for (McapCursor entry(entries); !entry.AtEnd(); ++found) {
        const auto time_ns = entry.Take<std::uint64_t>();
        const auto at = entry.Take<std::uint64_t>();
        EXPECT_GE(time_ns, first_ns);
        EXPECT_LE(time_ns, last_ns);
        McapCursor message(std::string_view(records).substr(at));
        EXPECT_EQ(message.Take<std::uint8_t>(), 0x05);
        message.Take<std::uint64_t>();
        EXPECT_EQ(message.Take<std::uint16_t>(), channel_id);
        message.Take<std::uint32_t>();
        EXPECT_EQ(message.Take<std::uint64_t>(), time_ns);
      }
    }
    EXPECT_EQ(indexes_end - chunk.end(), indexes_size);
  }
  EXPECT_EQ(found, 5u);
}

TEST_F(McapWriterTest, ChunksKnowTheirTimesAndCheckSums) {
  const std::vector<McapRecord> chunks = Of(0x06);
  ASSERT_EQ(chunks.size(), 2u);
  McapCursor first(chunks[0].content), second(chunks[1].content);
  EXPECT_EQ(first.Take<std::uint64_t>(), 1000u);
  EXPECT_EQ(first.Take<std::uint64_t>(), 3000u) << "messages need not be in the order of time";
  EXPECT_EQ(second.Take<std::uint64_t>(), 2000u);
  EXPECT_EQ(second.Take<std::uint64_t>(), 5000u);
  EXPECT_EQ(first.Take<std::uint64_t>(), RecordsOfChunk(chunks[0]).size());
  EXPECT_EQ(first.Take<std::uint32_t>(), Crc32(RecordsOfChunk(chunks[0])));
}

TEST_F(McapWriterTest, StatisticsCount) {
  const McapRecord statistics = Of(0x0B).at(0);
  McapCursor cursor(statistics.content);
  EXPECT_EQ(cursor.Take<std::uint64_t>(), 5u);
  EXPECT_EQ(cursor.Take<std::uint16_t>(), 2u);
  EXPECT_EQ(cursor.Take<std::uint32_t>(), 2u);
  EXPECT_EQ(cursor.Take<std::uint64_t>(), 0u) << "no attachments, no metadata";
  EXPECT_EQ(cursor.Take<std::uint32_t>(), 2u);
  EXPECT_EQ(cursor.Take<std::uint64_t>(), 1000u);
  EXPECT_EQ(cursor.Take<std::uint64_t>(), 5000u);
  const std::string counts = cursor.TakeString();
  McapCursor count(counts);
  EXPECT_EQ(count.Take<std::uint16_t>(), 0u);
  EXPECT_EQ(count.Take<std::uint64_t>(), 4u);
  EXPECT_EQ(count.Take<std::uint16_t>(), 1u);
  EXPECT_EQ(count.Take<std::uint64_t>(), 1u);
  EXPECT_TRUE(count.AtEnd() && cursor.AtEnd());
}

TEST_F(McapWriterTest, TheFooterLeadsToTheSummaryAndItsOffsetsToTheGroups) {
  McapCursor footer(records_.back().content);
  const auto summary_start = footer.Take<std::uint64_t>();
  const auto offsets_start = footer.Take<std::uint64_t>();
  EXPECT_EQ(summary_start, Of(0x0F).at(0).end());
  EXPECT_EQ(offsets_start, Of(0x0E).at(0).start);
  std::uint64_t end = summary_start;
  for (const McapRecord& offset : Of(0x0E)) {
    McapCursor cursor(offset.content);
    const auto opcode = cursor.Take<std::uint8_t>();
    EXPECT_EQ(cursor.Take<std::uint64_t>(), end);
    end += cursor.Take<std::uint64_t>();
    EXPECT_EQ(Of(opcode).back().end(), end);
  }
  EXPECT_EQ(end, offsets_start);
}

TEST_F(McapWriterTest, CheckSumsGuardDataAndSummary) {
  const std::string_view bytes(bytes_);
  const McapRecord data_end = Of(0x0F).at(0);
  EXPECT_EQ(McapCursor(data_end.content).Take<std::uint32_t>(),
            Crc32(bytes.substr(0, data_end.start)));
  const std::uint64_t summary_end = records_.back().end() - 4;
  McapCursor footer(records_.back().content);
  footer.TakeRaw(16);
  EXPECT_EQ(footer.Take<std::uint32_t>(),
            Crc32(bytes.substr(data_end.end(), summary_end - data_end.end())));
}

TEST_F(McapWriterTest, EqualCallsGiveEqualBytes) {
  WriteExample(PathOf("b.mcap"));
  EXPECT_EQ(ReadFile(PathOf("b.mcap")), bytes_);
}

TEST_F(McapWriterTest, AFileMayBeEmpty) {
  McapWriter(PathOf("empty.mcap")).Finish();
  const std::string bytes = ReadFile(PathOf("empty.mcap"));
  std::string order;
  for (const McapRecord& record : RecordsIn(std::string_view(bytes).substr(8, bytes.size() - 16)))
    order += "0123456789ABCDEF"[record.opcode];
  EXPECT_EQ(order, "1FBE2");
}

TEST_F(McapWriterTest, ChannelsHaveNumbersOfSixteenBits) {
  McapWriter writer(PathOf("many.mcap"));
  const std::uint16_t schema = writer.AddSchema("test.X", "");
  for (int i = 0; i < 65536; ++i) writer.AddChannel("x", schema);
  EXPECT_THROW(writer.AddChannel("x", schema), UsageError);
}

TEST_F(McapWriterTest, NothingIsLeftOfWhatWasNotFinished) {
  McapWriter(PathOf("half.mcap")).AddSchema("test.X", "");
  EXPECT_THROW(McapWriter(PathOf("nosuch/x.mcap")), SystemError);
  for (const auto& entry : std::filesystem::directory_iterator(folder_))
    EXPECT_EQ(entry.path().filename(), "a.mcap");
}

}  // namespace
}  // namespace vog
