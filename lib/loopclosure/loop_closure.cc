#include "lib/loopclosure/loop_closure.h"

#include <algorithm>
#include <functional>
#include <set>

#include "lib/base/chi_square.h"
#include "lib/geometry/odometry.h"

namespace vog {
namespace {

/// Covariance that the drift inside both submaps adds to X_ik, right perturbation.
Mat6 ContentDrift(const SubmapRegion& target, const SubmapShape& source, const Pose3& X_ik) {
  const Mat3 Ad_ki = PlanarAdjointOf(X_ik.inverse());
  return PlanarTo6(Ad_ki * target.content_drift * Ad_ki.transpose() + source.content_drift);
}

/// Registrations of one submap share half of their error, its own voxels'. Counted twice, the few
/// that a submap usually has promise together about what they should.
constexpr double kSharedErrors = 2;

/// The members of a region are placed by the edges that its closure is put beside in the graph, and
/// a submap's closures with several regions share the drift inside it.
constexpr double kSharedByMembers = 2;

void SortBy(double LoopCandidate::*merit, std::vector<LoopCandidate>& candidates) {
  std::stable_sort(candidates.begin(), candidates.end(),
                   [&](const auto& a, const auto& b) { return a.*merit > b.*merit; });
}

/// A region that overlaps too little is given up; others may do.
constexpr int kTriesPerRegion = 2;

/// Joins `region` with others; returns with which.
std::set<SubmapId> Join(const LoopClosureOptions& options, const IcpOptions& icp,
                        const PoseGraph& graph, const std::vector<LoopCandidate>& others,
                        LoopCandidate& region) {
  std::vector<std::pair<NodeId, NodeId>> pairs;
  for (const LoopCandidate& other : others) pairs.emplace_back(other.id, region.id);
  const std::vector<Mat6> covariances = graph.RoughRelativeCovariances(pairs);
  std::vector<std::size_t> near;
  for (std::size_t o = 0; o < covariances.size(); ++o)
    if (HorizontalSigma(covariances[o]) <= icp.end_distance_m / 2) near.push_back(o);
  std::stable_sort(near.begin(), near.end(), [&](std::size_t a, std::size_t b) {
    return others[a].predicted_overlap > others[b].predicted_overlap;
  });
  near.resize(std::min(near.size(), static_cast<std::size_t>(options.region_submaps - 1)));
  std::set<SubmapId> joined;
  for (const std::size_t o : near) {
    const LoopCandidate& other = others[o];
    region.members.push_back({other.members.front().shape,
                              Ominus(graph.X_W(region.id), graph.X_W(other.id)),
                              PlanarOf(covariances[o])});
    region.Cover(other.covered);
    joined.insert(other.id);
  }
  return joined;
}

bool HasOccupiedNear(const BrickGrid& grid, const VoxelKey& key, LogOddsUnits occupied_from) {
  constexpr std::int32_t kNear = 2;
  for (std::int32_t z = key.z - kNear; z <= key.z + kNear; ++z)
    for (std::int32_t y = key.y - kNear; y <= key.y + kNear; ++y)
      for (std::int32_t x = key.x - kNear; x <= key.x + kNear; ++x)
        if (grid.Get({x, y, z}) >= occupied_from) return true;
  return false;
}

/// Of the points of a source in voxels that a target knows.
struct SeenPoints {
  int known = 0, in_water = 0;
};

SeenPoints PointsSeen(const SubmapShape& target, const SubmapShape& source, const Pose3& X_ik,
                      std::size_t most) {
  const BrickGrid& grid = target.submap->grid;
  const Pose3 X_Mk = target.anchor.X_MC * X_ik;
  SeenPoints seen;
  ForSpreadPoints(source.cloud, most, [&](const Vec3& p_k) {
    const VoxelKey key = grid.grid().KeyOf(X_Mk * p_k);
    if (grid.Get(key) == kUnknownUnits) return;
    ++seen.known;
    seen.in_water += !HasOccupiedNear(grid, key, target.occupied_from);
  });
  return seen;
}

}  // namespace

std::vector<LoopCandidate> FindCandidates(const LoopClosureOptions& options,
                                          const std::vector<const SubmapShape*>& targets,
                                          const SubmapShape& source,
                                          const std::vector<Pose3>& X_ik) {
  std::vector<LoopCandidate> candidates;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    if (source.id - targets[i]->id < options.min_separation) continue;
    LoopCandidate candidate{targets[i]->id};
    candidate.members = {{targets[i]}};
    candidate.Cover(PointsIn(*targets[i], source, X_ik[i]));
    if (candidate.predicted_overlap > 0) candidates.push_back(std::move(candidate));
  }
  return candidates;
}

void LoopCandidate::Cover(const std::vector<bool>& points) {
  covered.resize(points.size());
  std::transform(points.begin(), points.end(), covered.begin(), covered.begin(), std::logical_or());
  const auto count = std::count(covered.begin(), covered.end(), true);
  predicted_overlap =
      covered.empty() ? 0 : static_cast<double>(count) / static_cast<double>(covered.size());
}

std::vector<LoopCandidate> JoinRegions(const LoopClosureOptions& options, const IcpOptions& icp,
                                       const PoseGraph& graph,
                                       std::vector<LoopCandidate> candidates) {
  SortBy(&LoopCandidate::information, candidates);
  std::vector<LoopCandidate> regions;
  for (int tries = 0; tries < kTriesPerRegion * options.max_candidates; ++tries) {
    if (candidates.empty() || static_cast<int>(regions.size()) == options.max_candidates) break;
    LoopCandidate region = std::move(candidates.front());
    candidates.erase(candidates.begin());
    const auto joined = Join(options, icp, graph, candidates, region);
    if (joined.empty() || region.predicted_overlap < options.min_predicted_overlap) continue;
    std::erase_if(candidates, [&](const auto& other) { return joined.count(other.id) != 0; });
    regions.push_back(std::move(region));
  }
  return regions;
}

bool IsNeeded(const LoopClosureOptions& options, const std::vector<const SubmapShape*>& targets,
              const SubmapShape& source, const std::vector<Pose3>& X_ik) {
  constexpr std::size_t kMaxPoints = 400;
  std::size_t needed = 0;
  const std::size_t used = ForSpreadPoints(source.cloud, kMaxPoints, [&](const Vec3& p_k) {
    int holders = 0;
    for (std::size_t i = 0; i < targets.size() && holders < options.enough_targets; ++i)
      holders += targets[i]->HasNear(X_ik[i] * p_k);
    needed += holders < options.enough_targets;
  });
  return 2 * needed >= used;
}

double ExpectedInformation(const IcpOptions& icp, const SubmapRegion& target,
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
  SortBy(merit, candidates);
  if (static_cast<int>(candidates.size()) > options.max_candidates)
    candidates.erase(candidates.begin() + options.max_candidates, candidates.end());
}

double ShareInFreeWater(const SubmapRegion& target, const SubmapShape& source, const Pose3& X_ik) {
  constexpr std::size_t kMaxPoints = 800;
  SeenPoints there, back;
  const auto add = [](SeenPoints& sum, const SeenPoints& seen) {
    sum.known += seen.known;
    sum.in_water += seen.in_water;
  };
  for (const SubmapRegion::Member& member : target.members) {
    const Pose3 X_mk = Ominus(member.X_im, X_ik);
    const std::size_t most = kMaxPoints / target.members.size();
    add(there, PointsSeen(*member.shape, source, X_mk, most));
    add(back, PointsSeen(source, *member.shape, X_mk.inverse(), most));
  }
  const auto share = [](const SeenPoints& seen) {
    return seen.known == 0 ? 0 : static_cast<double>(seen.in_water) / seen.known;
  };
  return std::max(share(there), share(back));
}

bool AgreesTheOtherWay(const IcpOptions& icp, const IcpResult& registration,
                       const SubmapRegion& target, const SubmapShape& source) {
  const IcpResult back = Register(icp, source.cloud, *target.cloud, registration.X_ik.inverse());
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
                  const SubmapRegion& target, const SubmapShape& source,
                  const Pose3& predicted_X_ik, const Mat6& predicted_covariance) {
  LoopClosure closure;
  closure.from = target.id();
  closure.to = source.id;
  closure.constraint.from = target.id();
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

  const double shared = target.members.size() > 1 ? kSharedByMembers : 1;
  const Mat6 covariance =
      shared * (kSharedErrors * result.covariance + ContentDrift(target, source, result.X_ik));
  closure.constraint.whitening = PartialWhiteningOf(result.basis, covariance);
  const Vec6 innovation = Log(Ominus(result.X_ik, predicted_X_ik));
  const Whitening gate = PartialWhiteningOf(result.basis, covariance + predicted_covariance);
  closure.chi_square = (gate * innovation).squaredNorm();
  if (closure.chi_square > ChiSquare99(closure.directions))
    return Reject(closure, "contradicts the graph");
  const double in_free_water = ShareInFreeWater(target, source, result.X_ik);
  if (in_free_water > options.max_share_in_free_water)
    return Reject(closure, "points in free water");
  if (options.both_ways && !AgreesTheOtherWay(icp, result, target, source))
    return Reject(closure, "not the same the other way round");
  closure.accepted = true;
  return closure;
}

}  // namespace vog
