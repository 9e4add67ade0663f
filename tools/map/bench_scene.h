#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "lib/base/random.h"
#include "lib/geometry/waypoint.h"
#include "lib/scan/scan.h"
#include "lib/scan/sonar.h"
#include "lib/submap/submap.h"
#include "lib/submap/submap_builder.h"
#include "sim/scene/scene_options.h"
#include "tools/mission/hull_space.h"

namespace vog {

/// A scan and where the body truly was.
struct PosedScan {
  Scan scan;
  Pose3 X_WB = Pose3::Identity();
};

/// A submap and where the map places it, a little off the truth.
struct BenchSubmap {
  SubmapPtr submap;
  Pose3 X_WM = Pose3::Identity();
};

/// A generated structure, and submaps of it such as a mission makes: of scans with a sweeping fan
/// on short straight ways through free water. Submap i depends on the seed and i alone.
class BenchScene {
 public:
  /// @pre kind is one of the generated structures.
  BenchScene(SceneKind kind, std::uint64_t seed);

  std::vector<PosedScan> ScansOf(SubmapId id) const;

  BenchSubmap SubmapOf(SubmapId id) const;

  /// A level pose in the box that the vehicle may move in, free or not.
  Waypoint AnyPose(Random& random) const;
  /// One where the vehicle's box touches nothing.
  Waypoint FreePose(Random& random) const;
  /// One of those at most `reach_m` away from `from`.
  Waypoint FreePoseNear(const Waypoint& from, double reach_m, Random& random) const;

  std::uint64_t seed() const { return seed_; }
  const SonarOptions& sonar() const { return sonar_; }
  double voxel_size_m() const { return submap_.voxel_size_m; }

 private:
  struct Way {
    Waypoint from, to;
  };

  Way WayOf(SubmapId id) const;
  Scan Ping(Time time, const Pose3& X_WB, Random& random) const;

  std::uint64_t seed_;
  SonarOptions sonar_;
  SubmapOptions submap_;
  Eigen::AlignedBox3d vehicle_box_W_;
  HullSpace space_;
};

/// The pose after a small change, such as a loop closure makes.
Pose3 Nudged(const Pose3& X_WM, Random& random);

/// Submaps 0 to `count` - 1, on all threads. `show(share)` is told how far it is.
std::vector<BenchSubmap> MakeSubmaps(const BenchScene& scene, int count,
                                     const std::function<void(double)>& show);

}  // namespace vog
