#include <benchmark/benchmark.h>

#include <cstdlib>

#include "lib/base/parallel.h"
#include "lib/occupancy/ray_answers.h"
#include "lib/submap/octree_file.h"
#include "lib/vogmap/map_folder.h"

// How long a saved map of many submaps takes from nothing to its first answer. It is made once, in
// the folder that VOG_BENCHMARK_MAP names, which is left there for the next time.

namespace vog {
namespace {

constexpr int kSubmaps = 10'000;
constexpr double kVoxel_m = 0.1;

/// A piece of a wall: 18,048 known voxels in 120 bricks, no two of them alike.
BrickGrid WallOf(SubmapId id) {
  BrickGrid grid(kVoxel_m);
  unsigned noise = static_cast<unsigned>(id) + 1;
  for (int z = 0; z < 3; ++z)
    for (int y = 0; y < 96; ++y)
      for (int x = 0; x < (z < 2 ? 80 : 28); ++x) {
        noise = noise * 1664525 + 1013904223;
        grid.At({x, y, z}) = static_cast<LogOddsUnits>((z == 1 ? 60 : -60) + (noise >> 28));
      }
  return grid;
}

/// Walls side by side in a square, as a survey of a sea floor leaves them.
StoredMap MakeLargeMap() {
  StoredMap map;
  map.voxel_size_m = kVoxel_m;
  map.complete = true;
  for (SubmapId id = 0; id < kSubmaps; ++id) {
    Submap submap{.base = {}, .first_scan = {}, .last_scan = {}, .grid = WallOf(id)};
    submap.base.id = id;
    map.X_WM[id] = MakePose({7.0 * (id % 100), 8.0 * (id / 100), 0}, RollPitchYaw{0, 0, 0.1});
    map.submaps.push_back(std::make_shared<Submap>(std::move(submap)));
  }
  return map;
}

std::filesystem::path LargeMap() {
  const char* name = std::getenv("VOG_BENCHMARK_MAP");
  const std::filesystem::path folder =
      name != nullptr ? name : std::filesystem::temp_directory_path() / "vog_large_map";
  if (!IsMapFolder(folder)) SaveMapFolder(MakeLargeMap(), folder);
  return folder;
}

void OpenAndCastARay(benchmark::State& state, CompactUse use) {
  const std::filesystem::path folder = LargeMap();
  SetParallelThreads(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    const LoadedMap loaded = LoadMapFolder(folder, use);
    const VogMap map = ToVogMap(loaded.map);
    const RayAnswers ray = AnswersInVoxels(map, Vec3(300, 400, 3), Vec3(0, 0, -1), 10);
    if (ray.log_odds.empty() || !map.IsOccupied(ray.log_odds.back()))
      state.SkipWithError("the ray hit nothing");
    state.counters["octrees_read"] = static_cast<double>(loaded.octrees_read);
  }
}
BENCHMARK_CAPTURE(OpenAndCastARay, compact, CompactUse::kAllowed)
    ->Arg(1)
    ->Arg(2)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(OpenAndCastARay, octrees, CompactUse::kForbidden)
    ->Arg(1)
    ->Arg(2)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace vog
