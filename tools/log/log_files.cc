#include "tools/log/log_files.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>

#include "lib/base/errors.h"
#include "lib/bus/lcm_log.h"

namespace vog {
namespace {

/// A log and its next message.
struct Source {
  explicit Source(const std::string& path) : reader(path), next(reader.Next()) {}

  LcmLogReader reader;
  std::optional<LogEvent> next;
};

bool IsEarlier(const std::unique_ptr<Source>& a, const std::unique_ptr<Source>& b) {
  if (!a->next || !b->next) return a->next.has_value();
  return a->next->time < b->next->time;
}

}  // namespace

void RefuseSame(const std::string& in, const std::string& out) {
  std::error_code error;
  if (std::filesystem::equivalent(in, out, error))
    throw UsageError(out + ": is read; choose another name for the new file");
}

std::int64_t CutLog(const std::string& in, const LogSelection& selection, const std::string& out) {
  RefuseSame(in, out);
  SelectedLog log(in, selection);
  LcmLogWriter writer(out);
  std::int64_t kept = 0;
  for (; const auto found = log.Next(); ++kept)
    writer.Write(found->event.time, found->event.channel, found->event.bytes);
  writer.Flush();
  return kept;
}

std::int64_t MergeLogs(const std::vector<std::string>& in, const std::string& out) {
  std::vector<std::unique_ptr<Source>> sources;
  for (const std::string& path : in) {
    RefuseSame(path, out);
    sources.push_back(std::make_unique<Source>(path));
  }
  LcmLogWriter writer(out);
  std::int64_t written = 0;
  for (;; ++written) {
    Source& source = **std::min_element(sources.begin(), sources.end(), IsEarlier);
    if (!source.next) break;
    writer.Write(source.next->time, source.next->channel, source.next->bytes);
    source.next = source.reader.Next();
  }
  writer.Flush();
  return written;
}

}  // namespace vog
