#include "lib/collision/collision_checker.h"

#include <fcl/geometry/shape/box.h>
#include <fcl/narrowphase/collision.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vog {
namespace {

constexpr int kPieceSamples = 8;

}  // namespace

void FreeBubble::LookInto(double yaw_rad, double beside_rad) {
  for (int sector = 0; sector < kSectors; ++sector) {
    const double middle_rad = (sector + 0.5) * 2 * std::numbers::pi / kSectors;
    if (std::abs(WrapAngle(middle_rad - yaw_rad)) < beside_rad)
      looked.set(static_cast<std::size_t>(sector));
  }
}

bool FreeBubble::Holds(const Vec3& p_W) const {
  const Vec3 away_m = p_W - center_W_m;
  if (away_m.norm() >= radius_m) return false;
  if (away_m.head<2>().norm() < core_radius_m) return true;
  const double turns = std::atan2(away_m.y(), away_m.x()) / (2 * std::numbers::pi);
  const int sector = static_cast<int>(std::floor((turns + 1) * kSectors)) % kSectors;
  return looked[static_cast<std::size_t>(sector)];
}

CollisionChecker::CollisionChecker(const CollisionRules& rules) : rules_(rules) {}

CollisionChecker CollisionChecker::Scaled(double share) const {
  CollisionChecker scaled = *this;
  scaled.rules_.clearance_m *= share;
  scaled.rules_.unknown_clearance_m *= share;
  scaled.rules_.uncertainty_sigmas *= share;
  return scaled;
}

CollisionChecker CollisionChecker::GrowingBy(double share) const {
  CollisionChecker growing = *this;
  growing.rules_.uncertainty_sigmas *= share;
  return growing;
}

CollisionChecker CollisionChecker::ForSure(double sigma_m, double unsure_share) const {
  CollisionChecker sure = *this;
  sure.rules_.sure_sigma_m = sigma_m;
  sure.rules_.unsure_share = unsure_share;
  return sure;
}

CollisionChecker CollisionChecker::PassingUnknown() const {
  CollisionChecker passing = *this;
  passing.rules_.unknown_blocks = false;
  return passing;
}

void CollisionChecker::SetPresence(const Waypoint& at, double margin_m, Presence presence) {
  X_PW_ = at.X_WB().inverse();
  presence_half_m_ = 0.5 * rules_.hull_size_m + Vec3::Constant(margin_m);
  presence_ = presence;
}

bool CollisionChecker::IsInsideHull(const Vec3& p_W) const {
  return ((X_PW_ * p_W).cwiseAbs().array() < presence_half_m_.array()).all();
}

Eigen::AlignedBox3d CollisionChecker::PresenceBounds() const {
  const Pose3 X_WP = X_PW_.inverse();
  const Vec3 half_m = X_WP.linear().cwiseAbs() * presence_half_m_;
  return {X_WP.translation() - half_m, X_WP.translation() + half_m};
}

bool CollisionChecker::TakesForFree(bool is_occupied, const Vec3& p_W) const {
  if (is_occupied) return presence_ == Presence::kCoversOccupied && IsInsideHull(p_W);
  return !rules_.unknown_blocks || IsInsideHull(p_W) ||
         std::any_of(bubbles_.begin(), bubbles_.end(),
                     [&](const FreeBubble& bubble) { return bubble.Holds(p_W); });
}

Eigen::AlignedBox3d CollisionChecker::SweptBounds(const OccupancyMap& map, const Waypoint& from,
                                                  const Waypoint& to) const {
  const double clearance_m = std::max(rules_.clearance_m, rules_.unknown_clearance_m);
  const double uncertainty_m =
      std::min(rules_.max_uncertainty_m, rules_.uncertainty_sigmas * map.max_sigma_m());
  // The box may turn on the way: its corners stay within this cylinder.
  const double radius_m = 0.5 * rules_.hull_size_m.head<2>().norm() +
                          std::numbers::sqrt2 * (clearance_m + uncertainty_m);
  const Vec3 reach(radius_m, radius_m, 0.5 * rules_.hull_size_m.z() + clearance_m);
  Eigen::AlignedBox3d bounds(from.position_W_m);
  bounds.extend(to.position_W_m);
  return {bounds.min() - reach, bounds.max() + reach};
}

void CollisionChecker::FindObstacles(const OccupancyMap& map,
                                     const Eigen::AlignedBox3d& bounds_W) const {
  obstacles_.clear();
  occupied_.clear();
  map.NotFreeIn(VoxelsOf(map.grid(), bounds_W), not_free_);
  for (const VoxelAnswer& voxel : not_free_) {
    const Vec3 center_W = map.grid().CenterOf(voxel.key);
    const bool is_occupied = map.IsOccupied(voxel.log_odds);
    if (TakesForFree(is_occupied, center_W)) continue;
    if (is_occupied) {
      occupied_.push_back(voxel.key);
    } else {
      obstacles_.push_back({center_W, Vec3::Constant(rules_.unknown_clearance_m)});
    }
  }
  sigma_m_.assign(occupied_.size(), 0);
  if (rules_.uncertainty_sigmas * map.max_sigma_m() > 0) map.SigmaOf(occupied_, sigma_m_);
  const double voxel_radius_m = map.grid().voxel_size_m() * std::numbers::sqrt3 / 2;
  for (std::size_t o = 0; o < occupied_.size(); ++o) {
    const Vec3 center_W = map.grid().CenterOf(occupied_[o]);
    obstacles_.push_back({center_W, ClearanceFrom(center_W, sigma_m_[o], voxel_radius_m)});
  }
}

Vec3 CollisionChecker::ClearanceFrom(const Vec3& center_W, double sigma_m,
                                     double voxel_radius_m) const {
  const double growth_m = rules_.GrowthFor(sigma_m);
  const Vec3 clearance_m =
      Vec3::Constant(rules_.ShareFor(sigma_m) * rules_.clearance_m) + Vec3(growth_m, growth_m, 0);
  if (presence_ != Presence::kCoversOccupied) return clearance_m;
  const Vec3 beside_m = (X_PW_ * center_W).cwiseAbs() - 0.5 * rules_.hull_size_m;
  return clearance_m.cwiseMin(std::max(0.0, beside_m.maxCoeff() - voxel_radius_m));
}

bool CollisionChecker::EntersKeepOut(const Pose3& X_BW) const {
  const fcl::Boxd hull(rules_.hull_size_m);
  return std::any_of(keep_out_W_.begin(), keep_out_W_.end(), [&](const Eigen::AlignedBox3d& box_W) {
    const fcl::Boxd box(Vec3(box_W.sizes()));
    fcl::CollisionResultd result;
    return fcl::collide<double>(&hull, Pose3::Identity(), &box, X_BW * MakePose(box_W.center()),
                                fcl::CollisionRequestd(), result) > 0;
  });
}

bool CollisionChecker::Touches(const Waypoint& at, double voxel_size_m) const {
  const Pose3 X_BW = at.X_WB().inverse();
  if (EntersKeepOut(X_BW)) return true;
  const double voxel_radius_m = voxel_size_m * std::numbers::sqrt3 / 2;
  const fcl::Boxd voxel(voxel_size_m, voxel_size_m, voxel_size_m);
  for (const Obstacle& obstacle : obstacles_) {
    const Vec3 half_m = 0.5 * rules_.hull_size_m + obstacle.clearance_m;
    const Vec3 center_B = X_BW * obstacle.center_W_m;
    if ((center_B.cwiseAbs().array() > half_m.array() + voxel_radius_m).any()) continue;
    // A voxel whose centre is inside needs no FCL.
    if ((center_B.cwiseAbs().array() <= half_m.array()).all()) return true;
    Pose3 X_BV = X_BW;
    X_BV.translation() = center_B;
    const fcl::Boxd hull(2 * half_m);
    fcl::CollisionResultd result;
    if (fcl::collide<double>(&hull, Pose3::Identity(), &voxel, X_BV, fcl::CollisionRequestd(),
                             result) > 0)
      return true;
  }
  return false;
}

int CollisionChecker::SamplesOf(const OccupancyMap& map, const Waypoint& from,
                                const Waypoint& to) const {
  const double corner_m = 0.5 * rules_.hull_size_m.head<2>().norm();
  const double travel_m =
      LengthOf(from, to) + corner_m * std::abs(WrapAngle(to.yaw_rad - from.yaw_rad));
  return std::max(1, static_cast<int>(std::ceil(travel_m / (0.5 * map.grid().voxel_size_m()))));
}

bool CollisionChecker::IsFree(const OccupancyMap& map, const Waypoint& at) const {
  FindObstacles(map, SweptBounds(map, at, at));
  return !Touches(at, map.grid().voxel_size_m());
}

bool CollisionChecker::IsEdgeFree(const OccupancyMap& map, const Waypoint& from,
                                  const Waypoint& to) const {
  return FreeFractionOf(map, from, to) == 1;
}

bool CollisionChecker::IsSurelyKnown(const OccupancyMap& map, const Waypoint& from,
                                     const Waypoint& to) const {
  if (map.IsSure()) return true;
  const Vec3 half_m = 0.5 * rules_.hull_size_m;
  const double reach_m = half_m.head<2>().norm();
  const int samples = SamplesOf(map, from, to);
  std::vector<VoxelKey> passed;
  for (int i = 0; i <= samples; i += kPieceSamples / 2) {
    const Waypoint at = Interpolate(from, to, static_cast<double>(i) / samples);
    const Pose3 X_BW = at.X_WB().inverse();
    const Vec3 reach(reach_m, reach_m, half_m.z());
    passed.clear();
    ForEachVoxel(VoxelsOf(map.grid(), {at.position_W_m - reach, at.position_W_m + reach}),
                 [&](const VoxelKey& voxel) {
                   const Vec3 center_W = map.grid().CenterOf(voxel);
                   const bool is_passed =
                       ((X_BW * center_W).cwiseAbs().array() < half_m.array()).all();
                   if (is_passed && !IsInsideHull(center_W)) passed.push_back(voxel);
                 });
    if (!map.IsSurelyKnown(passed)) return false;
  }
  return true;
}

double CollisionChecker::FreeFractionOf(const OccupancyMap& map, const Waypoint& from,
                                        const Waypoint& to) const {
  const int samples = SamplesOf(map, from, to);
  const auto at = [&](int i) { return Interpolate(from, to, static_cast<double>(i) / samples); };
  // In pieces: most edges that fail do so early, and then the rest need not be read.
  for (int begin = 0; begin <= samples; begin += kPieceSamples) {
    const int end = std::min(begin + kPieceSamples - 1, samples);
    FindObstacles(map, SweptBounds(map, at(begin), at(end)));
    for (int i = begin; i <= end; ++i) {
      if (Touches(at(i), map.grid().voxel_size_m()))
        return std::max(0, i - 1) / static_cast<double>(samples);
    }
  }
  return 1;
}

}  // namespace vog
