#pragma once

#include <string>
#include <vector>

#include "lib/loopclosure/region.h"
#include "lib/posegraph/pose_graph.h"

namespace vog {

/// A region that may close a loop.
struct LoopCandidate {
  SubmapId id;                     ///< Of its anchor.
  double predicted_overlap = 0;    ///< Of the new submap with it.
  Mat6 covariance = Mat6::Zero();  ///< Of X_ik by the graph, right perturbation.
  double information = 0;          ///< Expected of a registration with the anchor [nats].
  /// Where registrations begin.
  std::vector<Pose3> starts = {};
  std::vector<SubmapRegion::Member> members = {};  ///< The anchor first.
  std::vector<bool> covered = {};  ///< Which of the new submap's points lie in its cells.

  /// Marks points as covered, besides those that are.
  void Cover(const std::vector<bool>& points);
};

/// The submaps that are predicted to overlap, each alone, by their numbers.
std::vector<LoopCandidate> FindCandidates(const LoopClosureOptions& options,
                                          const std::vector<const SubmapShape*>& targets,
                                          const SubmapShape& source,
                                          const std::vector<Pose3>& X_ik);

/// Joins each candidate, most informative first, with those that overlap most of those whose place
/// relative to it the graph knows so well that correspondences reach it in the end: region_submaps
/// at most. Each is in one region. Regions of several submaps that are predicted to overlap enough
/// are returned, max_candidates at most.
std::vector<LoopCandidate> JoinRegions(const LoopClosureOptions& options, const IcpOptions& icp,
                                       const PoseGraph& graph,
                                       std::vector<LoopCandidate> candidates);

/// Whether later submaps may need `source` to close loops with: a part of its points, large enough
/// for that, lies in the cells of fewer than enough_targets of `targets`. X_ik is its pose in each.
/// Submaps that are not needed bound what SLAM has to do where a mission goes on for long in one
/// place: they still close loops themselves, and no loop is closed with them.
bool IsNeeded(const LoopClosureOptions& options, const std::vector<const SubmapShape*>& targets,
              const SubmapShape& source, const std::vector<Pose3>& X_ik);

/// What a registration of the two is expected to tell of (x, y, yaw), in nats: half the logarithm
/// of det(I + P R^-1), the mutual information of the pose and a measurement of it, times the
/// predicted overlap as the chance that there is one. P is the candidate's covariance; R that of
/// the content, from the drift inside both submaps and points that all share one error.
double ExpectedInformation(const IcpOptions& icp, const SubmapRegion& target,
                           const SubmapShape& source, const Pose3& X_ik,
                           const LoopCandidate& candidate);

/// The max_candidates that have most of a merit, best first.
void KeepBest(const LoopClosureOptions& options, double LoopCandidate::*merit,
              std::vector<LoopCandidate>& candidates);

/// What became of a candidate.
struct LoopClosure {
  SubmapId from = 0, to = 0;
  bool accepted = false;
  std::string reason;     ///< Why it was rejected.
  Constraint constraint;  ///< Full or partial; of a rejected one as far as it got.
  int directions = 0;     ///< Well-conditioned ones.
  double chi_square = 0;  ///< Against the graph's prediction.
  double overlap = 0, rmse_m = 0;
};

/// Share of the points of `source` that `target` contradicts, among those in voxels that a member
/// knows: they lie in free water, more than two voxels from anything occupied, which is what
/// rounding in both grids and noise may feign. Or the same share of the members' points in
/// `source`, if that is larger. 0 when nothing is known.
double ShareInFreeWater(const SubmapRegion& target, const SubmapShape& source, const Pose3& X_ik);

/// Whether the registration of `target` to `source` from where `registration` has put them comes
/// back to it: chi-square of the difference, 99 %, in the directions that were measured. A wrong
/// minimum of one is seldom one of the other.
bool AgreesTheOtherWay(const IcpOptions& icp, const IcpResult& registration,
                       const SubmapRegion& target, const SubmapShape& source);

/// Marks a closure as rejected.
LoopClosure Reject(LoopClosure closure, std::string reason);

/// Tests a registration of `source` to `target`: enough overlap, small residual, a relative pose
/// that does not contradict the graph's prediction `predicted_X_ik` with covariance
/// `predicted_covariance` (chi-square, 99 %), points that do not lie in water which the other has
/// seen free, and the same result the other way round. All poses are between the frames C of the
/// new submap and the region's anchor. The constraint's covariance holds the drift inside both and
/// twice the registration's own: a submap's voxels bring the same errors into all its closures,
/// which the graph takes for independent. With a region of several, all of it counts twice.
LoopClosure Judge(const LoopClosureOptions& options, const IcpOptions& icp,
                  const IcpResult& registration, const SubmapRegion& target,
                  const SubmapShape& source, const Pose3& predicted_X_ik,
                  const Mat6& predicted_covariance);

}  // namespace vog
