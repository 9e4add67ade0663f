#include "tools/status/system_view.h"

#include "lib/messages/endpoint.h"
#include "tools/launch/procman_messages.h"

namespace vog {
namespace {

/// Who says a message of ours; nothing for others' messages.
std::optional<std::string> SenderOf(Bytes bytes) {
  constexpr int kType_bytes = 8;
  header_t header{};
  try {
    const int left = static_cast<int>(bytes.size()) - kType_bytes;
    if (left <= 0 || header._decodeNoHash(bytes.data(), kType_bytes, left) < 0) return std::nullopt;
  } catch (const std::exception&) {  // An impossible length in the bytes.
    return std::nullopt;
  }
  return header.sender;
}

}  // namespace

void SystemView::OnMessage(Time now, const std::string& channel, Bytes bytes) {
  ChannelUse& use = channels_.try_emplace(channel, ChannelUse{RateMeter(sampled_)}).first->second;
  use.messages.Add();
  use.bytes += static_cast<std::int64_t>(bytes.size());
  use.last = now;
  HandleIf(channel, bytes, outputs::kStatus,
           [&](const status_t& status) { OnStatus(now, status); });
  HandleIf(channel, bytes, outputs::kMissionStatus, [&](const mission_status_t& status) {
    mission_ = {now, status};
  });
  HandleIf(channel, bytes, outputs::kMapStatus, [&](const map_status_t& status) {
    map_ = {now, status};
  });
  HandleIf(channel, bytes, procman::kInfo, [&](const bot_procman::info2_t& info) {
    deputies_[info.host] = {now, info};
  });
  const auto sender = SenderOf(bytes);
  const auto process = sender ? processes_.find(*sender) : processes_.end();
  if (process != processes_.end()) process->second.messages.Add();
}

void SystemView::OnStatus(Time now, const status_t& status) {
  const auto [found, is_new] =
      processes_.try_emplace(status.process, Process{{now, status}, RateMeter(sampled_)});
  if (is_new) return;
  Process& process = found->second;
  process.restarts += status.header.epoch != process.status.message.header.epoch;
  process.status = {now, status};
}

void SystemView::Sample(Time now) {
  sampled_ = now;
  for (auto& [name, process] : processes_) process.messages.Sample(now);
  for (auto& [name, channel] : channels_) channel.messages.Sample(now);
}

}  // namespace vog
