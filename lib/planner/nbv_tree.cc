#include "lib/planner/nbv_tree.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vog {
namespace {

// A shorter piece of an edge is not worth a node.
constexpr double kMinEdge_m = 0.1;
constexpr int kSamplesPerNode = 20;

}  // namespace

NbvTree::NbvTree(const PlannerOptions& options, const Eigen::AlignedBox3d& box_W,
                 const Waypoint& root)
    : options_(options), box_W_(box_W), nodes_{TreeNode{.at = root}} {}

void NbvTree::AddBranch(const TreeContext& context, const std::vector<Waypoint>& waypoints) {
  for (const Waypoint& waypoint : waypoints) {
    const int parent = static_cast<int>(nodes_.size()) - 1;
    if (!context.checker.IsEdgeFree(context.map, nodes_[parent].at, waypoint)) return;
    AddView(context, parent, waypoint);
  }
}

Waypoint NbvTree::Sample(Random& random) const {
  Waypoint sample;
  for (int axis = 0; axis < 3; ++axis)
    sample.position_W_m[axis] = random.Uniform(box_W_.min()[axis], box_W_.max()[axis]);
  sample.yaw_rad = random.Uniform(-std::numbers::pi, std::numbers::pi);
  return sample;
}

template <class MakeSample, class Add>
void NbvTree::Grow(const TreeContext& context, int nodes, MakeSample make_sample, Add add) {
  const int max_samples = std::min(options_.max_samples, samples_ + kSamplesPerNode * nodes);
  for (; static_cast<int>(nodes_.size()) <= nodes && samples_ < max_samples; ++samples_) {
    const Waypoint sample = make_sample();
    const int parent = NearestTo(sample.position_W_m);
    const auto at = Steer(context, parent, sample);
    if (at && !add(parent, *at)) return;
  }
}

void NbvTree::GrowTo(const TreeContext& context, int nodes, Random& random) {
  Grow(
      context, nodes, [&] { return Sample(random); },
      [&](int parent, const Waypoint& at) {
        AddView(context, parent, at);
        return true;
      });
}

void NbvTree::Spread(const TreeContext& context, int nodes, Random& random) {
  Grow(
      context, nodes, [&] { return Sample(random); },
      [&](int parent, const Waypoint& at) { return AddNode(parent, at) > 0; });
}

int NbvTree::GrowToward(const TreeContext& context, const Waypoint& target, int nodes,
                        Random& random) {
  Grow(
      context, nodes, [&] { return samples_ % 2 == 0 ? target : Sample(random); },
      [&](int parent, const Waypoint& at) {
        AddNode(parent, at);
        return LengthOf(at, target) > kMinEdge_m;
      });
  return NearestTo(target.position_W_m);
}

void NbvTree::AddTurns(const TreeContext& context, int turns) {
  const Waypoint root = nodes_.front().at;
  for (int i = 1; i < turns; ++i) {
    const Waypoint turned{root.position_W_m,
                          WrapAngle(root.yaw_rad + 2 * std::numbers::pi * i / turns)};
    if (context.checker.IsEdgeFree(context.map, root, turned)) AddView(context, 0, turned);
  }
}

/// The waypoint that an edge from `parent` towards `at` ends in: no longer than the longest edge,
/// and cut where it is no longer free, because in tight space whole edges seldom fit.
std::optional<Waypoint> NbvTree::Steer(const TreeContext& context, int parent,
                                       const Waypoint& at) const {
  const Waypoint& from = nodes_[parent].at;
  const double share = std::min(1.0, options_.max_edge_m / std::max(LengthOf(from, at), 1e-9));
  const Waypoint to{from.position_W_m + share * (at.position_W_m - from.position_W_m), at.yaw_rad};
  const double free = context.checker.FreeFractionOf(context.map, from, to);
  if (free == 1) return to;
  if (free * LengthOf(from, to) < kMinEdge_m) return std::nullopt;
  return Interpolate(from, to, free);
}

int NbvTree::NearestTo(const Vec3& p_W) const {
  const auto nearest =
      std::min_element(nodes_.begin(), nodes_.end(), [&](const TreeNode& a, const TreeNode& b) {
        return (a.at.position_W_m - p_W).squaredNorm() < (b.at.position_W_m - p_W).squaredNorm();
      });
  return static_cast<int>(nearest - nodes_.begin());
}

int NbvTree::AddNode(int parent, const Waypoint& at) {
  TreeNode node{.at = at, .parent = parent};
  node.edge_m = LengthOf(nodes_[parent].at, at);
  node.from_root_m = nodes_[parent].from_root_m + node.edge_m;
  nodes_.push_back(node);
  return static_cast<int>(nodes_.size()) - 1;
}

void NbvTree::AddView(const TreeContext& context, int parent, const Waypoint& at) {
  const int index = AddNode(parent, at);
  TreeNode& node = nodes_[index];
  node.visible = context.visible(at);
  if (node.visible < options_.zero_gain_voxels) node.visible = 0;
  const double cost_m = options_.discount == Discount::kEdge ? node.edge_m : node.from_root_m;
  node.gain = nodes_[parent].gain + node.visible * std::exp(-options_.lambda_1_m * cost_m);
  if (node.gain > nodes_[best_].gain) best_ = index;
}

std::vector<Waypoint> NbvTree::BranchTo(int index) const {
  std::vector<Waypoint> branch;
  for (int i = index; i >= 0; i = nodes_[i].parent) branch.push_back(nodes_[i].at);
  std::reverse(branch.begin(), branch.end());
  return branch;
}

}  // namespace vog
