#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lib/bus/bus.h"
#include "tools/launch/pmd_file.h"
#include "tools/launch/procman_messages.h"
#include "vog/status_t.hpp"

namespace vog {

/// Orders deputies to run a file's commands, and follows its scripts. A command of ours counts as
/// running once it has told STATUS, any other once its deputy says so. In: PMD_INFO2, STATUS. Out:
/// PMD_ORDERS2 once a second and on each change.
class Sheriff {
 public:
  /// `local_host` is the deputy that the host "localhost" means.
  Sheriff(Bus& bus, PmdFile file, const std::string& local_host);

  void Start(const Target& target);
  void Stop(const Target& target);
  /// Follows a script's actions, one after the other.
  void Run(const Script& script);
  /// Stops all, the last one started first, each once those after it have ended.
  void StopInOrder();

  /// No action is left to do, and what is to be waited for is so.
  bool IsIdle() const { return actions_.empty(); }
  /// What the present action waits for: for a message when it takes too long.
  std::string waits_for() const;
  bool IsEverything(AwaitedStatus status) const;
  /// Why the present action waits in vain: a command that it waits for has ended for good. Empty:
  /// there is hope.
  std::string hopeless() const;

  /// What has changed since, a line each: "vog-slam: ready".
  std::vector<std::string> TakeNews() { return std::exchange(news_, {}); }

 private:
  struct Posse {  // A command and what is known of it.
    CommandSpec spec;
    std::int32_t id;
    int desired_run = 0;
    bool force_quit = false;
    int pid = 0, actual_run = 0;
    int exit_status = 0;
    std::string given_up{};
    bool has_told_status = false;
  };

  void Tick(Time now);
  void Begin(const ScriptAction& action, Time now);
  bool IsDone(const ScriptAction& action, Time now) const;
  bool Has(const Posse& command, AwaitedStatus status) const;
  void OnInfo(const bot_procman::info2_t& info);
  void Note(Posse& command, const bot_procman::deputy_cmd2_t& told);
  /// A deputy that stops, or a new one of that name.
  void NoteGone(Posse& command);
  void OnStatus(const status_t& status);
  void Expand(const Script& script, std::vector<ScriptAction>& actions) const;
  void PublishOrders(Time now);

  Bus& bus_;
  PmdFile file_;
  std::vector<Posse> commands_;
  std::deque<ScriptAction> actions_;
  std::optional<Time> action_began_;
  bool has_changed_ = true;
  Time last_orders_;
  std::vector<std::string> news_;
};

}  // namespace vog
