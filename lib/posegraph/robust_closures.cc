#include "lib/posegraph/robust_closures.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <map>
#include <optional>

#include "lib/base/chi_square.h"

namespace vog {
namespace {

/// How closures' shares of their limits tell covariances that are far too large: see LimitOf().
/// Where covariances are right, none of these lowers a limit.
struct Spread {
  double part;    ///< This part of the closures, those with the smallest shares, is right.
  double factor;  ///< The others that are right have shares this many times larger at most.
};
constexpr Spread kBeforeTheGate{0.1, 50};
constexpr Spread kBehindTheGate{0.5, 8};
constexpr Spread kSolved{0.5, 400};

/// Poses and covariances along odometry.
class OdometryChain {
 public:
  explicit OdometryChain(const PoseGraph& graph) {
    std::map<NodeId, const Constraint*> steps;  // By the node they lead to.
    for (const auto& [number, constraint] : graph.constraints())
      if (IsStep(constraint)) steps.emplace(std::max(constraint.from, constraint.to), &constraint);
    int part = 0;
    for (const auto& [id, X_W] : graph.nodes()) {
      const auto step = steps.find(id);
      const bool goes_on = step != steps.end() && !graph.IsFixed(id);
      Link link{goes_on ? part : ++part, X_W, Mat6::Zero()};
      if (goes_on) Follow(links_.at(id - 1), *step->second, link);
      links_.emplace(id, link);
    }
  }

  const Pose3& X_W(NodeId id) const { return links_.at(id).X_W; }

  /// Covariance of X_ik by the odometry between the nodes, right perturbation; nothing when it has
  /// a gap there.
  std::optional<Mat6> CovarianceOf(NodeId i, NodeId k) const {
    const Link &from = links_.at(i), &to = links_.at(k);
    if (from.part != to.part) return std::nullopt;
    const Mat6 between_W = i < k ? Mat6(to.covariance_W - from.covariance_W)
                                 : Mat6(from.covariance_W - to.covariance_W);
    const Mat6 Ad = AdjointOf(to.X_W.inverse());
    return Ad * between_W * Ad.transpose();
  }

 private:
  struct Link {
    int part;  ///< Nodes of one part have odometry between them.
    Pose3 X_W;
    Mat6
        covariance_W;  ///< Sum over the steps from the part's first node on, as perturbations at W.
  };

  static bool IsStep(const Constraint& constraint) {
    return constraint.kind == ConstraintKind::kOdometry && constraint.whitening.rows() == 6 &&
           std::abs(constraint.from - constraint.to) == 1;
  }

  /// The step's perturbation xi on the right of X_ik is Ad(X_W) xi at W, X_W the pose it is right
  /// of.
  static void Follow(const Link& before, const Constraint& step, Link& link) {
    const bool is_forward = step.from < step.to;
    link.X_W = before.X_W * (is_forward ? step.X_ik : step.X_ik.inverse());
    const Mat6 covariance = step.Information().ldlt().solve(Mat6::Identity());
    const Mat6 Ad = AdjointOf(is_forward ? link.X_W : before.X_W);
    link.covariance_W = before.covariance_W + Ad * covariance * Ad.transpose();
  }

  std::map<NodeId, Link> links_;
};

double LimitOf(const Constraint& closure) {
  return ChiSquare99(static_cast<int>(closure.whitening.rows()));
}

/// Squared innovation of a closure against odometry's prediction, whitened by the covariances of
/// both in the directions that the closure has, as a share of what 99 % stay below. 0 where
/// odometry predicts nothing.
double GateOf(const Constraint& closure, const OdometryChain& odometry) {
  const auto covariance = odometry.CovarianceOf(closure.from, closure.to);
  if (!covariance) return 0;
  const Pose3 X_ik = Ominus(odometry.X_W(closure.from), odometry.X_W(closure.to));
  const Eigen::VectorXd innovation = closure.whitening * Log(Ominus(closure.X_ik, X_ik));
  const Eigen::MatrixXd sum =
      closure.whitening * *covariance * closure.whitening.transpose() +
      Eigen::MatrixXd::Identity(closure.whitening.rows(), closure.whitening.rows());
  return innovation.dot(sum.ldlt().solve(innovation)) / LimitOf(closure);
}

/// How large a closure's share of its limit may be: 1, or less where the smallest ones lie far
/// below.
double LimitOf(std::vector<double> shares, const Spread& spread) {
  if (shares.empty()) return 1;
  const auto at = static_cast<std::ptrdiff_t>(spread.part * static_cast<double>(shares.size()));
  std::nth_element(shares.begin(), shares.begin() + at, shares.end());
  return std::min(1.0, spread.factor * shares[static_cast<std::size_t>(at)]);
}

using Shares = std::map<int, double>;  ///< By the constraint's number.

template <class ShareOf>
Shares SharesOf(const PoseGraph& graph, ShareOf share_of) {
  Shares shares;
  for (const int number : ClosuresOf(graph))
    shares[number] = share_of(graph.constraints().at(number));
  return shares;
}

/// Removes the closures whose share is above the limit that all of them together tell.
void RemoveAbove(PoseGraph& graph, Shares& shares, const Spread& spread,
                 std::vector<int>& removed) {
  std::vector<double> positive;  // 0 says nothing.
  for (const auto& [number, share] : shares)
    if (share > 0) positive.push_back(share);
  const double limit = LimitOf(positive, spread);
  for (auto closure = shares.begin(); closure != shares.end();) {
    if (closure->second <= limit) {
      ++closure;
      continue;
    }
    graph.RemoveConstraint(closure->first);
    removed.push_back(closure->first);
    closure = shares.erase(closure);
  }
}

/// With dynamic covariance scaling whose Phi falls from where every closure counts to what a right
/// one has on average, one a degree of freedom. Right closures that the drift has put far away are
/// drawn in before the wrong ones are let go. Returns the number of iterations.
int SolveWithGrowingDoubt(PoseGraph& graph) {
  constexpr double kStep = 4, kLastPhi = 6;
  double phi = kLastPhi;
  for (const int number : ClosuresOf(graph))
    phi = std::max(phi, graph.ChiSquareOf(graph.constraints().at(number)));
  int iterations = 0;
  for (; phi > kLastPhi; phi /= kStep) iterations += graph.Solve({phi}).iterations;
  return iterations + graph.Solve({kLastPhi}).iterations;
}

}  // namespace

RobustSummary SolveRobustly(PoseGraph& graph) {
  RobustSummary summary;
  const OdometryChain odometry(graph);
  const std::map<NodeId, Pose3> before = graph.nodes();
  for (const auto& [id, X_W] : before) graph.SetPose(id, odometry.X_W(id));
  Shares gates =
      SharesOf(graph, [&](const Constraint& closure) { return GateOf(closure, odometry); });
  RemoveAbove(graph, gates, kBeforeTheGate, summary.rejected);
  RemoveAbove(graph, gates, kBehindTheGate, summary.rejected);
  summary.iterations += SolveWithGrowingDoubt(graph);
  Shares residuals = SharesOf(graph, [&](const Constraint& closure) {
    return graph.ChiSquareOf(closure) / LimitOf(closure);
  });
  RemoveAbove(graph, residuals, kSolved, summary.rejected);
  summary.solve = graph.Solve();
  summary.iterations += summary.solve.iterations;
  std::sort(summary.rejected.begin(), summary.rejected.end());
  return summary;
}

}  // namespace vog
