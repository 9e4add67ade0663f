#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "tools/map/bench_scene.h"

namespace vog {

struct CheckFigures {
  std::int64_t checks = 0, differences = 0;
};

/// Takes the fast map and the direct one through one random history, in which submaps come, some or
/// all move, go, and an open submap grows, and compares at least `checks` answers bit for bit:
/// those at points, and those to voxels, boxes and rays with eq. 5 at the voxels' centres.
/// `show(share)` is told how far it is.
CheckFigures CheckAnswers(const BenchScene& scene, std::span<const BenchSubmap> submaps,
                          std::int64_t checks, const std::function<void(double)>& show);

}  // namespace vog
