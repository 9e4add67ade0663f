#include "tools/launch/pmd_file.h"

#include <gtest/gtest.h>

#include <random>

#include "lib/base/errors.h"

namespace vog {
namespace {

/// What it is refused for; empty: it is not.
std::string FaultOf(const std::string& text) {
  try {
    ParsePmd(text, "t.pmd");
    return "";
  } catch (const UsageError& error) {
    return error.what();
  }
}

TEST(PmdFile, ReadsCommandsGroupsAndScripts) {
  const PmdFile file = ParsePmd(R"(# A comment.
cmd "alone" { exec = "a \"b\" \\ \t\n\r"; host = "other"; }  # Another.
group "outer" {
  cmd "one" { exec = "x"; auto_respawn = "true"; stop_signal = 15; stop_time_allowed = 3; }
  group "inner" { cmd "two" { exec = "# no comment"; deputy = "d"; } }
  cmd "three" { exec = "y"; group = "elsewhere/deep"; }
}
script "go" {
  start everything;
  stop cmd "one" wait "stopped";
  restart group "outer/inner" wait "running";
  wait ms 250;
  wait group "outer" status "running";
  run_script "other";
}
script "other" {}
)",
                                "t.pmd");
  ASSERT_EQ(file.commands.size(), 4u);
  EXPECT_EQ(file.commands[0].exec, "a \"b\" \\ \t\n\r");
  EXPECT_EQ(file.commands[0].host, "other");
  EXPECT_EQ(file.commands[0].group, "");
  EXPECT_EQ(file.commands[0].stop_signal, 2);
  EXPECT_EQ(file.commands[0].stop_time_allowed_s, 7);
  EXPECT_FALSE(file.commands[0].auto_respawn);
  EXPECT_EQ(file.commands[1].group, "outer");
  EXPECT_TRUE(file.commands[1].auto_respawn);
  EXPECT_EQ(file.commands[1].stop_signal, 15);
  EXPECT_EQ(file.commands[1].stop_time_allowed_s, 3);
  EXPECT_EQ(file.commands[2].group, "outer/inner");
  EXPECT_EQ(file.commands[2].exec, "# no comment");
  EXPECT_EQ(file.commands[2].host, "d");
  EXPECT_EQ(file.commands[3].group, "elsewhere/deep");
  ASSERT_EQ(file.scripts.size(), 2u);
  const auto& actions = file.FindScript("go")->actions;
  ASSERT_EQ(actions.size(), 6u);
  EXPECT_EQ(actions[1].await, AwaitedStatus::kStopped);
  EXPECT_EQ(actions[2].target.name, "outer/inner");
  EXPECT_EQ(actions[3].wait_ms, 250);
  EXPECT_EQ(actions[5].script, "other");
  EXPECT_TRUE(file.HasGroup("outer"));
  EXPECT_FALSE(file.HasGroup("inner"));
  EXPECT_FALSE(file.HasGroup("out"));
}

TEST(PmdFile, ErrorsTellTheLine) {
  const std::string a = "cmd \"a\" { exec = \"x\"; }\n";
  const auto script = [&](const std::string& line) {
    return a + "script \"s\" {\n" + line + "\n}";
  };
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"\nfoo \"a\" {}", "t.pmd:2: cmd, group or script expected, not 'foo'"},
      {"\n\n7", "t.pmd:3: cmd, group or script expected, not '7'"},
      {"cmd a {}", "t.pmd:1: the command's name in quotes expected, not 'a'"},
      {"cmd \"a\"\n;", "t.pmd:2: '{' expected, not ';'"},
      {"cmd \"a\" {\nexec \"x\"; }", "t.pmd:2: '=' expected, not \"x\""},
      {"cmd \"a\" {\nexec = x; }", "t.pmd:2: what to execute, in quotes, expected, not 'x'"},
      {"cmd \"a\" {\nexec = \"x\"\n}", "t.pmd:3: ';' expected, not '}'"},
      {"cmd \"a\" {\nexec = \"x\";",
       "t.pmd:2: an attribute or '}' expected, not the end of the file"},
      {"cmd \"a\" {\nexec = \"x", "t.pmd:2: a string without an end"},
      {"cmd \"a\" {\nexec = \"x\\q\";", "t.pmd:2: unknown escape \\q"},
      {"cmd \"a\" {\nnice = \"x\"; }", "t.pmd:2: unknown attribute nice; known: exec"},
      {"cmd \"a\" { }", "t.pmd:1: cmd \"a\" has no exec"},
      {"cmd \"a/b\" { }", "t.pmd:1: the command's name must be one of a file"},
      {"cmd \"\" { }", "t.pmd:1: the command's name must be one of a file"},
      {"cmd \"..\" { }", "t.pmd:1: the command's name must be one of a file"},
      {"cmd \"a\" { host = \"\"; }", "t.pmd:1: a host must not be empty"},
      {a + "cmd \"a\" { exec = \"x\"; }", "t.pmd:2: there are two commands of the name \"a\""},
      {"cmd \"a\" {\nauto_respawn = \"yes\"; }", "t.pmd:2: auto_respawn must be \"true\" or"},
      {"cmd \"a\" {\nstop_signal = 0; }", "t.pmd:2: stop_signal must be an integer from 1 to 64"},
      {"cmd \"a\" {\nstop_signal = 65; }", "t.pmd:2: stop_signal must be an integer from 1 to 64"},
      {"cmd \"a\" {\nstop_signal = 99999999999; }", "t.pmd:2: stop_signal must be an integer"},
      {"cmd \"a\" {\nstop_time_allowed = 0; }", "t.pmd:2: stop_time_allowed must be an integer"},
      {"group \"g\" {\nscript \"s\" {} }", "t.pmd:2: cmd, group or '}' expected, not 'script'"},
      {"group \"g\" {", "t.pmd:1: cmd, group or '}' expected, not the end of the file"},
      {script("go;"), "t.pmd:3: unknown action go; known: start stop"},
      {script("start;"), "t.pmd:3: cmd or group expected, not ';'"},
      {script("start host \"a\";"), "t.pmd:3: everything, cmd or group expected, not host"},
      {script("start cmd \"b\";"), "t.pmd:3: there is no cmd \"b\""},
      {script("start group \"g\";"), "t.pmd:3: there is no group \"g\""},
      {script("start cmd \"a\" wait \"ready\";"),
       "t.pmd:3: a status is \"running\" or \"stopped\""},
      {script("wait everything status \"running\";"), "t.pmd:3: cmd or group expected"},
      {script("wait cmd \"a\" is \"running\";"), "t.pmd:3: status expected"},
      {script("wait ms x;"), "t.pmd:3: milliseconds expected, not 'x'"},
      {script("run_script \"t\";"), "t.pmd:3: there is no script \"t\""},
      {script("run_script \"s\";"), "t.pmd:2: script \"s\" runs itself"},
      {script("") + "script \"s\" {}", "t.pmd:4: there are two scripts of the name \"s\""},
      {"script \"a\" { run_script \"b\"; }\nscript \"b\" { run_script \"c\"; }\n"
       "script \"c\" { run_script \"a\"; }",
       "t.pmd:1: script \"a\" runs itself"},
  };
  for (const auto& [text, fault] : cases)
    EXPECT_TRUE(FaultOf(text).starts_with(fault)) << text << "\n" << FaultOf(text);
}

TEST(PmdFile, DeepNestingAndEndlessScriptsAreRefused) {
  std::string groups;
  for (int i = 0; i < 100'000; ++i) groups += "group \"g\" {";
  EXPECT_EQ(FaultOf(groups), "t.pmd:1: groups are nested too deep");
  std::string doubling = "script \"s0\" { wait ms 0; }\n", chain = doubling;
  for (int i = 1; i < 1000; ++i) {
    const std::string head = "script \"s" + std::to_string(i) + "\" {";
    const std::string run = "run_script \"s" + std::to_string(i - 1) + "\";";
    if (i < 25) doubling += head + run + run + "}\n";
    chain = head + run + "}\n" + chain;
  }
  EXPECT_NE(FaultOf(doubling).find("has too many actions"), std::string::npos) << FaultOf(doubling);
  EXPECT_NE(FaultOf(chain).find("is nested too deep"), std::string::npos) << FaultOf(chain);
}

/// Random valid files.
class RandomPmd {
 public:
  explicit RandomPmd(unsigned seed) : random_(seed) {}

  PmdFile Make() {
    PmdFile file;
    const int commands = Below(6) + 1;
    for (int i = 0; i < commands; ++i) file.commands.push_back(Command(i));
    const int scripts = Below(4);
    for (int i = 0; i < scripts; ++i) file.scripts.push_back(MakeScript(i, file));
    return file;
  }
  int Below(int end) { return std::uniform_int_distribution<int>(0, end - 1)(random_); }

 private:
  std::string Text(int most) {
    static const std::string kLetters = "ab Z09-_.#{}=;'\"\\\n\t\r$\x01\xff";
    std::string text = "x";
    for (int left = Below(most); left > 0; --left)
      text += kLetters[static_cast<std::size_t>(Below(static_cast<int>(kLetters.size())))];
    return text;
  }
  CommandSpec Command(int number) {
    CommandSpec command;
    command.name = Text(8) + std::to_string(number);
    command.exec = Text(40);
    if (Below(2)) command.host = Text(5);
    if (Below(2)) command.group = Text(5) + "/" + Text(5);
    command.auto_respawn = Below(2);
    command.stop_signal = Below(kMaxSignal) + 1;
    command.stop_time_allowed_s = Below(100) + 1;
    return command;
  }
  Target MakeTarget(const PmdFile& file, bool may_be_everything) {
    const auto& command =
        file.commands[static_cast<std::size_t>(Below(static_cast<int>(file.commands.size())))];
    if (may_be_everything && Below(3) == 0) return {};
    if (!command.group.empty() && Below(2)) return {TargetKind::kGroup, command.group};
    return {TargetKind::kCommand, command.name};
  }
  Script MakeScript(int number, const PmdFile& file) {
    Script script{"s" + std::to_string(number), {}};
    for (int left = Below(6); left > 0; --left) {
      ScriptAction action;
      const int kind = Below(number > 0 ? 6 : 5);
      action.kind = static_cast<ScriptAction::Kind>(kind);
      if (action.kind == ScriptAction::Kind::kWaitTime) {
        action.wait_ms = Below(10000);
      } else if (action.kind == ScriptAction::Kind::kRunScript) {
        action.script = "s" + std::to_string(Below(number));
      } else {
        const bool waits = action.kind == ScriptAction::Kind::kWaitStatus;
        action.target = MakeTarget(file, !waits);
        action.await = static_cast<AwaitedStatus>(waits ? 1 + Below(2) : Below(3));
      }
      script.actions.push_back(action);
    }
    return script;
  }

  std::mt19937 random_;
};

TEST(PmdFile, RandomFilesComeBackTheSame) {
  RandomPmd random(1);
  for (int i = 0; i < 300; ++i) {
    const PmdFile file = random.Make();
    const std::string text = ToPmd(file);
    const PmdFile read = ParsePmd(text, "t.pmd");
    EXPECT_EQ(read.commands, file.commands) << text;
    EXPECT_EQ(read.scripts.size(), file.scripts.size());
    EXPECT_EQ(ToPmd(read), text);
  }
}

TEST(PmdFile, NoDamageDoesMoreThanAnError) {
  RandomPmd random(2);
  int refused = 0;
  for (int i = 0; i < 100; ++i) {
    const std::string text = ToPmd(random.Make());
    for (int k = 0; k < 100; ++k) {
      std::string damaged = text;
      const auto at = static_cast<std::size_t>(random.Below(static_cast<int>(text.size())));
      if (k % 3 == 0) damaged.resize(at);
      if (k % 3 == 1) damaged[at] = static_cast<char>(random.Below(256));
      if (k % 3 == 2)
        damaged.insert(at, damaged, at / 2, static_cast<std::size_t>(random.Below(40)));
      const std::string fault = FaultOf(damaged);
      refused += !fault.empty();
      EXPECT_TRUE(fault.empty() || fault.starts_with("t.pmd:")) << fault;
    }
  }
  EXPECT_GT(refused, 1000);
}

TEST(PmdFile, ShippedFilesAreGood) {
  const std::filesystem::directory_iterator files(std::string(VOG_SOURCE_DIR) + "/config/launch");
  for (const auto& entry : files) {
    if (entry.path().extension() != ".pmd") continue;
    EXPECT_GT(ReadPmd(entry.path()).commands.size(), 5u);
  }
  EXPECT_THROW(ReadPmd("/nosuch.pmd"), UsageError);
}

}  // namespace
}  // namespace vog
