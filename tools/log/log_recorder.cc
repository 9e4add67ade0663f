#include "tools/log/log_recorder.h"

#include <array>
#include <cstdio>
#include <map>
#include <utility>

#include "lib/base/errors.h"
#include "lib/base/log.h"

namespace vog {
namespace {

// Of room on the disk: less is not worth a file.
constexpr std::uintmax_t kLeastRoom_bytes = 1'000'000;

std::filesystem::path FolderOf(const std::filesystem::path& file) {
  return file.has_parent_path() ? file.parent_path() : ".";
}

}  // namespace

LogRecorder::LogRecorder(RecorderOptions options) : options_(std::move(options)) {
  if (!IsRotating() && std::filesystem::exists(options_.file))
    throw UsageError(options_.file.string() + ": is there already; --max-mb adds files to others");
  FindFiles();
  Open();
}

LogRecorder::~LogRecorder() {
  if (writer_) Flush();
}

void LogRecorder::FindFiles() {
  const std::string start = options_.file.filename().string() + ".";
  std::map<int, std::filesystem::path> found;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(FolderOf(options_.file), error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(start)) continue;
    const std::string digits = name.substr(start.size());
    const bool is_number = digits.find_first_not_of("0123456789") == std::string::npos;
    if (is_number && digits.size() >= 3 && digits.size() <= 9)
      found[std::stoi(digits)] = entry.path();
  }
  if (!found.empty()) next_number_ = found.rbegin()->first + 1;
  if (!IsRotating()) return;
  for (const auto& [number, path] : found) files_.push_back(path);
}

std::filesystem::path LogRecorder::NextPath() const {
  if (!IsRotating() && files_.empty()) return options_.file;
  std::array<char, 16> suffix{};
  std::snprintf(suffix.data(), suffix.size(), ".%03d", next_number_);
  return options_.file.string() + suffix.data();
}

void LogRecorder::Open() {
  const std::filesystem::path path = NextPath();
  writer_.emplace(path.string());
  if (path != options_.file) ++next_number_;
  files_.push_back(path);
  flushed_bytes_ = 0;
  while (options_.keep > 0 && files_.size() > static_cast<std::size_t>(options_.keep))
    RemoveOldest();
}

void LogRecorder::RemoveOldest() {
  std::error_code error;
  std::filesystem::remove(files_.front(), error);
  files_.pop_front();
}

void LogRecorder::Write(Time time, const std::string& channel, Bytes bytes) {
  if (!writer_) {
    ++lost_;
    return;
  }
  try {
    ++unflushed_;
    ++written_;
    writer_->Write(time, channel, bytes);
    if (!IsRotating() || writer_->size_bytes() < options_.max_bytes) return;
    Flush();
    if (writer_) Open();
  } catch (const SystemError& error) {
    OnFull(error.what());
  }
}

void LogRecorder::Tick() {
  if (writer_) {
    Flush();
  } else {
    TryAgain();
  }
}

void LogRecorder::Flush() {
  try {
    writer_->Flush();
    flushed_bytes_ = writer_->size_bytes();
    unflushed_ = 0;
  } catch (const SystemError& error) {
    OnFull(error.what());
  }
}

void LogRecorder::OnFull(const std::string& why) {
  writer_.reset();
  lost_ += unflushed_;
  written_ -= std::exchange(unflushed_, 0);
  std::error_code error;  // Whole messages only:
  std::filesystem::resize_file(files_.back(), flushed_bytes_, error);
  LogLine(why + " Messages are left out until there is room");
}

bool LogRecorder::HasRoom() const {
  std::error_code error;
  const auto space = std::filesystem::space(FolderOf(options_.file), error);
  return !error && space.available >= kLeastRoom_bytes;
}

void LogRecorder::TryAgain() {
  if (!HasRoom() && options_.keep > 0 && files_.size() > 1) {
    LogLine(files_.front().string() + " is removed to make room");
    RemoveOldest();
  }
  if (!HasRoom()) return;
  try {
    Open();
    LogLine("recording goes on in " + files_.back().string() + "; " + std::to_string(lost_) +
            " messages were left out so far");
  } catch (const SystemError&) {  // Next time.
  }
}

}  // namespace vog
