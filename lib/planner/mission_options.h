#pragma once

#include <cstdint>
#include <string>

#include "lib/base/config.h"

namespace vog {

/// Which map the vehicle explores on.
enum class MissionMode {
  kVog,       ///< The VOG-map with loop closures.
  kVogNoLc,   ///< The VOG-map at odometry poses.
  kStandard,  ///< One global OctoMap at odometry poses.
};

/// What follows when nothing is left to gain or a budget is used.
enum class WhenDone {
  kEnd,      ///< Stay there.
  kReturn,   ///< Go home through known free space.
  kRevisit,  ///< Visit old places again until the budget is used, then stay there.
};

/// The names of a mode in configuration files, messages and on the command line.
inline const Names<MissionMode>& MissionModeNames() {
  static const Names<MissionMode> names = {{MissionMode::kVog, "vog"},
                                           {MissionMode::kVogNoLc, "vog-no-lc"},
                                           {MissionMode::kStandard, "standard"}};
  return names;
}

/// Table [mission].
struct MissionOptions {
  std::string name = "mission";
  MissionMode mode = MissionMode::kVog;
  std::int64_t seed = 1;
  int max_submaps = 156;
  double max_duration_s = 0;
  double max_distance_m = 0;
  WhenDone when_done = WhenDone::kReturn;

  void Visit(OptionsVisitor& v) {
    v("name", name, "of the mission, for reports");
    v("mode", mode, MissionModeNames(), "the map that is explored on");
    v("seed", seed, AtLeast(0), "of all that is random: equal seeds give equal runs");
    v("max_submaps", max_submaps, Between(1, 1e6), "the mission's budget");
    v("max_duration_s", max_duration_s, Between(0, 1e7),
      "and in time, as a battery gives; 0: none");
    v("max_distance_m", max_distance_m, Between(0, 1e6), "and in length of the way; 0: none");
    v("when_done", when_done,
      Names<WhenDone>{
          {WhenDone::kEnd, "end"}, {WhenDone::kReturn, "return"}, {WhenDone::kRevisit, "revisit"}},
      "when nothing is left to gain: stay there, go home, or visit old places again until the "
      "budget is used; when it is used: go home (return), or stay there");
  }
};

}  // namespace vog
