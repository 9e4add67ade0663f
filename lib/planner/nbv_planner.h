#pragma once

#include <cstdint>
#include <vector>

#include "lib/planner/planner_options.h"
#include "lib/planner/view_gain.h"
#include "lib/planner/view_planner.h"

namespace vog {

/// The planner of section IV-B: grows a tree of random views around the vehicle, flies the first
/// edge of its best branch, and begins the next tree with the rest of it. Beyond the paper: a tree
/// that cannot reach N_max nodes is used as it is, and where none gains, turns on the spot are
/// tried.
class NbvPlanner final : public ViewPlanner {
 public:
  NbvPlanner(const PlannerOptions& options, const SonarOptions& sonar,
             const Eigen::AlignedBox3d& box_W, std::int64_t seed);

  ViewPlan Plan(const OccupancyMap& map, const CollisionChecker& checker,
                const Waypoint& at) override;
  void Forget() override { remainder_.clear(); }

 private:
  PlannerOptions options_;
  Eigen::AlignedBox3d box_W_;
  std::int64_t seed_;
  ViewGain view_;
  std::int64_t trees_ = 0;
  std::vector<Waypoint> remainder_;  // Of the last best branch, behind its first edge.
};

}  // namespace vog
