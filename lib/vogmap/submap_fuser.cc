#include "lib/vogmap/submap_fuser.h"

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <variant>

#include "lib/base/files.h"
#include "lib/submap/octree_file.h"
#include "lib/vogmap/fuse_submaps.h"

namespace vog {
namespace {

SubmapPtr WithGrid(const Submap& submap, BrickGrid grid) {
  return std::make_shared<Submap>(submap.base, submap.first_scan, submap.last_scan, submap.scans,
                                  submap.X_ML, submap.drift, std::move(grid));
}

bool SpheresMeet(const PlacedSubmap& a, const PlacedSubmap& b) {
  const double reach_m = 0.5 * (a.bounds_M.diagonal().norm() + b.bounds_M.diagonal().norm());
  return (a.X_WM * a.bounds_M.center() - b.X_WM * b.bounds_M.center()).norm() <= reach_m;
}

}  // namespace

SubmapFuser::SubmapFuser(SubmapMap& map, const FuseOptions& options, const SensorModel& model)
    : map_(map),
      options_(options),
      model_(model),
      tolerance_m_(options.tolerance_voxels * map.grid().voxel_size_m()) {}

void SubmapFuser::Place(SubmapPtr submap, const Pose3& X_WM) {
  const SubmapId id = submap->id();
  if (Has(id)) TakeApartGroupOf(id);
  map_.Place(submap, X_WM);
  PlacedSubmap placed{std::move(submap), X_WM, X_WM.inverse(), {}, 0};
  placed.bounds_M = placed.submap->grid.BrickBounds();
  if (const auto found = nodes_.find(id); found != nodes_.end())
    placed.sigma_m = found->second.placed.sigma_m;
  nodes_[id] = {std::move(placed), {}, 0};
}

void SubmapFuser::Move(const std::map<SubmapId, Pose3>& X_WM,
                       const std::vector<std::pair<SubmapId, double>>& sigmas_m) {
  for (const auto& [id, pose] : X_WM) {
    const auto found = nodes_.find(id);
    if (found == nodes_.end()) continue;
    found->second.placed.X_WM = pose;
    found->second.placed.X_MW = pose.inverse();
  }
  for (const auto& [id, sigma_m] : sigmas_m) {
    const auto found = nodes_.find(id);
    if (found != nodes_.end()) found->second.placed.sigma_m = sigma_m;
  }
  SplitDisagreeing();
  ShowPoses();
  if (options_.enabled) {
    JoinSettled();
    history_.push_back(X_WM);
    if (static_cast<int>(history_.size()) > options_.settled_versions) history_.pop_front();
  }
  ShowSigmas();
}

void SubmapFuser::Clear() {
  for (const SubmapId id : map_.ids()) map_.Remove(id);
  nodes_.clear();
  groups_.clear();
  full_.clear();
  history_.clear();
}

std::vector<SubmapId> SubmapFuser::ids() const {
  std::vector<SubmapId> ids;
  for (const auto& [id, node] : nodes_) ids.push_back(id);
  return ids;
}

SubmapPtr SubmapFuser::submap(SubmapId id) const {
  const Node& node = nodes_.at(id);
  if (!node.is_packed()) return node.placed.submap;
  return WithGrid(*node.placed.submap, GridOf(node));
}

std::size_t SubmapFuser::packed_bytes() const {
  std::size_t bytes = 0;
  for (const auto& [id, node] : nodes_) bytes += node.packed_grid.size();
  return bytes;
}

void SubmapFuser::Pack(Node& node) const {
  const std::string octree_bytes = ToOctreeBytes(node.placed.submap->grid);
  node.packed_grid = Compress(octree_bytes);
  node.octree_bytes = octree_bytes.size();
  node.placed.submap = WithGrid(*node.placed.submap, BrickGrid(map_.grid().voxel_size_m()));
}

BrickGrid SubmapFuser::GridOf(const Node& packed) {
  return std::get<BrickGrid>(FromOctreeBytes(*Decompress(packed.packed_grid, packed.octree_bytes)));
}

void SubmapFuser::Unpack(Node& node) const {
  node.placed.submap = WithGrid(*node.placed.submap, GridOf(node));
  node.packed_grid = {};
  node.octree_bytes = 0;
}

double SubmapFuser::DistanceBetween(const PlacedSubmap& placed, const Pose3& X_FM,
                                    const Pose3& other_X_FM) {
  // The distance is a convex function of the place: it is largest at a corner.
  double distance_m = 0;
  for (int i = 0; i < 8; ++i) {
    const Vec3 corner_M = placed.bounds_M.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i));
    distance_m = std::max(distance_m, (X_FM * corner_M - other_X_FM * corner_M).norm());
  }
  return distance_m;
}

void SubmapFuser::SplitDisagreeing() {
  std::vector<SubmapId> disagreeing;
  for (const auto& [first, group] : groups_) {
    if (Disagrees(nodes_.at(first), group)) disagreeing.push_back(first);
  }
  for (const SubmapId first : disagreeing) TakeApart(first);
}

bool SubmapFuser::Disagrees(const Node& first, const Group& group) const {
  return std::any_of(group.begin(), group.end(), [&](const auto& member) {
    const PlacedSubmap& placed = nodes_.at(member.first).placed;
    return DistanceBetween(placed, first.placed.X_MW * placed.X_WM, member.second) > tolerance_m_;
  });
}

void SubmapFuser::TakeApart(SubmapId first) {
  for (const auto& [id, X_FM] : groups_.at(first)) {
    Node& node = nodes_.at(id);
    Unpack(node);
    map_.Place(node.placed.submap, node.placed.X_WM);
  }
  groups_.erase(first);
  full_.erase(first);
  map_.Place(nodes_.at(first).placed.submap, nodes_.at(first).placed.X_WM);
}

void SubmapFuser::TakeApartGroupOf(SubmapId id) {
  const auto found = std::find_if(groups_.begin(), groups_.end(), [&](const auto& group) {
    return group.first == id || group.second.count(id) > 0;
  });
  if (found != groups_.end()) TakeApart(found->first);
}

void SubmapFuser::JoinSettled() {
  std::vector<SubmapId> firsts;
  std::map<SubmapId, std::vector<SubmapId>> joining;  // By the first that they join.
  int left = kMaxJoins;
  for (const auto& [id, node] : nodes_) {
    if (left == 0) break;
    if (node.is_packed()) continue;
    const auto first = std::find_if(firsts.begin(), firsts.end(),
                                    [&, id = id](SubmapId first) { return MayJoin(id, first); });
    if (first == firsts.end()) {
      firsts.push_back(id);
      continue;
    }
    // Its members have higher numbers: it is their turn after this.
    if (groups_.count(id)) TakeApart(id);
    joining[*first].push_back(id);
    --left;
  }
  for (const auto& [first, ids] : joining) Join(first, ids);
}

bool SubmapFuser::MayJoin(SubmapId id, SubmapId first) const {
  const PlacedSubmap& placed = nodes_.at(id).placed;
  const PlacedSubmap& into = nodes_.at(first).placed;
  return full_.count(first) == 0 && placed.sigma_m + into.sigma_m <= options_.max_sigma_m &&
         SpheresMeet(placed, into) && IsSettled(id, first) &&
         OverlapOf(placed, into) >= options_.min_overlap;
}

bool SubmapFuser::IsSettled(SubmapId id, SubmapId first) const {
  if (static_cast<int>(history_.size()) < options_.settled_versions) return false;
  const PlacedSubmap& placed = nodes_.at(id).placed;
  const Pose3 X_FM = nodes_.at(first).placed.X_MW * placed.X_WM;
  return std::all_of(history_.begin(), history_.end(), [&](const auto& X_WM) {
    const auto then = X_WM.find(id), first_then = X_WM.find(first);
    return then != X_WM.end() && first_then != X_WM.end() &&
           DistanceBetween(placed, X_FM, Ominus(first_then->second, then->second)) <= tolerance_m_;
  });
}

void SubmapFuser::Join(SubmapId first, const std::vector<SubmapId>& ids) {
  PlacedSubmap into = nodes_.at(first).placed;
  into.submap = map_.submap(first);
  std::vector<PlacedSubmap> others;
  for (const SubmapId id : ids) others.push_back(nodes_.at(id).placed);
  try {
    map_.Place(Fuse(into, others, model_), into.X_WM);
  } catch (const std::length_error&) {
    full_.insert(first);
    return;
  }
  for (const SubmapId id : ids) {
    Node& node = nodes_.at(id);
    groups_[first][id] = into.X_MW * node.placed.X_WM;
    Pack(node);
    map_.Remove(id);
  }
}

void SubmapFuser::ShowPoses() {
  std::vector<std::pair<SubmapId, Pose3>> poses_WM;
  for (const auto& [id, node] : nodes_) {
    if (!node.is_packed()) poses_WM.emplace_back(id, node.placed.X_WM);
  }
  map_.Move(poses_WM);
}

void SubmapFuser::ShowSigmas() {
  std::map<SubmapId, double> sigmas_m;
  for (const auto& [id, node] : nodes_) {
    if (!node.is_packed()) sigmas_m[id] = node.placed.sigma_m;
  }
  for (const auto& [first, group] : groups_) {
    for (const auto& [id, X_FM] : group)
      sigmas_m[first] = std::max(sigmas_m[first], nodes_.at(id).placed.sigma_m);
  }
  map_.SetSigmas({sigmas_m.begin(), sigmas_m.end()});
}

}  // namespace vog
