#pragma once

#include <limits>
#include <memory>
#include <string>
#include <unordered_set>
#include <vector>

#include "lib/base/config.h"
#include "lib/geometry/voxel_grid.h"
#include "lib/posegraph/pose_graph.h"
#include "lib/registration/icp.h"
#include "lib/submap/submap.h"

namespace vog {

struct LoopClosureOptions {
  int min_separation = 1;
  int max_candidates = 12;
  int enough_targets = 60;
  double cell_m = 0.5;
  double min_predicted_overlap = 0.3;
  double min_overlap = 0.4;
  double max_rmse_m = 0.12;
  int min_directions = 2;
  double max_share_in_free_water = 0.2;
  bool both_ways = true;
  int min_neighbours = 3;

  void Visit(OptionsVisitor& v) {
    v("min_separation", min_separation, Between(1, 1e6),
      "submaps this many numbers apart may close a loop");
    v("max_candidates", max_candidates, Between(0, 1000), "registrations tried a submap");
    v("enough_targets", enough_targets, Between(1, 1e6),
      "what so many submaps hold need not be looked for in later ones too");
    v("cell_m", cell_m, Between(0.05, 20), "cells in which overlap is predicted");
    v("min_predicted_overlap", min_predicted_overlap, Between(0, 1),
      "share of a submap's points that must lie in the other's cells to try a registration");
    v("min_overlap", min_overlap, Between(0, 1),
      "share of its points that must find a partner in the registration");
    v("max_rmse_m", max_rmse_m, Between(0.001, 5), "largest residual of a registration");
    v("min_directions", min_directions, Between(1, 6),
      "well-conditioned directions that a closure needs: a single one can be checked by nothing");
    v("max_share_in_free_water", max_share_in_free_water, Between(0, 1),
      "share of a submap's points that may lie where the other has seen free water");
    v("both_ways", both_ways,
      "register each closure's submaps the other way round too, which must come to the same");
    v("min_neighbours", min_neighbours, Between(0, 26),
      "occupied voxels with fewer occupied neighbours are taken for noise");
  }
};

/// The frame C of a submap that the pose graph places: where its content on the average says that
/// the body was. All drifts are covariances of (x, y, yaw).
struct SubmapAnchor {
  Pose3 X_MC = Pose3::Identity();
  /// How far content that another submap shares lies from the average.
  Mat3 content_drift = Mat3::Zero();
  /// How far the body was from C: what drift has done to all content.
  Mat3 body_drift = Mat3::Zero();
  Mat3 drift_before = Mat3::Zero();  ///< Of the body's motion from the base to C.
};

/// Covariance of the body's relative pose X_ik, right perturbation, from that of two submaps'
/// frames C.
Mat6 BodyCovariance(const Mat6& covariance_of_frames, const Pose3& X_ik, const SubmapAnchor& i,
                    const SubmapAnchor& k);

/// Covariance in C of the turn that drift D feigns. Seen one after the other from side to side,
/// points that the drift displaced lie as if their cloud were turned: the slope of a random walk
/// over time has variance 6/5 D, and time sweeps over the cloud's width, the square root of 12
/// times its standard deviation r. That is D / 10 r^2, about the cloud's middle.
Mat3 FeignedTurn(const Mat3& drift, const std::vector<Vec3>& points_C);

/// A closed submap as the loop closer sees it.
struct SubmapShape {
  SubmapShape(const SubmapPtr& submap, const SubmapAnchor& anchor, LogOddsUnits occupied_from,
              const LoopClosureOptions& options, const IcpOptions& icp);

  SubmapPtr submap;
  SubmapId id;
  SubmapAnchor anchor;
  LogOddsUnits occupied_from;
  RegistrationCloud cloud;  ///< Occupied voxels, in C.
  Mat3 content_drift;       ///< The anchor's, and how drift has turned the content.
  VoxelGrid cells;
  std::unordered_set<VoxelKey> occupied_cells;  ///< With a margin of one cell.
};

/// A submap that may close a loop.
struct LoopCandidate {
  SubmapId id;
  double predicted_overlap;        ///< Of the new submap with it.
  Mat6 covariance = Mat6::Zero();  ///< Of X_ik by the graph, right perturbation.
  double information = 0;          ///< Expected of a registration [nats].
  /// Where registrations begin.
  std::vector<Pose3> starts = {};
};

/// Share of `source`'s points, or of at most `most_points` spread evenly over them, that lie in
/// `target`'s cells.
double PredictOverlap(const SubmapShape& target, const SubmapShape& source, const Pose3& X_ik,
                      std::size_t most_points = std::numeric_limits<std::size_t>::max());

/// The submaps whose predicted overlap suffices, by their numbers.
std::vector<LoopCandidate> FindCandidates(const LoopClosureOptions& options,
                                          const std::vector<const SubmapShape*>& targets,
                                          const SubmapShape& source,
                                          const std::vector<Pose3>& X_ik);

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
double ExpectedInformation(const IcpOptions& icp, const SubmapShape& target,
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

/// Share of `source`'s points that `target` contradicts, among those in voxels that it knows: they
/// lie in free water, more than two voxels from anything occupied, which is what rounding in both
/// grids and noise may feign. 0 when it knows none.
double ShareInFreeWater(const SubmapShape& target, const SubmapShape& source, const Pose3& X_ik);

/// Whether the registration of `target` to `source` from where `registration` has put them comes
/// back to it: chi-square of the difference, 99 %, in the directions that were measured. A wrong
/// minimum of one is seldom one of the other.
bool AgreesTheOtherWay(const IcpOptions& icp, const IcpResult& registration,
                       const SubmapShape& target, const SubmapShape& source);

/// Marks a closure as rejected.
LoopClosure Reject(LoopClosure closure, std::string reason);

/// Tests a registration of `source` to `target`: enough overlap, small residual, a relative pose
/// that does not contradict the graph's prediction `predicted_X_ik` with covariance
/// `predicted_covariance` (chi-square, 99 %), points that do not lie in water which the other
/// submap has seen free, and the same result the other way round. All poses are between the
/// submaps' frames C. The constraint's covariance holds the drift inside both submaps and twice the
/// registration's own: a submap's voxels bring the same errors into all its closures, which the
/// graph takes for independent.
LoopClosure Judge(const LoopClosureOptions& options, const IcpOptions& icp,
                  const IcpResult& registration, const SubmapShape& target,
                  const SubmapShape& source, const Pose3& predicted_X_ik,
                  const Mat6& predicted_covariance);

}  // namespace vog
