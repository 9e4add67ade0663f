#include "tools/map/bench_method.h"

#include <algorithm>
#include <limits>

#include "lib/baselines/make_submap_map.h"
#include "lib/collision/collision_checker.h"
#include "lib/planner/planner_options.h"
#include "tools/map/bench_clock.h"

namespace vog {
namespace {

constexpr int kRepeats = 5, kClosures = 3;
constexpr double kNanosecond = 1e-9, kMicrosecond = 1e-6, kMillisecond = 1e-3;

/// Notes the boxes of voxels that are read.
class BoxNotes final : public OccupancyMap {
 public:
  explicit BoxNotes(double voxel_size_m) : OccupancyMap(voxel_size_m, 0) {}

  const std::vector<VoxelBox>& boxes() const { return boxes_; }

  void LogOddsAt(std::span<const Vec3>, std::span<float>) const override {}
  void LogOddsOf(std::span<const VoxelKey>, std::span<float>) const override {}
  void LogOddsIn(const VoxelBox&, std::vector<float>&) const override {}
  void NotFreeIn(const VoxelBox& box, std::vector<VoxelAnswer>& voxels) const override {
    boxes_.push_back(box);
    voxels.clear();
  }
  void CastRay(const Vec3&, const Vec3&, double, std::vector<RayVoxel>&) const override {}
  std::int64_t revision() const override { return 0; }

 private:
  mutable std::vector<VoxelBox> boxes_;
};

/// As if the vehicle knew where it is relative to each submap by so much; the newest best.
std::vector<std::pair<SubmapId, double>> SomeSigmas(std::span<const BenchSubmap> submaps) {
  constexpr double kLeast_m = 0.02, kMost_m = 0.1;
  std::vector<std::pair<SubmapId, double>> sigmas_m;
  for (std::size_t i = 0; i < submaps.size(); ++i) {
    const double age = 1 - static_cast<double>(i) / static_cast<double>(submaps.size());
    sigmas_m.emplace_back(submaps[i].submap->id(), kLeast_m + age * (kMost_m - kLeast_m));
  }
  return sigmas_m;
}

/// One method on one map.
class MethodBench {
 public:
  MethodBench(const BenchMethod& method, const BenchScene& scene,
              std::span<const BenchSubmap> submaps, const BenchWorkload& workload)
      : scene_(scene), submaps_(submaps), workload_(workload), method_(method) {
    map_ = MakeSubmapMap(method.method, scene.voxel_size_m(), SensorModel(SensorModelOptions{}));
    for (const auto& [submap, X_WM] : submaps) map_->Place(submap, X_WM);
    map_->SetSigmas(SomeSigmas(submaps));
    ChooseStepRays();
  }

  MethodFigures Measure() {
    const int all = static_cast<int>(submaps_.size());
    MethodFigures figures;
    figures.query_ns = Query_s() / kNanosecond;
    figures.ray_5m_ns = Ray_s() / kNanosecond;
    figures.planning_step_ms = WarmStep_s() / kMillisecond;
    figures.planning_step_after_closure_ms = StepAfterMoving_s(all) / kMillisecond;
    figures.planning_step_after_10_moved_ms = StepAfterMoving_s(std::min(10, all)) / kMillisecond;
    figures.planning_step_rays = step_rays_;
    MeasureCollisions(figures);
    return figures;
  }

 private:
  // Reads of voxels, about.
  static constexpr double kReadsOfRay = 50, kReadsOfPose = 4000;

  /// How many of `count` items a measurement takes: fewer where each read asks every submap, so
  /// that it is done before long.
  std::size_t Affordable(std::size_t count, double reads_each) const {
    constexpr double kLeast = 3;
    const double all = static_cast<double>(count);
    const double affordable =
        method_.most_look_ups / (reads_each * static_cast<double>(submaps_.size()));
    return static_cast<std::size_t>(std::clamp(affordable, std::min(kLeast, all), all));
  }

  void ChooseStepRays() {
    constexpr std::size_t kAll = kStepViews * kViewRays;
    const std::size_t count = Affordable(kAll, kReadsOfRay);
    step_views_.resize(workload_.step_views.size());
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t ray = kAll * i / count, view = ray / kViewRays;
      step_views_[view].origin_W = workload_.step_views[view].origin_W;
      step_views_[view].directions_W.push_back(
          workload_.step_views[view].directions_W[ray % kViewRays]);
    }
    step_rays_ = count;
  }

  double Query_s() const {
    const std::span<const VoxelKey> voxels(workload_.known_voxels.data(),
                                           Affordable(workload_.known_voxels.size(), 1));
    std::vector<float> log_odds(voxels.size());
    const auto query = [&] { map_->LogOddsOf(voxels, log_odds); };
    query();
    return MedianSeconds(kRepeats, query) / static_cast<double>(voxels.size());
  }

  double Ray_s() const {
    const std::span<const BenchRay> rays(workload_.rays.data(),
                                         Affordable(workload_.rays.size(), kReadsOfRay));
    const auto cast = [&] {
      for (const BenchRay& ray : rays) map_->FirstHit(ray.origin_W, ray.direction_W, kRayLength_m);
    };
    cast();
    return MedianSeconds(kRepeats, cast) / static_cast<double>(rays.size());
  }

  /// A planning step; where some of its rays stand for all, their time does too.
  double Step_s() const {
    return SecondsOf([&] { CountUnknown(*map_, step_views_); }) * (kStepViews * kViewRays) /
           static_cast<double>(step_rays_);
  }

  double WarmStep_s() const {
    Step_s();
    return MedianOf(kRepeats, [&] { return Step_s(); });
  }

  /// Moving counts too: some methods do their work then, others when they are asked.
  double StepAfterMoving_s(int count) {
    return MedianOf(kClosures, [&] {
      const PosesWM poses = CorrectedPoses(scene_, submaps_, count, round_++);
      Step_s();
      const double move_s = SecondsOf([&] { map_->Move(poses); });
      return move_s + Step_s();
    });
  }

  void MeasureCollisions(MethodFigures& figures) const {
    const CollisionChecker checker(PlannerOptions{}.collision_rules());
    const std::span<const Waypoint> poses(workload_.poses.data(),
                                          Affordable(workload_.poses.size(), kReadsOfPose));
    BoxNotes notes(scene_.voxel_size_m());
    for (const Waypoint& pose : poses) checker.IsFree(notes, pose);
    const auto check = [&] {
      for (const Waypoint& pose : poses) checker.IsFree(*map_, pose);
    };
    std::vector<VoxelAnswer> not_free;
    const auto read = [&] {
      for (const VoxelBox& box : notes.boxes()) map_->NotFreeIn(box, not_free);
    };
    check();
    const double count = static_cast<double>(poses.size());
    figures.collision_us = MedianSeconds(kRepeats, check) / count / kMicrosecond;
    figures.collision_broad_us = MedianSeconds(kRepeats, read) / count / kMicrosecond;
  }

  const BenchScene& scene_;
  std::span<const BenchSubmap> submaps_;
  const BenchWorkload& workload_;
  const BenchMethod& method_;
  std::unique_ptr<SubmapMap> map_;
  std::vector<BenchView> step_views_;  // All rays of a step, or some that stand for all.
  std::size_t step_rays_ = 0;
  int round_ = 0;
};

}  // namespace

const std::vector<BenchMethod>& AllBenchMethods() {
  constexpr double kAnyNumber = std::numeric_limits<double>::infinity();
  constexpr int kAnySize = std::numeric_limits<int>::max();
  // An octree takes some 0.5 MB.
  constexpr int kOctrees = 2000;
  static const std::vector<BenchMethod> methods = {
      {MapMethod::kCached, kAnyNumber, kAnySize},
      {MapMethod::kDirect, 1.2e7, kAnySize},
      {MapMethod::kAlgorithm1, 2e6, kOctrees},
      {MapMethod::kIncrementalMerge, kAnyNumber, kAnySize}};
  return methods;
}

MethodFigures MeasureMethod(const BenchMethod& method, const BenchScene& scene,
                            std::span<const BenchSubmap> submaps, const BenchWorkload& workload) {
  return MethodBench(method, scene, submaps, workload).Measure();
}

}  // namespace vog
