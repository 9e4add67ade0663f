#include "lib/base/log.h"

#include <errno.h>

#include <cstdio>
#include <exception>
#include <string>

#include "lib/base/errors.h"

namespace vog {

void LogLine(std::string_view text) {
  // One write, so that lines of several processes on one terminal do not mix.
  const std::string line =
      std::string(program_invocation_short_name) + ": " + std::string(text) + "\n";
  std::fwrite(line.data(), 1, line.size(), stderr);
}

int RunMain(const std::function<int()>& body) {
  try {
    return body();
  } catch (const UsageError& error) {
    LogLine(error.what());
    return 2;
  } catch (const std::exception& error) {
    LogLine(error.what());
    return 1;
  }
}

}  // namespace vog
