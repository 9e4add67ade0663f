#include "tools/slam/rerun.h"

#include <algorithm>
#include <map>
#include <numbers>
#include <utility>

#include "lib/base/errors.h"
#include "lib/base/random.h"
#include "lib/bus/stopwatch.h"
#include "lib/posegraph/g2o.h"

namespace vog {
namespace {

/// Makes registrations wrong.
class Saboteur {
 public:
  explicit Saboteur(const FaultOptions& options) : options_(options) {}

  void Spoil(SubmapId target, SubmapId source, IcpResult& registration) {
    if (!registration.usable) return;
    if (left_ == 0) {
      Random random(options_.seed, "faults", static_cast<std::uint64_t>(groups_++));
      // Groups come as often as their share asks for.
      is_wrong_ = random.Chance(options_.share);
      wrong_ = AnyMotion(random);
      left_ = options_.group;
    }
    --left_;
    if (!is_wrong_) return;
    registration.X_ik = registration.X_ik * wrong_;
    spoilt_.emplace(std::pair(target, source), registration.X_ik);
  }

  /// Not any of its pair: two may be registered alone and, again, as parts of regions.
  bool HasSpoilt(const LoopClosure& loop) const {
    const auto [begin, end] = spoilt_.equal_range({loop.from, loop.to});
    return std::any_of(begin, end, [&](const auto& wrong) {
      return wrong.second.matrix() == loop.constraint.X_ik.matrix();
    });
  }

 private:
  Pose3 AnyMotion(Random& random) const {
    const double direction = random.Uniform(-std::numbers::pi, std::numbers::pi);
    const double shift_m = random.Uniform(options_.least_shift_m, options_.most_shift_m);
    const double turn_deg = random.Uniform(options_.least_turn_deg, options_.most_turn_deg) *
                            (random.Chance(0.5) ? 1 : -1);
    // Half of the faults are shifts, the others turns.
    if (random.Chance(0.5))
      return MakePose({shift_m * std::cos(direction), shift_m * std::sin(direction), 0});
    return MakePose(Vec3::Zero(), {0, 0, turn_deg * std::numbers::pi / 180});
  }

  FaultOptions options_;
  int groups_ = 0, left_ = 0;
  bool is_wrong_ = false;
  Pose3 wrong_ = Pose3::Identity();
  std::multimap<std::pair<SubmapId, SubmapId>, Pose3> spoilt_;
};

void RejectGaps(const StoredMap& map) {
  if (map.submaps.empty()) throw UsageError("the map has no submaps");
  SubmapId expected = map.submaps.front()->id();
  for (const SubmapPtr& submap : map.submaps) {
    if (submap->id() != expected)
      throw UsageError("submap " + std::to_string(expected) +
                       " is missing: odometry is told from one submap to the next");
    ++expected;
  }
}

RerunSummary Summarise(const Slam& slam, const Saboteur& saboteur,
                       const std::vector<double>& seconds) {
  RerunSummary summary;
  for (const Slam::Closure& closure : slam.closures()) {
    const LoopClosure& loop = closure.loop;
    const bool is_fault = saboteur.HasSpoilt(loop);
    summary.faults += is_fault ? 1 : 0;
    if (!loop.accepted) {
      ++summary.rejected[loop.reason];
      continue;
    }
    summary.faults_kept += is_fault ? 1 : 0;
    ++(loop.constraint.kind == ConstraintKind::kFullClosure ? summary.full : summary.partial);
  }
  const auto median = [](std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
    return values[values.size() / 2];
  };
  const std::size_t tenth = (seconds.size() + 9) / 10;
  summary.median_s = median(seconds);
  summary.last_tenth_median_s = median({seconds.end() - tenth, seconds.end()});
  summary.worst_s = *std::max_element(seconds.begin(), seconds.end());
  return summary;
}

}  // namespace

Rerun RerunSlam(const StoredMap& map, const SlamSettings& settings, const FaultOptions& faults,
                const std::function<void(double)>& show) {
  RejectGaps(map);
  Saboteur saboteur(faults);
  Slam slam(settings, [&](SubmapId target, SubmapId source, IcpResult& registration) {
    saboteur.Spoil(target, source, registration);
  });
  std::vector<double> seconds;
  std::map<SubmapId, double> revisits;
  for (const SubmapPtr& submap : map.submaps) {
    show(static_cast<double>(seconds.size()) / static_cast<double>(map.submaps.size()));
    const Stopwatch stopwatch;
    slam.AddSubmap(submap);
    revisits = slam.ExpectedRevisits();  // vog-slam asks after each, too.
    seconds.push_back(stopwatch.seconds());
  }
  show(1);
  std::vector<std::pair<NodeId, NodeId>> from_first;
  for (const SubmapPtr& submap : map.submaps)
    from_first.emplace_back(map.submaps.front()->id(), submap->id());
  Rerun rerun{
      map, {}, slam.BodyCovariances(from_first), revisits, Summarise(slam, saboteur, seconds)};
  for (const auto& [id, X_WC] : slam.graph().nodes()) rerun.X_WC.push_back(X_WC);
  rerun.map.X_WM = slam.X_WM();
  rerun.map.graph_g2o = ToG2oText(slam.ToG2o());
  return rerun;
}

}  // namespace vog
