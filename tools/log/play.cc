#include "tools/log/play.h"

#include <algorithm>
#include <cstdio>

#include "lib/bus/process.h"
#include "lib/bus/stopwatch.h"
#include "tools/log/keyboard.h"
#include "tools/log/log_player.h"

namespace vog {
namespace {

constexpr double kLongestWait_s = 0.02;  // A key is answered after this at most.
constexpr double kSkip_s = 10;
constexpr double kSpeedStep = 1.25992105;  // Three keys double it.

void Obey(Key key, LogPlayer& player, double wall_s) {
  switch (key) {
    case Key::kPause:
      player.TogglePause(wall_s);
      break;
    case Key::kStep:
      player.StepOne(wall_s);
      break;
    case Key::kFaster:
      player.SetSpeed(std::min(player.speed() * kSpeedStep, 1000.0), wall_s);
      break;
    case Key::kSlower:
      player.SetSpeed(std::max(player.speed() / kSpeedStep, 0.001), wall_s);
      break;
    case Key::kForward:
      player.Skip(kSkip_s, wall_s);
      break;
    case Key::kBack:
      player.Skip(-kSkip_s, wall_s);
      break;
    case Key::kQuit:
      break;
  }
}

/// A line that stays in its place.
class PositionLine {
 public:
  explicit PositionLine(bool is_shown) : is_shown_(is_shown) {
    if (is_shown_)
      std::fputs("space pause, s step, + - speed, arrows 10 s back and forward, q quit\n", stderr);
  }
  ~PositionLine() {
    if (is_shown_) std::fputs("\n", stderr);
  }
  PositionLine(const PositionLine&) = delete;
  PositionLine& operator=(const PositionLine&) = delete;

  void Show(const LogPlayer& player, double wall_s) const {
    if (!is_shown_) return;
    std::fprintf(stderr, "\r\033[K%.1f s   x %.2g   %lld messages%s", player.PositionAt(wall_s),
                 player.speed(), static_cast<long long>(player.published()),
                 player.is_paused() ? "   paused" : "");
    std::fflush(stderr);
  }

 private:
  bool is_shown_;
};

}  // namespace

void PlayLog(const PlayOptions& options) {
  BusOptions bus_options;
  bus_options.url = options.url;
  LcmBus bus(bus_options);
  LogPlayer player(options.log, options.selection, options.speed, options.is_endless,
                   [&](const std::string& channel, Bytes bytes) { bus.Publish(channel, bytes); });
  const Keyboard keyboard;
  const PositionLine line(keyboard.IsThere());
  const Stopwatch clock;
  const std::atomic<bool>& stop = StopSignal();
  while (!stop && !player.HasEnded()) {
    const double wait_s = player.Play(clock.seconds()).value_or(kLongestWait_s);
    for (const Key key : keyboard.Read()) {
      if (key == Key::kQuit) return;
      Obey(key, player, clock.seconds());
    }
    line.Show(player, clock.seconds());
    if (wait_s > 0) bus.RunFor(FromSeconds(std::clamp(wait_s, 1e-6, kLongestWait_s)));
  }
}

}  // namespace vog
