#include "tools/log/log_selection.h"

#include <algorithm>

#include "lib/base/errors.h"

namespace vog {

SelectedLog::SelectedLog(const std::string& path, const LogSelection& selection)
    : filter_(selection.channels), reader_(path), selection_(selection) {
  if (const auto first = reader_.Next()) first_ = first->time;
  SeekTo(0);
  if (!Next()) throw UsageError(path + ": no message on such channels at such times");
  SeekTo(0);
}

std::optional<SelectedLog::Event> SelectedLog::Next() {
  while (auto event = reader_.Next()) {
    const double at_s = ToSeconds(event->time - first_);
    if (at_s > selection_.to_s) return std::nullopt;
    if (filter_.Matches(event->channel)) return Event{at_s, std::move(*event)};
  }
  return std::nullopt;
}

void SelectedLog::SeekTo(double at_s) {
  reader_.SeekTo(first_ + FromSeconds(std::max(at_s, selection_.from_s)));
}

}  // namespace vog
