#include "lib/baselines/make_submap_map.h"

#include "lib/baselines/algorithm1.h"
#include "lib/baselines/direct_map.h"
#include "lib/baselines/incremental_merge.h"
#include "lib/vogmap/vog_map.h"

namespace vog {

std::unique_ptr<SubmapMap> MakeSubmapMap(MapMethod method, double voxel_size_m,
                                         const SensorModel& model) {
  switch (method) {
    case MapMethod::kDirect:
      return std::make_unique<DirectMap>(voxel_size_m, model);
    case MapMethod::kAlgorithm1:
      return std::make_unique<Algorithm1Map>(voxel_size_m, model);
    case MapMethod::kIncrementalMerge:
      return std::make_unique<IncrementalMergeMap>(voxel_size_m, model);
    case MapMethod::kCached:
      break;
  }
  return std::make_unique<VogMap>(voxel_size_m, model);
}

}  // namespace vog
