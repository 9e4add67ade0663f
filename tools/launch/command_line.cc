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

bool IsAssignment(const std::string& word) {
  const std::size_t equals = word.find('=');
  if (equals == std::string::npos || equals == 0 || std::isdigit(word[0])) return false;
  return std::all_of(word.begin(), word.begin() + static_cast<std::ptrdiff_t>(equals),
                     [](unsigned char c) { return std::isalnum(c) || c == '_'; });
}

std::filesystem::path Find(const std::string& program, const std::filesystem::path& folder) {
  if (program.find('/') != std::string::npos) return program;
  const std::filesystem::path own = folder / program;
  if (::access(own.c_str(), X_OK) == 0) return own;
  if (const auto found = FindInPath(program)) return *found;
  throw UsageError(program + ": no such program, neither in " + folder.string() + " nor in PATH");
}

}  // namespace

std::vector<std::string> ShellWords(const std::string& line, const std::string& where) {
  wordexp_t found{};
  const int status = ::wordexp(line.c_str(), &found, WRDE_NOCMD | WRDE_UNDEF);
  if (status != 0) {
    const char* why = status == WRDE_BADVAL    ? "a $VARIABLE that is not set"
                      : status == WRDE_BADCHAR ? "one of | & ; < > ( ) { } outside of quotes"
                      : status == WRDE_CMDSUB  ? "a command in a command"
                                               : "quotes that do not end";
    throw UsageError(where + " \"" + line + "\": " + why);
  }
  std::vector<std::string> words(found.we_wordv, found.we_wordv + found.we_wordc);
  ::wordfree(&found);
  return words;
}

std::optional<std::filesystem::path> FindInPath(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::filesystem::path full = std::filesystem::path(folder) / program;
    if (::access(full.c_str(), X_OK) == 0) return full;
  }
  return std::nullopt;
}

ChildCommand ParseExec(const std::string& exec, const std::filesystem::path& program_folder) {
  std::vector<std::string> words = ShellWords(exec, "exec");
  const auto program = std::find_if_not(words.begin(), words.end(), IsAssignment);
  if (program == words.end()) throw UsageError("exec \"" + exec + "\": no program");
  return {Find(*program, program_folder), {program, words.end()}, {words.begin(), program}};
}

}  // namespace vog
