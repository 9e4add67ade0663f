#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace vog {

/// A command of a procman file: a program that a deputy runs.
struct CommandSpec {
  std::string name;
  std::string host = "localhost";
  std::string exec;   ///< Words in shell quotes, NAME=value before the program, $VARIABLES.
  std::string group;  ///< Path of the groups around it, "a/b".
  bool auto_respawn = false;
  int stop_signal = 2;             ///< SIGINT; up to kMaxSignal.
  double stop_time_allowed_s = 7;  ///< Then SIGKILL.

  bool operator==(const CommandSpec&) const = default;
};

inline constexpr int kMaxSignal = 64;

enum class TargetKind { kEverything, kCommand, kGroup };
struct Target {
  TargetKind kind = TargetKind::kEverything;
  std::string name;
};
enum class AwaitedStatus { kNone, kRunning, kStopped };

/// A line of a script.
struct ScriptAction {
  enum class Kind { kStart, kStop, kRestart, kWaitTime, kWaitStatus, kRunScript };
  Kind kind = Kind::kStart;
  Target target;
  AwaitedStatus await = AwaitedStatus::kNone;
  int wait_ms = 0;
  std::string script;
};

struct Script {
  std::string name;
  std::vector<ScriptAction> actions;
};

/// A process table in bot2-procman's grammar.
struct PmdFile {
  std::vector<CommandSpec> commands;  ///< As they stand in the file.
  std::vector<Script> scripts;

  const Script* FindScript(const std::string& name) const;
  bool HasGroup(const std::string& name) const;
};

/// Whether a command may be called so: its output goes to a file of that name.
bool IsCommandName(std::string_view name);

/// Whether a command is meant.
bool Matches(const Target& target, const CommandSpec& command);

/// @throws UsageError "file:line: what; what is allowed": also for names that are there twice or
/// not at all, and scripts that call themselves or never seem to end.
PmdFile ParsePmd(std::string_view text, const std::string& file);
PmdFile ReadPmd(const std::filesystem::path& file);

/// The same file again, for people and for a round trip.
std::string ToPmd(const PmdFile& file);

}  // namespace vog
