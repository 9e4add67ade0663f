#include "lib/planner/view_planner.h"

#include "lib/planner/coverage_planner.h"
#include "lib/planner/nbv_planner.h"

namespace vog {

ViewPlan PlanOf(const NbvTree& tree) {
  ViewPlan plan;
  plan.tree = tree.nodes();
  plan.best = tree.best();
  plan.outcome = tree.best() != 0          ? ViewPlan::Outcome::kGo
                 : tree.nodes().size() < 2 ? ViewPlan::Outcome::kNoWay
                                           : ViewPlan::Outcome::kNothing;
  if (tree.best() != 0) plan.path = tree.BranchTo(tree.best());
  return plan;
}

std::unique_ptr<ViewPlanner> MakeViewPlanner(const PlannerOptions& options,
                                             const MotionLimits& limits, const SonarOptions& sonar,
                                             const Eigen::AlignedBox3d& box_W, std::int64_t seed) {
  if (options.kind == PlannerKind::kNextBestView)
    return std::make_unique<NbvPlanner>(options, sonar, box_W, seed);
  return std::make_unique<CoveragePlanner>(options, limits, sonar, box_W, seed);
}

}  // namespace vog
