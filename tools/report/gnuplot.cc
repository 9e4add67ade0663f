#include "tools/report/gnuplot.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <vector>

#include "lib/base/errors.h"
#include "lib/base/files.h"

namespace vog {
namespace {

namespace fs = std::filesystem;

constexpr const char* kProgram = "gnuplot";

/// A new folder that goes with its owner.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "vog-report-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr)
      throw SystemError(name + ": cannot create: " + std::strerror(errno));
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

void WriteText(const fs::path& path, std::string_view text) {
  std::ofstream file(path, std::ios::binary);
  file.write(text.data(), static_cast<std::streamsize>(text.size()));
  if (!file.flush()) throw SystemError(path.string() + ": cannot write; is the disk full?");
}

/// Our environment with a locale that writes numbers and reads labels in one way everywhere.
std::vector<std::string> PlainEnvironment() {
  std::vector<std::string> variables = {"LC_ALL=C.UTF-8"};
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const std::string_view text(*variable);
    if (!text.starts_with("LC_ALL=") && !text.starts_with("GNUTERM=")) variables.emplace_back(text);
  }
  return variables;
}

std::vector<char*> PointersTo(std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (std::string& text : texts) pointers.push_back(text.data());
  pointers.push_back(nullptr);
  return pointers;
}

/// Where a child starts and what its streams are.
class SpawnActions {
 public:
  explicit SpawnActions(const fs::path& folder) {
    ::posix_spawn_file_actions_init(&actions_);
    ::posix_spawn_file_actions_addchdir_np(&actions_, folder.c_str());
    ::posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    ::posix_spawn_file_actions_addopen(&actions_, STDOUT_FILENO, "errors.txt",
                                       O_WRONLY | O_CREAT | O_APPEND, 0600);
    ::posix_spawn_file_actions_adddup2(&actions_, STDOUT_FILENO, STDERR_FILENO);
  }
  ~SpawnActions() { ::posix_spawn_file_actions_destroy(&actions_); }
  SpawnActions(const SpawnActions&) = delete;
  SpawnActions& operator=(const SpawnActions&) = delete;

  const posix_spawn_file_actions_t* get() const { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_;
};

/// Runs the program in `folder` and returns its exit status, -1 for a violent end.
int RunIn(const fs::path& folder, std::vector<std::string> arguments) {
  std::vector<std::string> environment = PlainEnvironment();
  const SpawnActions actions(folder);
  pid_t pid = -1;
  const int error = ::posix_spawnp(&pid, kProgram, actions.get(), nullptr,
                                   PointersTo(arguments).data(), PointersTo(environment).data());
  if (error != 0)
    throw SystemError(std::string("gnuplot: cannot start: ") + std::strerror(error) +
                      "; install the package gnuplot-nox to have reports");
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0) {
    if (errno != EINTR) throw SystemError(std::string("gnuplot: ") + std::strerror(errno));
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// What gnuplot complains of, on one line.
std::string Complaint(const fs::path& folder) {
  std::ifstream file(folder / "errors.txt");
  std::string text;
  for (std::string line; std::getline(file, line);) {
    const std::size_t start = line.find_first_not_of(" \t^");
    if (start != std::string::npos) text += (text.empty() ? "" : "; ") + line.substr(start);
  }
  return text.empty() ? "no picture" : text;
}

std::string Preamble(const Plot& plot) {
  const auto size = [&](int scale) {
    return std::to_string(scale * plot.width_px) + "," + std::to_string(scale * plot.height_px);
  };
  // Ids in an SVG count from 1 in each picture; they do not meet, as each is an image of its own.
  const std::string terminal =
      plot.format == PictureFormat::kSvg
          ? "set terminal svg noenhanced size " + size(1) +
                " fixed background '#ffffff' font 'Helvetica,Arial,sans-serif,12'\n"
          : "set terminal pngcairo noenhanced size " + size(2) +
                " background '#ffffff' font 'Liberation Sans,10' fontscale 2 linewidth 2 "
                "pointscale 2\n";
  return "set encoding utf8\n" + terminal +
         "set output 'picture'\nset style data lines\nset border lc rgb '#57606a'\n"
         "set tics nomirror\n";
}

}  // namespace

Picture DrawPlot(const Plot& plot) {
  const TemporaryFolder folder;
  for (const auto& [name, content] : plot.data) WriteText(folder.path() / name, content);
  WriteText(folder.path() / "script.gp", Preamble(plot) + plot.commands + "\nunset output\n");
  const int status = RunIn(folder.path(), {kProgram, "-d", "script.gp"});
  const fs::path picture = folder.path() / "picture";
  std::error_code error;
  if (status != 0 || fs::file_size(picture, error) == 0 || error)
    throw SystemError("gnuplot: " + Complaint(folder.path()));
  return {plot.format, plot.width_px, plot.height_px, ReadFile(picture)};
}

bool HasGnuplot() {
  const char* const path = std::getenv("PATH");
  std::string_view rest = path == nullptr ? "" : path;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(':'), rest.size());
    if (::access((fs::path(rest.substr(0, end)) / kProgram).c_str(), X_OK) == 0) return true;
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return false;
}

std::string DataLine(std::initializer_list<double> numbers) {
  std::string line;
  for (const double number : numbers) {
    if (!line.empty()) line += ' ';
    line += std::isfinite(number) ? PlotNumber(number) : "NaN";
  }
  return line + "\n";
}

std::string PlotText(std::string_view text) {
  std::string quoted = "'";
  for (const char c : text) {
    if (c == '\'') quoted += '\'';
    quoted += c == '\n' ? ' ' : c;
  }
  return quoted + "'";
}

std::string PlotNumber(double value, int digits) {
  std::array<char, 40> text;
  std::snprintf(text.data(), text.size(), "%.*g", digits, value);
  return text.data();
}

}  // namespace vog
