#include "lib/slam/revisits.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "lib/geometry/odometry.h"

namespace vog {
namespace {

constexpr std::size_t kSamples = 12;
constexpr double kLeastGain = 0.03;

double HorizontalVariance(const Mat6& covariance) {
  return covariance.topLeftCorner<2, 2>().trace();
}

/// Asks a graph for all the relative covariances at once.
class Variances {
 public:
  Variances(const PoseGraph& graph, std::vector<PoseGraph::NodePair> pairs)
      : pairs_(std::move(pairs)), covariances_(graph.RoughRelativeCovariances(pairs_)) {}

  bool empty() const { return covariances_.empty(); }
  /// In the order of the pairs.
  const Mat6& Next() { return covariances_[next_++]; }
  double NextVariance() {
    const auto& [i, k] = pairs_[next_];
    const Mat6& covariance = Next();
    return i == k ? 0 : HorizontalVariance(covariance);
  }

 private:
  std::vector<PoseGraph::NodePair> pairs_;
  std::vector<Mat6> covariances_;
  std::size_t next_ = 0;
};

/// Spread evenly, the newest being the last.
std::vector<NodeId> SampleOf(const std::map<NodeId, Pose3>& nodes) {
  std::vector<NodeId> ids;
  for (const auto& [id, X_W] : nodes) ids.push_back(id);
  const std::size_t count = std::min(kSamples, ids.size());
  std::vector<NodeId> sample;
  for (std::size_t s = 1; s <= count; ++s) sample.push_back(ids[s * ids.size() / count - 1]);
  return sample;
}

/// Share of the horizontal variance of `covariance` that a measurement leaves.
double ShareLeft(const Mat3& covariance, const Mat3& information) {
  const Mat3 left = (covariance.inverse() + information).inverse();
  return left.topLeftCorner<2, 2>().trace() / covariance.topLeftCorner<2, 2>().trace();
}

/// What is left of a sum of standard deviations when `gone(s)` of the variance of each is.
template <class Gone>
double SumLeft(const std::vector<double>& variances_m2, double body_variance_m2, const Gone& gone) {
  double sum_m = 0;
  for (std::size_t s = 0; s < variances_m2.size(); ++s)
    sum_m += std::sqrt(std::max(0.0, variances_m2[s] - gone(s)) + body_variance_m2);
  return sum_m;
}

/// A target, and what a closure with it leaves of the newest node's place relative to it.
struct Closure {
  NodeId target;
  double V_jN;
  double taken;  ///< Share of V_jN.
};

/// As if the newest node stood where `target` does.
Closure ClosureWith(const PoseGraph& graph, NodeId target, NodeId newest, const Mat6& of_X_jN,
                    const Mat3& information) {
  const double V_jN = target == newest ? 0 : HorizontalVariance(of_X_jN);
  if (!(V_jN > 0)) return {target, 1, 0};
  const Mat6 carry = AdjointOf(Ominus(graph.X_W(target), graph.X_W(newest)));
  return {target, V_jN, 1 - ShareLeft(PlanarOf(carry * of_X_jN * carry.transpose()), information)};
}

}  // namespace

std::map<SubmapId, double> ExpectRevisits(const PoseGraph& graph,
                                          const std::map<SubmapId, Mat3>& targets,
                                          double body_variance_m2) {
  if (graph.nodes().size() < 2 || targets.empty()) return {};
  const NodeId first = graph.nodes().begin()->first, newest = graph.nodes().rbegin()->first;
  const std::vector<NodeId> sample = SampleOf(graph.nodes());
  std::vector<PoseGraph::NodePair> pairs;
  for (const NodeId k : sample) pairs.emplace_back(first, k);
  for (const auto& [j, information] : targets) pairs.emplace_back(j, newest);
  Variances near(graph, std::move(pairs));
  if (near.empty()) return {};
  std::vector<double> V_0k;
  for (std::size_t s = 0; s < sample.size(); ++s) V_0k.push_back(near.NextVariance());
  const double sum_m = SumLeft(V_0k, body_variance_m2, [](std::size_t) { return 0.0; });
  if (!(sum_m > 0)) return {};
  const auto gain = [&](const auto& gone) {
    return 1 - SumLeft(V_0k, body_variance_m2, gone) / sum_m;
  };
  // No closure takes more of any node's variance than of what it measures.
  std::vector<Closure> closures;
  for (const auto& [j, information] : targets) {
    const Closure closure = ClosureWith(graph, j, newest, near.Next(), information);
    const double most = gain([&](std::size_t s) { return closure.taken * V_0k[s]; });
    if (most >= kLeastGain) closures.push_back(closure);
  }
  if (closures.empty()) return {};

  pairs.clear();
  for (const NodeId k : sample) pairs.emplace_back(k, newest);
  for (const Closure& closure : closures) {
    pairs.emplace_back(first, closure.target);
    for (const NodeId k : sample) pairs.emplace_back(closure.target, k);
  }
  Variances far(graph, std::move(pairs));
  const double V_0N = V_0k.back();
  std::vector<double> V_kN;
  for (std::size_t s = 0; s < sample.size(); ++s) V_kN.push_back(far.NextVariance());
  std::map<SubmapId, double> gains;
  for (const auto& [j, V_jN, taken] : closures) {
    const double V_0j = far.NextVariance();
    std::vector<double> V_jk;
    for (std::size_t s = 0; s < sample.size(); ++s) V_jk.push_back(far.NextVariance());
    const double of_all = gain([&](std::size_t s) {
      const double C = (V_jk[s] + V_0N - V_kN[s] - V_0j) / 2;
      return taken * C * C / V_jN;
    });
    if (of_all >= kLeastGain) gains[j] = of_all;
  }
  return gains;
}

}  // namespace vog
