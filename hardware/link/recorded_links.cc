#include "hardware/link/recorded_links.h"

#include "hardware/frames/candump.h"
#include "lib/base/errors.h"

namespace vog {
namespace {

std::ifstream OpenRecording(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  // A folder opens, and its first byte does not.
  if (!file || (file.peek(), file.bad())) throw UsageError(path + ": cannot be read");
  file.clear();
  return file;
}

}  // namespace

FileLink::FileLink(const std::string& path) : file_(OpenRecording(path)) {}

ByteRead FileLink::Read(std::span<std::uint8_t> into) {
  file_.read(reinterpret_cast<char*>(into.data()), static_cast<std::streamsize>(into.size()));
  const auto size = file_.gcount();
  if (size == 0) return {ReadOutcome::kClosed};
  counters_.bytes_in += size;
  return {ReadOutcome::kData, static_cast<std::size_t>(size)};
}

CandumpLink::CandumpLink(const std::string& path) : file_(OpenRecording(path)) {}

CanRead CandumpLink::Read() {
  for (std::string line; std::getline(file_, line);) {
    if (const auto parsed = ParseCandumpLine(line)) {
      counters_.bytes_in += parsed->frame.size;
      return {ReadOutcome::kData, parsed->frame};
    }
    ++counters_.errors;
  }
  return {ReadOutcome::kClosed};
}

}  // namespace vog
