#pragma once

#include <span>
#include <string>
#include <vector>

#include "lib/vogmap/map_options.h"
#include "tools/map/bench_scene.h"
#include "tools/map/bench_workload.h"

namespace vog {

/// A way to answer, and how to measure it.
struct BenchMethod {
  MapMethod method;
  /// Of one measurement, where each read looks into each submap; infinite where answers are
  /// remembered.
  double most_look_ups;
  int most_submaps;  ///< That fit in memory.

  std::string name() const { return NameOf(MapMethodNames(), method); }
};

const std::vector<BenchMethod>& AllBenchMethods();

/// Times of one method on one map.
struct MethodFigures {
  double query_ns = 0;  ///< A voxel.
  double ray_5m_ns = 0;
  double planning_step_ms = 0;
  double planning_step_after_closure_ms = 0;
  double planning_step_after_10_moved_ms = 0;
  std::size_t planning_step_rays = 0;  ///< How many were cast; the times are scaled to all.
  double collision_us = 0, collision_broad_us = 0;
};

/// Measures in the calling thread, warm unless the name says otherwise.
MethodFigures MeasureMethod(const BenchMethod& method, const BenchScene& scene,
                            std::span<const BenchSubmap> submaps, const BenchWorkload& workload);

}  // namespace vog
