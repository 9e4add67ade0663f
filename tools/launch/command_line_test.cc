#include "tools/launch/command_line.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "lib/base/errors.h"

namespace vog {
namespace {

std::string FaultOf(const std::string& exec) {
  try {
    ParseExec(exec, "/nosuch");
    return "";
  } catch (const UsageError& error) {
    return error.what();
  }
}

TEST(CommandLine, ReadsWordsAsAShellDoes) {
  ::setenv("VOG_TEST_WORD", "a b", 1);
  const ChildCommand command =
      ParseExec("A=1 B_2='x y' sh -c \"$VOG_TEST_WORD\" '$HOME' \"${VOG_TEST_WORD}\"", "/nosuch");
  EXPECT_EQ(command.program.filename(), "sh");
  EXPECT_TRUE(command.program.is_absolute());
  EXPECT_EQ(command.argv, (std::vector<std::string>{"sh", "-c", "a b", "$HOME", "a b"}));
  EXPECT_EQ(command.environment, (std::vector<std::string>{"A=1", "B_2=x y"}));
  EXPECT_EQ(ParseExec("sh", "/bin").program, "/bin/sh");
  EXPECT_EQ(ParseExec("/any/where a=b", "/bin").argv,
            (std::vector<std::string>{"/any/where", "a=b"}));
}

TEST(CommandLine, FindsProgramsInPath) {
  EXPECT_EQ(FindInPath("sh")->filename(), "sh");
  EXPECT_EQ(FindInPath("vog-no-such-program"), std::nullopt);
}

TEST(CommandLine, HearsWhatAProgramSaysAndHowItEnds) {
  const EndedProgram ended =
      RunToItsEnd({"/bin/sh", {"sh", "-c", "echo $VOG_TEST; echo b >&2; exit 3"}, {"VOG_TEST=a"}});
  EXPECT_EQ(ended.said, "a\nb\n");
  EXPECT_EQ(HowItEnded(ended.status), "exit status 3");
  const EndedProgram killed = RunToItsEnd({"/bin/sh", {"sh", "-c", "kill -9 $$"}, {}});
  EXPECT_EQ(killed.said, "");
  EXPECT_EQ(HowItEnded(killed.status), "killed by Killed");
}

TEST(CommandLine, SaysWhatCannotBeRead) {
  ::unsetenv("VOG_TEST_UNSET");
  EXPECT_NE(FaultOf("sh $VOG_TEST_UNSET").find("not set"), std::string::npos);
  EXPECT_NE(FaultOf("sh | sh").find("outside of quotes"), std::string::npos);
  EXPECT_NE(FaultOf("sh `id`").find("a command in a command"), std::string::npos);
  EXPECT_NE(FaultOf("sh \"").find("quotes that do not end"), std::string::npos);
  EXPECT_NE(FaultOf("A=1").find("no program"), std::string::npos);
  EXPECT_NE(FaultOf("").find("no program"), std::string::npos);
  EXPECT_NE(FaultOf("vog-no-such-program").find("no such program"), std::string::npos);
}

}  // namespace
}  // namespace vog
