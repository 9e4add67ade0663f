#include "tools/status/status.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdio>

#include "lib/base/errors.h"
#include "lib/bus/process.h"
#include "tools/status/render.h"

namespace vog {
namespace {

constexpr Duration kPeriod = std::chrono::seconds(1);
constexpr Duration kOnce = std::chrono::seconds(2);
constexpr Duration kStep = std::chrono::milliseconds(50);

/// Shows one picture after the other: on a terminal in the same place.
class Screen {
 public:
  explicit Screen(bool is_single) : is_terminal_(!is_single && ::isatty(STDOUT_FILENO) != 0) {
    if (is_terminal_) std::fputs("\033[2J", stdout);
  }

  void Show(const std::vector<std::string>& lines) const {
    if (is_terminal_) {
      ShowInPlace(lines);
    } else {
      for (const std::string& line : lines) std::printf("%s\n", line.c_str());
    }
    std::fflush(stdout);
  }

 private:
  static void ShowInPlace(const std::vector<std::string>& lines) {
    winsize size{};
    if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_row == 0) size = {24, 80, 0, 0};
    std::fputs("\033[H", stdout);
    for (std::size_t i = 0; i < lines.size() && i + 1u < size.ws_row; ++i)
      std::printf("%s\033[K\n", lines[i].substr(0, size.ws_col).c_str());
    std::fputs("\033[J", stdout);
  }

  bool is_terminal_;
};

std::vector<std::string> Picture(const SystemView& view, Time now, const StatusOptions& options) {
  if (options.json)
    return {RenderJson(view, now).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)};
  std::vector<std::string> lines = RenderText(view, now);
  if (!options.once) lines.insert(lines.begin(), {"vog status   " + options.url, ""});
  return lines;
}

}  // namespace

void ShowStatus(const StatusOptions& options) {
  BusOptions bus_options;
  bus_options.url = options.url;
  LcmBus bus(bus_options);
  SystemView view(FromUtime(bus.epoch()));
  const Screen screen(options.once || options.json);
  bus.SubscribeAll([&](Time now, const std::string& channel, Bytes bytes) {
    view.OnMessage(now, channel, bytes);
  });
  bool is_shown = false;
  bus.Every(options.once ? kOnce : kPeriod, [&](Time now) {
    view.Sample(now);
    if (options.once && view.channels().empty())
      throw SystemError("nothing is heard on " + options.url);
    screen.Show(Picture(view, now, options));
    is_shown = true;
  });
  const std::atomic<bool>& stop = StopSignal();
  while (!stop && !(options.once && is_shown)) bus.RunFor(kStep);
}

}  // namespace vog
