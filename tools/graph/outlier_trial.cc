#include "tools/graph/outlier_trial.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "lib/base/errors.h"
#include "lib/bus/stopwatch.h"
#include "lib/posegraph/chordal_start.h"
#include "lib/posegraph/robust_closures.h"

namespace vog {
namespace {

/// Removes all closures but `count` of them.
void Thin(PoseGraph& graph, int count, Random& random) {
  std::vector<int> numbers = ClosuresOf(graph);
  while (static_cast<int>(numbers.size()) > count) {
    const auto at = random.Index(static_cast<int>(numbers.size()));
    graph.RemoveConstraint(numbers[static_cast<std::size_t>(at)]);
    numbers.erase(numbers.begin() + at);
  }
}

double MeanStep(const PoseGraph& graph) {
  double sum = 0;
  int steps = 0;
  for (const auto& [number, constraint] : graph.constraints()) {
    if (constraint.kind != ConstraintKind::kOdometry) continue;
    sum += constraint.X_ik.translation().norm();
    ++steps;
  }
  return steps == 0 ? 0 : sum / steps;
}

void SetDifference(const PoseGraph& dut, const PoseGraph& truth, OutlierResult& result) {
  double sum = 0;
  for (const auto& [id, X_W] : truth.nodes()) {
    const double distance_m = (dut.X_W(id).translation() - X_W.translation()).norm();
    result.max_m = std::max(result.max_m, distance_m);
    sum += distance_m * distance_m;
  }
  result.rmse_m = std::sqrt(sum / static_cast<double>(truth.nodes().size()));
}

}  // namespace

OutlierTrial::OutlierTrial(const PoseGraph& graph, const OutlierOptions& options,
                           std::uint64_t seed)
    : options_(options), seed_(seed), truth_(graph), step_m_(MeanStep(graph)) {
  Random random(seed, "closures");
  Thin(truth_, options.closures, random);
  for (const int number : ClosuresOf(truth_)) closures_.push_back(truth_.constraints().at(number));
  for (const auto& [id, X_W] : truth_.nodes()) ids_.push_back(id);
  if (closures_.empty() || ids_.size() < 4)
    throw UsageError("a graph with closures and at least four nodes is needed");
  StartFromTheBetter(truth_);
  if (!truth_.Solve().usable) throw std::runtime_error("the graph cannot be solved");
}

OutlierResult OutlierTrial::Run(double share) const {
  OutlierResult result;
  result.right = result.right_kept = static_cast<int>(closures_.size());
  result.wrong = result.wrong_kept =
      static_cast<int>(std::lround(result.right * share / (1 - share)));
  Random random(seed_, "wrong closures");
  PoseGraph dut = WithWrongClosures(result.wrong, random);
  const Stopwatch stopwatch;
  const RobustSummary summary = SolveRobustly(dut);
  result.seconds = stopwatch.seconds();
  for (const int number : summary.rejected)
    --(truth_.constraints().count(number) > 0 ? result.right_kept : result.wrong_kept);
  SetDifference(dut, truth_, result);
  return result;
}

PoseGraph OutlierTrial::WithWrongClosures(int count, Random& random) const {
  PoseGraph graph = truth_;
  while (count > 0) {
    const auto group = WrongGroup(std::min(options_.group, count), random);
    for (const Constraint& closure : group) graph.AddConstraint(closure);
    count -= static_cast<int>(group.size());
  }
  return graph;
}

std::vector<Constraint> OutlierTrial::WrongGroup(int size, Random& random) const {
  const int nodes = static_cast<int>(ids_.size());
  const int length = std::min(size, nodes / 2);
  const auto id = [&](int index) { return ids_[static_cast<std::size_t>(index)]; };
  int i = 0, k = 0;
  while (std::abs(i - k) < 2) {  // Neighbours have odometry between them.
    i = random.Index(nodes - length + 1);
    k = random.Index(nodes - length + 1);
  }
  const Pose3 X_ik = WrongRegistration(id(i), id(k), random);
  const Constraint& like =
      closures_[static_cast<std::size_t>(random.Index(static_cast<int>(closures_.size())))];
  std::vector<Constraint> group;
  for (int n = 0; n < length; ++n) {
    const Pose3 X_ni = Ominus(truth_.X_W(id(i + n)), truth_.X_W(id(i)));
    const Pose3 X_kn = Ominus(truth_.X_W(id(k)), truth_.X_W(id(k + n)));
    group.push_back({id(i + n), id(k + n), like.kind, X_ni * X_ik * X_kn, like.whitening});
  }
  return group;
}

Pose3 OutlierTrial::WrongRegistration(NodeId i, NodeId k, Random& random) const {
  const Pose3 X_ik = Ominus(truth_.X_W(i), truth_.X_W(k));
  if (options_.shift_m > 0) {
    const Vec3 direction = random.GaussianVector(Vec3::Ones()).normalized();
    return X_ik * MakePose(options_.shift_m * direction);
  }
  const auto any = [&] {
    return truth_.X_W(ids_[static_cast<std::size_t>(random.Index(static_cast<int>(ids_.size())))]);
  };
  // What lies within a step of the truth might be right.
  Pose3 X_wrong = X_ik;
  while ((X_wrong.translation() - X_ik.translation()).norm() <= step_m_)
    X_wrong = Ominus(any(), any());
  return X_wrong;
}

}  // namespace vog
