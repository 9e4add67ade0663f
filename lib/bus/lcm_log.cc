#include "lib/bus/lcm_log.h"

#include <filesystem>

#include "lib/base/errors.h"

namespace vog {

LcmLogReader::LcmLogReader(const std::string& path) : file_(path, "r") {
  // LCM opens a folder as happily as a file.
  if (!file_.good() || !std::filesystem::is_regular_file(path))
    throw UsageError(path + ": no such log");
}

std::optional<LogEvent> LcmLogReader::Next() {
  const lcm::LogEvent* const event = file_.readNextEvent();
  if (event == nullptr) return std::nullopt;
  const auto* const data = static_cast<const std::uint8_t*>(event->data);
  return LogEvent{FromUtime(event->timestamp), event->channel, {data, data + event->datalen}};
}

LcmLogWriter::LcmLogWriter(const std::string& path) : path_(path), file_(path, "w") {
  if (!file_.good()) throw SystemError(path + ": cannot create the log");
}

void LcmLogWriter::Write(Time time, const std::string& channel, Bytes bytes) {
  lcm::LogEvent event{};
  event.timestamp = ToUtime(time);
  event.channel = channel;
  event.datalen = static_cast<std::int32_t>(bytes.size());
  event.data = const_cast<std::uint8_t*>(bytes.data());
  if (file_.writeEvent(&event) != 0) throw SystemError(path_ + ": cannot write; is the disk full?");
}

}  // namespace vog
