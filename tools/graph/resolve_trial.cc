#include "tools/graph/resolve_trial.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "lib/base/errors.h"
#include "lib/bus/stopwatch.h"
#include "lib/posegraph/chordal_start.h"

namespace vog {
namespace {

/// So many batch solves are enough to know what they cost.
constexpr int kBatchSolves = 5;

std::vector<Constraint> TakeLastClosures(PoseGraph& graph, int count) {
  const std::vector<int> numbers = ClosuresOf(graph);
  const auto kept = std::max<std::ptrdiff_t>(0, std::ssize(numbers) - count);
  std::vector<Constraint> taken;
  for (auto number = numbers.begin() + kept; number != numbers.end(); ++number) {
    taken.push_back(graph.constraints().at(*number));
    graph.RemoveConstraint(*number);
  }
  return taken;
}

/// A copy that the next solve does not take for one that was just solved.
PoseGraph CopyToBeSolvedAnew(const PoseGraph& graph) {
  PoseGraph copy = graph;
  const auto& [id, X_W] = *graph.nodes().begin();
  copy.SetPose(id, X_W);
  return copy;
}

struct TimedSolve {
  double ms = 0, cost = 0;
};

TimedSolve Solve(PoseGraph& graph) {
  const Stopwatch stopwatch;
  const SolveSummary summary = graph.Solve();
  if (!summary.usable) throw std::runtime_error("the graph cannot be solved");
  return {1e3 * stopwatch.seconds(), summary.final_cost};
}

double QuantileOf(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

}  // namespace

ResolveResult MeasureResolve(PoseGraph graph, int closures) {
  const std::vector<Constraint> taken = TakeLastClosures(graph, closures);
  if (taken.empty()) throw UsageError("the graph has no closures");
  StartFromTheBetter(graph);
  Solve(graph);
  graph.Solve();  // The first of the solves that keep a factor makes it.

  ResolveResult result;
  result.closures = static_cast<int>(taken.size());
  const int batch_every = std::max(1, result.closures / kBatchSolves);
  std::vector<double> ms, batch_ms;
  for (int i = 0; i < result.closures; ++i) {
    graph.AddConstraint(taken[static_cast<std::size_t>(i)]);
    std::optional<PoseGraph> anew;
    if (i % batch_every == 0) anew = CopyToBeSolvedAnew(graph);
    const TimedSolve solved = Solve(graph);
    ms.push_back(solved.ms);
    if (!anew) continue;
    const TimedSolve batch = Solve(*anew);
    batch_ms.push_back(batch.ms);
    result.largest_cost_difference =
        std::max(result.largest_cost_difference,
                 std::abs(solved.cost - batch.cost) / std::max(batch.cost, 1e-12));
  }
  result.median_ms = QuantileOf(ms, 0.5);
  result.p95_ms = QuantileOf(ms, 0.95);
  result.worst_ms = QuantileOf(ms, 1);
  result.batch_ms = QuantileOf(batch_ms, 0.5);
  return result;
}

}  // namespace vog
