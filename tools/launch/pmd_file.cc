#include "tools/launch/pmd_file.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <functional>
#include <limits>
#include <map>
#include <set>

#include "lib/base/errors.h"
#include "lib/base/files.h"

namespace vog {
namespace {

constexpr std::size_t kMaxNesting = 32;  // Of groups in groups, and scripts in scripts.
constexpr std::size_t kMaxActions = 10'000;

enum class TokenKind { kWord, kNumber, kString, kSymbol, kEnd };
struct Token {
  TokenKind kind = TokenKind::kEnd;
  std::string text;
  int line = 1;
};

std::string Shown(const Token& token) {
  if (token.kind == TokenKind::kEnd) return "the end of the file";
  return token.kind == TokenKind::kString ? '"' + token.text + '"' : '\'' + token.text + '\'';
}

/// Cuts a file into tokens.
class Lexer {
 public:
  Lexer(std::string_view text, std::string file) : text_(text), file_(std::move(file)) {}

  Token Next() {
    SkipSpace();
    Token token{TokenKind::kEnd, "", line_};
    if (at_ == text_.size()) return token;
    const char c = text_[at_];
    if (c == '"') {
      token.kind = TokenKind::kString;
      token.text = String();
    } else if (std::isalpha(static_cast<unsigned char>(c)) || c == '_') {
      token.kind = TokenKind::kWord;
      token.text = While([](char k) { return std::isalnum(k) || k == '_' || k == '-'; });
    } else if (std::isdigit(static_cast<unsigned char>(c))) {
      token.kind = TokenKind::kNumber;
      token.text = While([](char k) { return std::isdigit(k); });
    } else {
      token.kind = TokenKind::kSymbol;
      token.text = c;
      ++at_;
    }
    return token;
  }

  [[noreturn]] void Fail(int line, const std::string& what) const {
    throw UsageError(file_ + ":" + std::to_string(line) + ": " + what);
  }

 private:
  void SkipSpace() {
    while (at_ < text_.size()) {
      if (text_[at_] == '#') {
        while (at_ < text_.size() && text_[at_] != '\n') ++at_;
      } else if (std::isspace(static_cast<unsigned char>(text_[at_]))) {
        line_ += text_[at_++] == '\n';
      } else {
        return;
      }
    }
  }

  std::string While(const std::function<bool(unsigned char)>& belongs) {
    const std::size_t from = at_;
    while (at_ < text_.size() && belongs(static_cast<unsigned char>(text_[at_]))) ++at_;
    return std::string(text_.substr(from, at_ - from));
  }

  std::string String() {
    std::string text;
    for (++at_; at_ < text_.size() && text_[at_] != '"' && text_[at_] != '\n'; ++at_)
      text += text_[at_] == '\\' && at_ + 1 < text_.size() ? Escaped(text_[++at_]) : text_[at_];
    if (at_ == text_.size() || text_[at_] != '"') Fail(line_, "a string without an end");
    ++at_;
    return text;
  }

  char Escaped(char c) const {
    switch (c) {
      case 'n':
        return '\n';
      case 'r':
        return '\r';
      case 't':
        return '\t';
      case '"':
      case '\\':
        return c;
    }
    Fail(line_, std::string("unknown escape \\") + c + "; known: \\n \\r \\t \\\" \\\\");
  }

  std::string_view text_;
  std::string file_;
  std::size_t at_ = 0;
  int line_ = 1;
};

/// file := (cmd | group | script)*.
class Parser {
 public:
  Parser(std::string_view text, const std::string& file) : lexer_(text, file) { Advance(); }

  PmdFile File() {
    while (token_.kind != TokenKind::kEnd) {
      const Token start = token_;
      const std::string what = Word("cmd, group or script");
      if (what == "cmd") {
        Command("");
      } else if (what == "group") {
        Group("");
      } else if (what == "script") {
        ParseScript();
      } else {
        lexer_.Fail(start.line, "cmd, group or script expected, not " + Shown(start));
      }
    }
    CheckNames();
    return std::move(file_);
  }

 private:
  struct Use {  // Of a name that has to be there in the end.
    int line;
    Target target;
    std::string script;
  };

  void Advance() { token_ = lexer_.Next(); }
  bool Take(const std::string& symbol) {
    if (token_.kind != TokenKind::kSymbol || token_.text != symbol) return false;
    Advance();
    return true;
  }
  void Expect(const std::string& symbol) {
    if (!Take(symbol)) lexer_.Fail(token_.line, "'" + symbol + "' expected, not " + Shown(token_));
  }
  std::string Of(TokenKind kind, const std::string& what) {
    if (token_.kind != kind) lexer_.Fail(token_.line, what + " expected, not " + Shown(token_));
    std::string text = std::move(token_.text);
    Advance();
    return text;
  }
  std::string Word(const std::string& what) { return Of(TokenKind::kWord, what); }
  std::string String(const std::string& what) { return Of(TokenKind::kString, what); }
  std::string Name(const std::string& what) {
    const int line = token_.line;
    std::string name = String(what + " in quotes");
    if (!IsCommandName(name))
      lexer_.Fail(line,
                  what + " must be one of a file, not empty and without a '/': \"" + name + '"');
    return name;
  }
  int Number(const std::string& what, int least, int most = std::numeric_limits<int>::max()) {
    const int line = token_.line;
    const std::string text = Of(TokenKind::kNumber, what);
    int number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || number < least || number > most)
      lexer_.Fail(line, what + " must be an integer from " + std::to_string(least) + " to " +
                            std::to_string(most) + ", not " + text);
    return number;
  }

  void Group(const std::string& parent, std::size_t depth = 1) {
    if (depth > kMaxNesting) lexer_.Fail(token_.line, "groups are nested too deep");
    const std::string name = Name("the group's name");
    const std::string path = parent.empty() ? name : parent + "/" + name;
    Expect("{");
    while (!Take("}")) {
      const Token start = token_;
      const std::string what = Word("cmd, group or '}'");
      if (what == "cmd") {
        Command(path);
      } else if (what == "group") {
        Group(path, depth + 1);
      } else {
        lexer_.Fail(start.line, "cmd, group or '}' expected, not " + Shown(start));
      }
    }
  }

  void Command(const std::string& group) {
    CommandSpec command;
    command.group = group;
    const int line = token_.line;
    command.name = Name("the command's name");
    if (!names_.insert(command.name).second)
      lexer_.Fail(line, "there are two commands of the name \"" + command.name + '"');
    Expect("{");
    while (!Take("}")) Attribute(command);
    if (command.exec.empty()) lexer_.Fail(line, "cmd \"" + command.name + "\" has no exec");
    file_.commands.push_back(std::move(command));
  }

  void Attribute(CommandSpec& command) {
    const Token key = token_;
    Word("an attribute or '}'");
    Expect("=");
    if (key.text == "exec") {
      command.exec = String("what to execute, in quotes,");
    } else if (key.text == "host" || key.text == "deputy") {
      command.host = Host();
    } else if (key.text == "group") {
      command.group = String("a group in quotes");
    } else if (key.text == "auto_respawn") {
      command.auto_respawn = Truth();
    } else if (key.text == "stop_signal") {
      command.stop_signal = Number("stop_signal", 1, kMaxSignal);
    } else if (key.text == "stop_time_allowed") {
      command.stop_time_allowed_s = Number("stop_time_allowed", 1);
    } else {
      lexer_.Fail(key.line, "unknown attribute " + key.text +
                                "; known: exec host deputy group auto_respawn stop_signal "
                                "stop_time_allowed");
    }
    Expect(";");
  }

  std::string Host() {
    const int line = token_.line;
    std::string host = String("a host in quotes");
    if (host.empty()) lexer_.Fail(line, "a host must not be empty");
    return host;
  }

  bool Truth() {
    const int line = token_.line;
    const std::string text = String("\"true\" or \"false\"");
    if (text != "true" && text != "false")
      lexer_.Fail(line, "auto_respawn must be \"true\" or \"false\", not \"" + text + '"');
    return text == "true";
  }

  void ParseScript() {
    const int line = token_.line;
    Script script{Name("the script's name"), {}};
    if (file_.FindScript(script.name) != nullptr)
      lexer_.Fail(line, "there are two scripts of the name \"" + script.name + '"');
    Expect("{");
    while (!Take("}")) script.actions.push_back(Action());
    script_lines_[script.name] = line;
    file_.scripts.push_back(std::move(script));
  }

  ScriptAction Action() {
    const Token start = token_;
    const std::string what = Word("an action or '}'");
    ScriptAction action;
    if (what == "start" || what == "stop" || what == "restart") {
      action.kind = what == "start"  ? ScriptAction::Kind::kStart
                    : what == "stop" ? ScriptAction::Kind::kStop
                                     : ScriptAction::Kind::kRestart;
      action.target = ParseTarget(true);
      if (token_.kind == TokenKind::kWord && token_.text == "wait") {
        Advance();
        action.await = Status();
      }
    } else if (what == "wait") {
      Wait(action);
    } else if (what == "run_script") {
      action.kind = ScriptAction::Kind::kRunScript;
      action.script = Name("the script's name");
      uses_.push_back({start.line, {}, action.script});
    } else {
      lexer_.Fail(start.line,
                  "unknown action " + what + "; known: start stop restart wait run_script");
    }
    Expect(";");
    return action;
  }

  void Wait(ScriptAction& action) {
    if (token_.kind == TokenKind::kWord && token_.text == "ms") {
      Advance();
      action.kind = ScriptAction::Kind::kWaitTime;
      action.wait_ms = Number("milliseconds", 0);
      return;
    }
    action.kind = ScriptAction::Kind::kWaitStatus;
    action.target = ParseTarget(false);
    const int line = token_.line;
    if (Word("status") != "status") lexer_.Fail(line, "status expected");
    action.await = Status();
  }

  AwaitedStatus Status() {
    const int line = token_.line;
    const std::string status = String("\"running\" or \"stopped\"");
    if (status == "running") return AwaitedStatus::kRunning;
    if (status == "stopped") return AwaitedStatus::kStopped;
    lexer_.Fail(line, "a status is \"running\" or \"stopped\", not \"" + status + '"');
  }

  Target ParseTarget(bool may_be_everything) {
    const Token start = token_;
    const std::string what = Word("cmd or group");
    Target target;
    if (what == "everything" && may_be_everything) return target;
    if (what != "cmd" && what != "group")
      lexer_.Fail(start.line, std::string(may_be_everything ? "everything, " : "") +
                                  "cmd or group expected, not " + what);
    target.kind = what == "cmd" ? TargetKind::kCommand : TargetKind::kGroup;
    target.name = String("a name in quotes");
    uses_.push_back({start.line, target, ""});
    return target;
  }

  void CheckNames() const {
    for (const Use& use : uses_) {
      if (!use.script.empty()) {
        if (file_.FindScript(use.script) == nullptr)
          lexer_.Fail(use.line, "there is no script \"" + use.script + '"');
      } else if (use.target.kind == TargetKind::kCommand && !names_.count(use.target.name)) {
        lexer_.Fail(use.line, "there is no cmd \"" + use.target.name + '"');
      } else if (use.target.kind == TargetKind::kGroup && !file_.HasGroup(use.target.name)) {
        lexer_.Fail(use.line, "there is no group \"" + use.target.name + '"');
      }
    }
    std::map<std::string, std::size_t> known;
    std::vector<std::string> callers;
    for (const Script& script : file_.scripts) CountActions(script, known, callers);
  }

  /// Of a script and those that it runs; a script that runs itself would have no end.
  std::size_t CountActions(const Script& script, std::map<std::string, std::size_t>& known,
                           std::vector<std::string>& callers) const {
    if (const auto found = known.find(script.name); found != known.end()) return found->second;
    const auto fail = [&](const char* what) {
      lexer_.Fail(script_lines_.at(script.name), "script \"" + script.name + "\" " + what);
    };
    if (std::find(callers.begin(), callers.end(), script.name) != callers.end())
      fail("runs itself");
    if (callers.size() >= kMaxNesting) fail("is nested too deep");
    callers.push_back(script.name);
    std::size_t count = 0;
    for (const ScriptAction& action : script.actions)
      count += action.kind == ScriptAction::Kind::kRunScript
                   ? CountActions(*file_.FindScript(action.script), known, callers)
                   : 1;
    callers.pop_back();
    if (count > kMaxActions) fail("has too many actions, with those of the scripts that it runs");
    return known[script.name] = count;
  }

  Lexer lexer_;
  Token token_;
  PmdFile file_;
  std::set<std::string> names_;
  std::map<std::string, int> script_lines_;
  std::vector<Use> uses_;
};

std::string Quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    switch (c) {
      case '\n':
        quoted += "\\n";
        break;
      case '\r':
        quoted += "\\r";
        break;
      case '\t':
        quoted += "\\t";
        break;
      case '"':
      case '\\':
        quoted += '\\';
        [[fallthrough]];
      default:
        quoted += c;
    }
  }
  return quoted + '"';
}

std::string ToText(const Target& target) {
  switch (target.kind) {
    case TargetKind::kEverything:
      return "everything";
    case TargetKind::kCommand:
      return "cmd " + Quoted(target.name);
    case TargetKind::kGroup:
      return "group " + Quoted(target.name);
  }
  return "";
}

std::string ToText(AwaitedStatus status) {
  return status == AwaitedStatus::kRunning ? "\"running\"" : "\"stopped\"";
}

std::string ToText(const ScriptAction& action) {
  using Kind = ScriptAction::Kind;
  switch (action.kind) {
    case Kind::kWaitTime:
      return "wait ms " + std::to_string(action.wait_ms);
    case Kind::kWaitStatus:
      return "wait " + ToText(action.target) + " status " + ToText(action.await);
    case Kind::kRunScript:
      return "run_script " + Quoted(action.script);
    default:
      break;
  }
  const std::string verb = action.kind == Kind::kStart  ? "start "
                           : action.kind == Kind::kStop ? "stop "
                                                        : "restart ";
  return verb + ToText(action.target) +
         (action.await == AwaitedStatus::kNone ? "" : " wait " + ToText(action.await));
}

}  // namespace

const Script* PmdFile::FindScript(const std::string& name) const {
  const auto found = std::find_if(scripts.begin(), scripts.end(),
                                  [&](const Script& script) { return script.name == name; });
  return found == scripts.end() ? nullptr : &*found;
}

bool PmdFile::HasGroup(const std::string& name) const {
  return std::any_of(commands.begin(), commands.end(), [&](const CommandSpec& command) {
    return Matches({TargetKind::kGroup, name}, command);
  });
}

bool IsCommandName(std::string_view name) {
  return !name.empty() && name != "." && name != ".." && name.size() <= 200 &&
         name.find('/') == std::string_view::npos && name.find('\0') == std::string_view::npos;
}

bool Matches(const Target& target, const CommandSpec& command) {
  switch (target.kind) {
    case TargetKind::kEverything:
      return true;
    case TargetKind::kCommand:
      return command.name == target.name;
    case TargetKind::kGroup:
      return (command.group + "/").starts_with(target.name + "/");
  }
  return false;
}

PmdFile ParsePmd(std::string_view text, const std::string& file) {
  return Parser(text, file).File();
}

PmdFile ReadPmd(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file)) throw UsageError(file.string() + ": no such file");
  return ParsePmd(ReadFile(file), file.string());
}

std::string ToPmd(const PmdFile& file) {
  std::string text;
  for (const CommandSpec& command : file.commands) {
    text += "cmd " + Quoted(command.name) + " {\n  exec = " + Quoted(command.exec) +
            ";\n  host = " + Quoted(command.host) + ";\n";
    if (!command.group.empty()) text += "  group = " + Quoted(command.group) + ";\n";
    text += std::string("  auto_respawn = \"") + (command.auto_respawn ? "true" : "false") +
            "\";\n  stop_signal = " + std::to_string(command.stop_signal) +
            ";\n  stop_time_allowed = " +
            std::to_string(static_cast<int>(command.stop_time_allowed_s)) + ";\n}\n";
  }
  for (const Script& script : file.scripts) {
    text += "script " + Quoted(script.name) + " {\n";
    for (const ScriptAction& action : script.actions) text += "  " + ToText(action) + ";\n";
    text += "}\n";
  }
  return text;
}

}  // namespace vog
