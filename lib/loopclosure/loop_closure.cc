#include "lib/loopclosure/loop_closure.h"

#include <algorithm>

#include "lib/geometry/odometry.h"

namespace vog {
namespace {

std::unordered_set<VoxelKey> CellsAround(const VoxelGrid& cells, const std::vector<Vec3>& points) {
  std::unordered_set<VoxelKey> occupied;
  for (const Vec3& p : points) {
    const VoxelKey key = cells.KeyOf(p);
    for (int dz = -1; dz <= 1; ++dz)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) occupied.insert({key.x + dx, key.y + dy, key.z + dz});
  }
  return occupied;
}

std::vector<Vec3> Transformed(const Pose3& X, std::vector<Vec3> points) {
  for (Vec3& p : points) p = X * p;
  return points;
}

/// Calls `use` with all points of a cloud, or `most` of them spread evenly over it; returns how
/// many.
template <class Use>
std::size_t ForSpreadPoints(const RegistrationCloud& cloud, std::size_t most, Use use) {
  const std::size_t used = std::min(most, cloud.size());
  for (std::size_t u = 0; u < used; ++u) use(cloud.points()[u * cloud.size() / used]);
  return used;
}

/// Covariance that the drift inside both submaps adds to X_ik, right perturbation.
Mat6 ContentDrift(const SubmapShape& target, const SubmapShape& source, const Pose3& X_ik) {
  const Mat3 Ad_ki = PlanarAdjointOf(X_ik.inverse());
  return PlanarTo6(Ad_ki * target.content_drift * Ad_ki.transpose() + source.content_drift);
}

/// Registrations of one submap share half of their error, its own voxels'. Counted twice, the few
/// that a submap usually has promise together about what they should.
constexpr double kSharedErrors = 2;

bool HasOccupiedNear(const BrickGrid& grid, const VoxelKey& key, LogOddsUnits occupied_from) {
  constexpr std::int32_t kNear = 2;
  for (std::int32_t z = key.z - kNear; z <= key.z + kNear; ++z)
    for (std::int32_t y = key.y - kNear; y <= key.y + kNear; ++y)
      for (std::int32_t x = key.x - kNear; x <= key.x + kNear; ++x)
        if (grid.Get({x, y, z}) >= occupied_from) return true;
  return false;
}

}  // namespace

Mat6 BodyCovariance(const Mat6& covariance_of_frames, const Pose3& X_ik, const SubmapAnchor& i,
                    const SubmapAnchor& k) {
  const Mat6 Ad_ki = AdjointOf(X_ik.inverse());
  return covariance_of_frames + Ad_ki * PlanarTo6(i.body_drift) * Ad_ki.transpose() +
         PlanarTo6(k.body_drift);
}

Mat3 FeignedTurn(const Mat3& drift, const std::vector<Vec3>& points_C) {
  if (points_C.empty()) return Mat3::Zero();
  const auto count = static_cast<double>(points_C.size());
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : points_C) middle += p / count;
  double r2_m2 = 0;
  for (const Vec3& p : points_C) r2_m2 += (p - middle).head<2>().squaredNorm() / count;
  if (r2_m2 == 0) return Mat3::Zero();
  const double variance_rad2 = drift.topLeftCorner<2, 2>().trace() / 2 / (10 * r2_m2);
  const Vec3 turn_in_C(middle.y(), -middle.x(), 1);
  return variance_rad2 * turn_in_C * turn_in_C.transpose();
}

SubmapShape::SubmapShape(const SubmapPtr& submap, const SubmapAnchor& anchor,
                         LogOddsUnits occupied_from, const LoopClosureOptions& options,
                         const IcpOptions& icp)
    : submap(submap),
      id(submap->id()),
      anchor(anchor),
      occupied_from(occupied_from),
      cloud(Transformed(anchor.X_MC.inverse(),
                        OccupiedPoints(submap->grid, occupied_from, options.min_neighbours)),
            icp.normal_radius_m, Vec3::Zero()),
      content_drift(anchor.content_drift + FeignedTurn(submap->drift, cloud.points())),
      cells(options.cell_m),
      occupied_cells(CellsAround(cells, cloud.points())) {}

double PredictOverlap(const SubmapShape& target, const SubmapShape& source, const Pose3& X_ik,
                      std::size_t most_points) {
  std::size_t shared = 0;
  const std::size_t used = ForSpreadPoints(source.cloud, most_points, [&](const Vec3& p_k) {
    shared += target.occupied_cells.count(target.cells.KeyOf(X_ik * p_k));
  });
  return used == 0 ? 0 : static_cast<double>(shared) / static_cast<double>(used);
}

std::vector<LoopCandidate> FindCandidates(const LoopClosureOptions& options,
                                          const std::vector<const SubmapShape*>& targets,
                                          const SubmapShape& source,
                                          const std::vector<Pose3>& X_ik) {
  std::vector<LoopCandidate> candidates;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    if (source.id - targets[i]->id < options.min_separation) continue;
    const double overlap = PredictOverlap(*targets[i], source, X_ik[i]);
    if (overlap >= options.min_predicted_overlap) candidates.push_back({targets[i]->id, overlap});
  }
  return candidates;
}

bool IsNeeded(const LoopClosureOptions& options, const std::vector<const SubmapShape*>& targets,
              const SubmapShape& source, const std::vector<Pose3>& X_ik) {
  constexpr std::size_t kMaxPoints = 400;
  std::size_t needed = 0;
  const std::size_t used = ForSpreadPoints(source.cloud, kMaxPoints, [&](const Vec3& p_k) {
    int holders = 0;
    for (std::size_t i = 0; i < targets.size() && holders < options.enough_targets; ++i)
      holders += static_cast<int>(
          targets[i]->occupied_cells.count(targets[i]->cells.KeyOf(X_ik[i] * p_k)));
    needed += holders < options.enough_targets;
  });
  return 2 * needed >= used;
}

double ExpectedInformation(const IcpOptions& icp, const SubmapShape& target,
                           const SubmapShape& source, const Pose3& X_ik,
                           const LoopCandidate& candidate) {
  const double radius_m = source.cloud.radius_m();
  const Mat3 point_error =
      Vec3(1, 1, 1 / (radius_m * radius_m)).asDiagonal() * (icp.point_sigma_m * icp.point_sigma_m);
  const Mat3 R = PlanarOf(ContentDrift(target, source, X_ik)) + point_error;
  const Mat3 gain = Mat3::Identity() + PlanarOf(candidate.covariance) * R.inverse();
  return 0.5 * candidate.predicted_overlap * std::log(std::max(1.0, gain.determinant()));
}

void KeepBest(const LoopClosureOptions& options, double LoopCandidate::*merit,
              std::vector<LoopCandidate>& candidates) {
  std::stable_sort(candidates.begin(), candidates.end(),
                   [&](const auto& a, const auto& b) { return a.*merit > b.*merit; });
  if (static_cast<int>(candidates.size()) > options.max_candidates)
    candidates.erase(candidates.begin() + options.max_candidates, candidates.end());
}

double ShareInFreeWater(const SubmapShape& target, const SubmapShape& source, const Pose3& X_ik) {
  constexpr std::size_t kMaxPoints = 800;
  const BrickGrid& grid = target.submap->grid;
  const Pose3 X_Mk = target.anchor.X_MC * X_ik;
  int known = 0, in_water = 0;
  ForSpreadPoints(source.cloud, kMaxPoints, [&](const Vec3& p_k) {
    const VoxelKey key = grid.grid().KeyOf(X_Mk * p_k);
    if (grid.Get(key) == kUnknownUnits) return;
    ++known;
    in_water += !HasOccupiedNear(grid, key, target.occupied_from);
  });
  return known == 0 ? 0 : static_cast<double>(in_water) / known;
}

bool AgreesTheOtherWay(const IcpOptions& icp, const IcpResult& registration,
                       const SubmapShape& target, const SubmapShape& source) {
  const IcpResult back = Register(icp, source.cloud, target.cloud, registration.X_ik.inverse());
  if (!back.usable) return false;
  const Vec6 difference = Log(Ominus(registration.X_ik, back.X_ik.inverse()));
  // Both have about the same covariance.
  const Whitening whitening = PartialWhiteningOf(registration.basis, 2 * registration.covariance);
  return (whitening * difference).squaredNorm() <=
         ChiSquare99(static_cast<int>(registration.basis.cols()));
}

LoopClosure Reject(LoopClosure closure, std::string reason) {
  closure.accepted = false;
  closure.reason = std::move(reason);
  return closure;
}

LoopClosure Judge(const LoopClosureOptions& options, const IcpOptions& icp, const IcpResult& result,
                  const SubmapShape& target, const SubmapShape& source, const Pose3& predicted_X_ik,
                  const Mat6& predicted_covariance) {
  LoopClosure closure;
  closure.from = target.id;
  closure.to = source.id;
  closure.constraint.from = target.id;
  closure.constraint.to = source.id;
  closure.constraint.X_ik = result.X_ik;
  closure.overlap = result.overlap;
  closure.rmse_m = result.rmse_m;
  closure.constraint.kind = result.degenerate_directions > 0 ? ConstraintKind::kPartialClosure
                                                             : ConstraintKind::kFullClosure;
  if (!result.usable) return Reject(closure, "no registration");
  closure.directions = static_cast<int>(result.basis.cols());
  if (closure.directions < options.min_directions) return Reject(closure, "too few directions");
  if (result.overlap < options.min_overlap) return Reject(closure, "small overlap");
  if (result.rmse_m > options.max_rmse_m) return Reject(closure, "large residual");

  const Mat6 covariance =
      kSharedErrors * result.covariance + ContentDrift(target, source, result.X_ik);
  closure.constraint.whitening = PartialWhiteningOf(result.basis, covariance);
  const Vec6 innovation = Log(Ominus(result.X_ik, predicted_X_ik));
  const Whitening gate = PartialWhiteningOf(result.basis, covariance + predicted_covariance);
  closure.chi_square = (gate * innovation).squaredNorm();
  if (closure.chi_square > ChiSquare99(closure.directions))
    return Reject(closure, "contradicts the graph");
  const double in_free_water = std::max(ShareInFreeWater(target, source, result.X_ik),
                                        ShareInFreeWater(source, target, result.X_ik.inverse()));
  if (in_free_water > options.max_share_in_free_water)
    return Reject(closure, "points in free water");
  if (options.both_ways && !AgreesTheOtherWay(icp, result, target, source))
    return Reject(closure, "not the same the other way round");
  closure.accepted = true;
  return closure;
}

}  // namespace vog
