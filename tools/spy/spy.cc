#include "tools/spy/spy.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <sstream>
#include <vector>

#include "lib/base/errors.h"
#include "lib/base/files.h"
#include "lib/bus/stopwatch.h"
#include "tools/launch/child_process.h"

namespace vog {
namespace {

namespace fs = std::filesystem;

std::string Variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

std::vector<fs::path> PathsIn(const std::string& list) {
  std::vector<fs::path> paths;
  std::istringstream stream(list);
  for (std::string path; std::getline(stream, path, ':');)
    if (!path.empty()) paths.push_back(path);
  return paths;
}

[[noreturn]] void FailWithout(const std::string& what, const std::string& package) {
  throw SystemError("lcm-spy needs " + what + "; on Debian: apt-get install " + package);
}

fs::path FindProgram(const std::string& name, const std::string& package) {
  std::vector<fs::path> folders = PathsIn(Variable("PATH"));
  if (const std::string java_home = Variable("JAVA_HOME"); !java_home.empty())
    folders.insert(folders.begin(), fs::path(java_home) / "bin");
  for (const fs::path& folder : folders)
    if (::access((folder / name).c_str(), X_OK) == 0) return folder / name;
  FailWithout("the program " + name, package);
}

fs::path FindJar(const std::string& name, const std::string& package) {
  for (const fs::path& path : PathsIn(Variable("CLASSPATH")))
    if (path.filename() == name && fs::exists(path)) return path;
  for (const char* folder : {"/usr/share/java", "/usr/local/share/java"})
    if (fs::exists(fs::path(folder) / name)) return fs::path(folder) / name;
  FailWithout(name, package);
}

/// PATH below the folder of installed files; nothing where these programs are not installed.
std::optional<fs::path> Installed(const fs::path& path) {
  const fs::path found = ProgramFolder().parent_path() / "share/vogmap" / path;
  return fs::exists(found) ? std::optional(found) : std::nullopt;
}

/// The installed types, or those of the source tree around the program.
std::vector<fs::path> TypeFiles() {
  fs::path folder = Installed("lcmtypes").value_or("");
  fs::path above = ProgramFolder();
  for (; folder.empty() && above.has_relative_path(); above = above.parent_path())
    if (fs::exists(above / "lcmtypes/status_t.lcm")) folder = above / "lcmtypes";
  if (folder.empty()) throw SystemError("the folder lcmtypes is neither installed nor near here");
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.path().extension() == ".lcm") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

fs::path CacheFolder() {
  const std::string cache = Variable("XDG_CACHE_HOME"), home = Variable("HOME");
  if (cache.empty() && home.empty())
    throw SystemError("neither XDG_CACHE_HOME nor HOME says where to keep the types");
  return (cache.empty() ? fs::path(home) / ".cache" : fs::path(cache)) / "vogmap";
}

std::string ContentOf(const std::vector<fs::path>& files) {
  std::string content;
  for (const fs::path& file : files) content += file.filename().string() + "\n" + ReadFile(file);
  return content;
}

/// A folder in another one that goes when it is done with.
class WorkFolder {
 public:
  explicit WorkFolder(const fs::path& parent) {
    std::error_code error;
    fs::create_directories(parent, error);
    std::string pattern = (parent / "build-XXXXXX").string();
    if (::mkdtemp(pattern.data()) == nullptr)
      throw SystemError(parent.string() + ": cannot make a folder there: " + std::strerror(errno));
    path_ = pattern;
  }
  ~WorkFolder() {
    std::error_code error;
    fs::remove_all(path_, error);
  }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;

  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

void RunTool(const std::vector<std::string>& argv, const fs::path& output) {
  ChildProcess process({argv.front(), argv, {}}, output);
  while (!process.Ended()) WaitBriefly();
  if (*process.Ended() != 0)
    throw SystemError(argv.front() + ": " + HowItEnded(*process.Ended()) + ": " + LastLine(output));
}

void BuildJar(const std::vector<fs::path>& types, const fs::path& jar) {
  const std::string lcm_gen = FindProgram("lcm-gen", "liblcm-bin");
  const std::string javac = FindProgram("javac", "default-jdk-headless");
  const std::string archiver = FindProgram("jar", "default-jdk-headless");
  const std::string lcm_jar = FindJar("lcm.jar", "liblcm-java");
  const WorkFolder work(jar.parent_path());
  const fs::path source = work.path() / "source", classes = work.path() / "classes";
  const fs::path output = work.path() / "output.txt", built = work.path() / "types.jar";
  fs::create_directories(classes);
  std::vector<std::string> generate = {lcm_gen, "--java", "--jpath", source};
  generate.insert(generate.end(), types.begin(), types.end());
  RunTool(generate, output);
  std::vector<std::string> compile = {javac, "-nowarn", "-cp", lcm_jar, "-d", classes};
  for (const auto& entry : fs::recursive_directory_iterator(source))
    if (entry.path().extension() == ".java") compile.push_back(entry.path());
  RunTool(compile, output);
  RunTool({archiver, "cf", built, "-C", classes, "."}, output);
  fs::rename(built, jar);
}

}  // namespace

fs::path TypesJar() {
  if (const auto jar = Installed("vogmap-types.jar")) return *jar;
  const std::vector<fs::path> types = TypeFiles();
  const fs::path jar = CacheFolder() / ("types-" + ToHex(Crc32(ContentOf(types))) + ".jar");
  if (!fs::exists(jar)) BuildJar(types, jar);
  return jar;
}

void BecomeSpy(const std::string& url) {
  const std::string java = FindProgram("java", "default-jre");
  const std::string lcm_jar = FindJar("lcm.jar", "liblcm-java");
  const std::string chart_jar = FindJar("jchart2d.jar", "libjchart2d-java");
  const std::string class_path = lcm_jar + ":" + chart_jar + ":" + TypesJar().string();
  if (Variable("DISPLAY").empty())
    throw SystemError("lcm-spy needs a display: DISPLAY is not set; vog status needs none");
  ::setenv("LCM_DEFAULT_URL", url.c_str(), /*overwrite=*/1);
  ::execl(java.c_str(), "java", "-cp", class_path.c_str(), "lcm.spy.Spy", nullptr);
  throw SystemError(java + ": " + std::strerror(errno));
}

}  // namespace vog
