#include "tools/launch/sheriff.h"

#include <algorithm>
#include <set>
#include <sstream>
#include <utility>

#include "tools/launch/child_process.h"

namespace vog {
namespace {

constexpr Duration kTickPeriod = std::chrono::milliseconds(10);
constexpr Duration kOrdersPeriod = std::chrono::seconds(1);

/// The name under which a command of ours tells STATUS; empty for others'.
std::string StatusNameOf(const CommandSpec& spec) {
  std::istringstream words(spec.exec);
  std::string word;
  while (words >> word && word.find('=') != std::string::npos) {
  }
  const std::string program = word.substr(word.rfind('/') + 1);
  return program.starts_with("vog-") ? program : "";
}

std::string NameOf(const Target& target) {
  return target.kind == TargetKind::kEverything ? "everything" : '"' + target.name + '"';
}

}  // namespace

Sheriff::Sheriff(Bus& bus, PmdFile file, const std::string& local_host)
    : bus_(bus), file_(std::move(file)) {
  for (CommandSpec spec : file_.commands) {
    if (spec.host == "localhost") spec.host = local_host;
    commands_.push_back({std::move(spec), static_cast<std::int32_t>(commands_.size() + 1)});
  }
  procman::Subscribe(bus, procman::kInfo, [this](Time, const auto& info) { OnInfo(info); });
  procman::Subscribe(bus, outputs::kStatus, [this](Time, const auto& status) { OnStatus(status); });
  bus.Every(kTickPeriod, [this](Time now) { Tick(now); });
}

void Sheriff::Start(const Target& target) {
  for (Posse& command : commands_) {
    if (!Matches(target, command.spec)) continue;
    const bool is_ordered = command.desired_run != command.actual_run;
    if ((is_ordered || command.pid != 0) && !command.force_quit) continue;
    ++command.desired_run;
    command.force_quit = false;
    has_changed_ = true;
  }
}

void Sheriff::Stop(const Target& target) {
  for (Posse& command : commands_) {
    if (!Matches(target, command.spec)) continue;
    command.force_quit = true;
    has_changed_ = true;
  }
}

void Sheriff::Expand(const Script& script, std::vector<ScriptAction>& actions) const {
  for (const ScriptAction& action : script.actions) {
    if (action.kind == ScriptAction::Kind::kRunScript) {
      Expand(*file_.FindScript(action.script), actions);
    } else {
      actions.push_back(action);
    }
  }
}

void Sheriff::Run(const Script& script) {
  std::vector<ScriptAction> actions;
  Expand(script, actions);
  actions_.assign(actions.begin(), actions.end());
  action_began_.reset();
}

void Sheriff::StopInOrder() {
  Script script;
  for (auto command = commands_.rbegin(); command != commands_.rend(); ++command) {
    ScriptAction action;
    action.kind = ScriptAction::Kind::kStop;
    action.target = {TargetKind::kCommand, command->spec.name};
    action.await = AwaitedStatus::kStopped;
    script.actions.push_back(action);
  }
  Run(script);
}

std::string Sheriff::waits_for() const {
  if (actions_.empty()) return "nothing";
  const ScriptAction& action = actions_.front();
  if (action.kind == ScriptAction::Kind::kWaitTime) return "time to pass";
  std::string names;
  for (const Posse& command : commands_)
    if (Matches(action.target, command.spec) && !Has(command, action.await))
      names += (names.empty() ? "" : ", ") + command.spec.name;
  return NameOf(action.target) + " (" + names + ") to be " +
         (action.await == AwaitedStatus::kRunning ? "ready" : "stopped");
}

std::string Sheriff::hopeless() const {
  if (actions_.empty() || actions_.front().await != AwaitedStatus::kRunning) return "";
  for (const Posse& command : commands_) {
    if (!Matches(actions_.front().target, command.spec)) continue;
    if (!command.given_up.empty()) return command.spec.name + ": given up: " + command.given_up;
    const bool has_ended =
        command.pid == 0 && command.desired_run != 0 && command.actual_run == command.desired_run;
    if (has_ended && !command.spec.auto_respawn)
      return command.spec.name + ": " + HowItEnded(command.exit_status);
  }
  return "";
}

bool Sheriff::IsEverything(AwaitedStatus status) const {
  return std::all_of(commands_.begin(), commands_.end(),
                     [&](const Posse& command) { return Has(command, status); });
}

void Sheriff::Tick(Time now) {
  while (!actions_.empty()) {
    if (!action_began_) Begin(actions_.front(), now);
    if (!IsDone(actions_.front(), now)) break;
    actions_.pop_front();
    action_began_.reset();
  }
  if (std::exchange(has_changed_, false) || now - last_orders_ >= kOrdersPeriod) PublishOrders(now);
}

void Sheriff::Begin(const ScriptAction& action, Time now) {
  action_began_ = now;
  switch (action.kind) {
    case ScriptAction::Kind::kStart:
      Start(action.target);
      break;
    case ScriptAction::Kind::kStop:
      Stop(action.target);
      break;
    case ScriptAction::Kind::kRestart:
      Stop(action.target);
      Start(action.target);
      break;
    default:
      break;
  }
}

bool Sheriff::IsDone(const ScriptAction& action, Time now) const {
  if (action.kind == ScriptAction::Kind::kWaitTime)
    return now - *action_began_ >= std::chrono::milliseconds(action.wait_ms);
  if (action.await == AwaitedStatus::kNone) return true;
  return std::all_of(commands_.begin(), commands_.end(), [&](const Posse& command) {
    return !Matches(action.target, command.spec) || Has(command, action.await);
  });
}

bool Sheriff::Has(const Posse& command, AwaitedStatus status) const {
  if (status == AwaitedStatus::kStopped)
    return command.pid == 0 && (command.force_quit || command.desired_run == command.actual_run);
  return command.pid != 0 && command.actual_run == command.desired_run &&
         (command.has_told_status || StatusNameOf(command.spec).empty());
}

void Sheriff::OnInfo(const bot_procman::info2_t& info) {
  for (Posse& command : commands_) {
    if (command.spec.host != info.host) continue;
    const auto told = std::find_if(info.cmds.begin(), info.cmds.end(), [&](const auto& candidate) {
      return command.id == candidate.sheriff_id && command.spec.name == candidate.cmd.command_name;
    });
    if (told != info.cmds.end()) {
      Note(command, *told);
    } else if (command.actual_run != 0) {
      NoteGone(command);
    }
  }
}

void Sheriff::NoteGone(Posse& command) {
  news_.push_back(command.spec.name + ": its deputy knows it no longer");
  command.pid = 0;
  command.actual_run = 0;
  command.given_up.clear();
  command.has_told_status = false;
}

void Sheriff::Note(Posse& command, const bot_procman::deputy_cmd2_t& told) {
  const std::string given_up = procman::GivenUp(told.cmd);
  if (told.pid != command.pid) {
    command.has_told_status = false;
    news_.push_back(
        command.spec.name + ": " +
        (told.pid != 0 ? "started, pid " + std::to_string(told.pid) : HowItEnded(told.exit_code)));
  }
  if (given_up != command.given_up && !given_up.empty())
    news_.push_back(command.spec.name + ": given up: " + given_up);
  command.pid = told.pid;
  command.actual_run = told.actual_runid;
  command.exit_status = told.exit_code;
  command.given_up = given_up;
}

void Sheriff::OnStatus(const status_t& status) {
  for (Posse& command : commands_) {
    if (command.has_told_status || command.pid == 0 || StatusNameOf(command.spec) != status.process)
      continue;
    command.has_told_status = true;
    news_.push_back(command.spec.name + ": ready");
  }
}

void Sheriff::PublishOrders(Time now) {
  last_orders_ = now;
  std::set<std::string> hosts;
  for (const Posse& command : commands_) hosts.insert(command.spec.host);
  for (const std::string& host : hosts) {
    bot_procman::orders2_t orders{};
    orders.utime = ToUtime(now);
    orders.host = host;
    orders.sheriff_name = "vog-launch";
    for (const Posse& command : commands_) {
      if (command.spec.host != host) continue;
      bot_procman::sheriff_cmd2_t order{};
      order.cmd = procman::ToMessage(command.spec);
      order.desired_runid = command.desired_run;
      order.force_quit = command.force_quit;
      order.sheriff_id = command.id;
      orders.cmds.push_back(order);
    }
    orders.ncmds = static_cast<std::int32_t>(orders.cmds.size());
    bus_.Publish(procman::kOrders.name, Encode(orders));
  }
}

}  // namespace vog
