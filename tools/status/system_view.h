#pragma once

#include <map>
#include <optional>
#include <string>

#include "bot_procman/info2_t.hpp"
#include "lib/bus/bus.h"
#include "tools/status/rate_meter.h"
#include "vog/map_status_t.hpp"
#include "vog/mission_status_t.hpp"
#include "vog/status_t.hpp"

namespace vog {

/// A message and when it came.
template <class Message>
struct Heard {
  Time time;
  Message message;
};

/// Whoever says so little is silent.
inline constexpr Duration kSilentAfter = std::chrono::seconds(3);

/// What the messages on a bus tell of the system, for people.
class SystemView {
 public:
  struct Process {
    Heard<status_t> status;
    RateMeter messages;  ///< All that it says, STATUS too.
    int restarts = 0;    ///< That were heard of.
  };
  struct ChannelUse {
    RateMeter messages;
    std::int64_t bytes = 0;
    Time last{};
  };

  explicit SystemView(Time began) : sampled_(began) {}

  void OnMessage(Time now, const std::string& channel, Bytes bytes);
  /// Brings all rates up to date; to be called about once a second.
  void Sample(Time now);

  const std::map<std::string, Process>& processes() const { return processes_; }
  /// Latest PMD_INFO2 of each host.
  const std::map<std::string, Heard<bot_procman::info2_t>>& deputies() const { return deputies_; }
  const std::map<std::string, ChannelUse>& channels() const { return channels_; }
  const std::optional<Heard<mission_status_t>>& mission() const { return mission_; }
  const std::optional<Heard<map_status_t>>& map() const { return map_; }

 private:
  void OnStatus(Time now, const status_t& status);

  std::map<std::string, Process> processes_;
  std::map<std::string, Heard<bot_procman::info2_t>> deputies_;
  std::map<std::string, ChannelUse> channels_;
  std::optional<Heard<mission_status_t>> mission_;
  std::optional<Heard<map_status_t>> map_;
  Time sampled_;
};

}  // namespace vog
