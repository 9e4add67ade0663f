#include "tools/log/mcap_export.h"

#include <filesystem>

#include "lib/bus/lcm_log.h"
#include "lib/foxglove/proto_converter.h"
#include "tools/log/log_files.h"
#include "tools/log/mcap_topics.h"
#include "tools/log/mcap_writer.h"

namespace vog {
namespace {

/// Of an event in a log.
std::uintmax_t SizeOf(const LogEvent& event) {
  constexpr std::size_t kHead_bytes = 28;
  return kHead_bytes + event.channel.size() + event.bytes.size();
}

}  // namespace

McapExport ExportToMcap(const std::string& log, const std::string& out,
                        const std::function<void(double share)>& on_progress) {
  LcmLogReader reader(log);
  RefuseSame(log, out);
  const auto size_bytes = static_cast<double>(std::filesystem::file_size(log));
  McapWriter writer(out);
  McapTopics topics(writer);
  ProtoConverter converter([&topics](const ProtoMessage& message) { topics.Write(message); });
  McapExport done;
  std::uintmax_t read_bytes = 0;
  while (const auto event = reader.Next()) {
    if (!converter.Add(event->time, event->channel, event->bytes)) ++done.malformed;
    ++done.messages;
    read_bytes += SizeOf(*event);
    on_progress(static_cast<double>(read_bytes) / size_bytes);
  }
  writer.Finish();
  return done;
}

}  // namespace vog
