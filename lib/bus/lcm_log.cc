#include "lib/bus/lcm_log.h"

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <utility>

#include "lib/base/errors.h"

namespace vog {
namespace {

/// Every event of a log starts with LCM's magic number.
bool StartsAsLog(const std::string& path) {
  constexpr std::array<unsigned char, 4> kMagic = {0xED, 0xA1, 0xDA, 0x01};
  std::array<unsigned char, 4> start = kMagic;
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(start.data()), start.size());
  return start == kMagic;
}

}  // namespace

LcmLogReader::LcmLogReader(const std::string& path) : file_(path, "r") {
  // LCM opens a folder as happily as a file.
  if (!file_.good() || !std::filesystem::is_regular_file(path))
    throw UsageError(path + ": no such log");
  if (!StartsAsLog(path)) throw UsageError(path + ": not an LCM event log");
}

std::optional<LogEvent> LcmLogReader::Next() {
  return next_ ? std::exchange(next_, std::nullopt) : Read();
}

void LcmLogReader::SeekTo(Time time) {
  constexpr off_t kBlock_bytes = 65536;
  std::FILE* const file = file_.getFilePtr();
  ::fseeko(file, 0, SEEK_END);
  off_t before = 0, after = ::ftello(file);
  // LCM finds the start of an event from anywhere in the file.
  while (after - before > kBlock_bytes) {
    const off_t middle = before + (after - before) / 2;
    ::fseeko(file, middle, SEEK_SET);
    const auto event = Read();
    (event && event->time < time ? before : after) = middle;
  }
  ::fseeko(file, before, SEEK_SET);
  do {
    next_ = Read();
  } while (next_ && next_->time < time);
}

std::optional<LogEvent> LcmLogReader::Read() {
  const lcm::LogEvent* event = file_.readNextEvent();
  // Nothing may also be a damaged event. LCM has gone past it and looks for the next one's start.
  while (event == nullptr && !std::feof(file_.getFilePtr()) && !std::ferror(file_.getFilePtr()))
    event = file_.readNextEvent();
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
  if (file_.writeEvent(&event) != 0) FailToWrite();
}

void LcmLogWriter::Flush() {
  if (std::fflush(file_.getFilePtr()) != 0) FailToWrite();
}

std::uintmax_t LcmLogWriter::size_bytes() {
  return static_cast<std::uintmax_t>(::ftello(file_.getFilePtr()));
}

void LcmLogWriter::FailToWrite() const {
  throw SystemError(path_ + ": cannot write; is the disk full?");
}

}  // namespace vog
