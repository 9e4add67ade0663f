#pragma once

#include <cstdint>
#include <vector>

#include "lib/vogmap/map_options.h"
#include "sim/scene/scene_options.h"

namespace vog {

struct BenchOptions {
  SceneKind scene = SceneKind::kTank;
  std::uint64_t seed = 1;
  std::vector<int> submaps = {75, 156, 1000};
  std::vector<MapMethod> methods = {};  ///< All when empty.
  std::int64_t checks = 1'000'000;
  bool json = false;
};

/// Makes submaps from a seed, compares the answers of the fast map with eq. 5, measures each method
/// on maps of each size in one thread, and prints a table or JSON.
/// @throws std::runtime_error when answers differ.
void BenchMaps(const BenchOptions& options);

}  // namespace vog
