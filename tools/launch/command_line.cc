#include "tools/launch/command_line.h"

#include <unistd.h>
#include <wordexp.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <sstream>

#include "lib/base/errors.h"

namespace vog {
namespace {

std::vector<std::string> WordsOf(const std::string& exec) {
  wordexp_t found{};
  const int status = ::wordexp(exec.c_str(), &found, WRDE_NOCMD | WRDE_UNDEF);
  if (status != 0) {
    const char* why = status == WRDE_BADVAL    ? "a $VARIABLE that is not set"
                      : status == WRDE_BADCHAR ? "one of | & ; < > ( ) { } outside of quotes"
                      : status == WRDE_CMDSUB  ? "a command in a command"
                                               : "quotes that do not end";
    throw UsageError("exec \"" + exec + "\": " + why);
  }
  std::vector<std::string> words(found.we_wordv, found.we_wordv + found.we_wordc);
  ::wordfree(&found);
  return words;
}

bool IsAssignment(const std::string& word) {
  const std::size_t equals = word.find('=');
  if (equals == std::string::npos || equals == 0 || std::isdigit(word[0])) return false;
  return std::all_of(word.begin(), word.begin() + static_cast<std::ptrdiff_t>(equals),
                     [](unsigned char c) { return std::isalnum(c) || c == '_'; });
}

std::filesystem::path Find(const std::string& program, const std::filesystem::path& folder) {
  if (program.find('/') != std::string::npos) return program;
  const char* path = std::getenv("PATH");
  std::istringstream folders(folder.string() + ":" + (path == nullptr ? "" : path));
  for (std::string candidate; std::getline(folders, candidate, ':');) {
    const std::filesystem::path full = std::filesystem::path(candidate) / program;
    if (::access(full.c_str(), X_OK) == 0) return full;
  }
  throw UsageError(program + ": no such program, neither in " + folder.string() + " nor in PATH");
}

}  // namespace

ChildCommand ParseExec(const std::string& exec, const std::filesystem::path& program_folder) {
  std::vector<std::string> words = WordsOf(exec);
  const auto program = std::find_if_not(words.begin(), words.end(), IsAssignment);
  if (program == words.end()) throw UsageError("exec \"" + exec + "\": no program");
  return {Find(*program, program_folder), {program, words.end()}, {words.begin(), program}};
}

}  // namespace vog
