#include "lib/planner/nbv_planner.h"

namespace vog {
namespace {

constexpr int kTurns = 8;

}  // namespace

NbvPlanner::NbvPlanner(const PlannerOptions& options, const SonarOptions& sonar,
                       const Eigen::AlignedBox3d& box_W, std::int64_t seed)
    : options_(options),
      box_W_(box_W),
      seed_(seed),
      view_(sonar, options.range_m, options.ray_step_deg, box_W) {}

ViewPlan NbvPlanner::Plan(const OccupancyMap& map, const CollisionChecker& checker,
                          const Waypoint& at) {
  const TreeContext context{map, checker,
                            [&](const Waypoint& to) { return view_.Visible(map, to); }};
  Random random(static_cast<std::uint64_t>(seed_), "planner", static_cast<std::uint64_t>(trees_++));
  NbvTree tree(options_, box_W_, at);
  tree.AddBranch(context, remainder_);
  tree.GrowTo(context, options_.tree_nodes, random);
  if (tree.best() == 0) tree.AddTurns(context, kTurns);
  if (tree.best() == 0) tree.GrowTo(context, options_.max_tree_nodes, random);
  ViewPlan plan = PlanOf(tree);
  if (plan.outcome != ViewPlan::Outcome::kGo) return plan;
  remainder_.assign(plan.path.begin() + 2, plan.path.end());
  plan.path.resize(2);
  return plan;
}

}  // namespace vog
