#include "tools/map/bench_check.h"

#include <algorithm>
#include <bit>
#include <memory>

#include "lib/baselines/make_submap_map.h"
#include "lib/submap/scan_inserter.h"
#include "tools/map/bench_workload.h"

namespace vog {
namespace {

constexpr int kSteps = 200;

/// Two maps with one history.
class History {
 public:
  History(const BenchScene& scene, std::span<const BenchSubmap> submaps)
      : scene_(&scene),
        submaps_(submaps),
        random_(scene.seed(), "bench history"),
        open_scans_(scene.ScansOf(0)),
        cached_(MakeSubmapMap(MapMethod::kCached, scene.voxel_size_m(), kModel)),
        direct_(MakeSubmapMap(MapMethod::kDirect, scene.voxel_size_m(), kModel)) {}

  void Step(int step) {
    switch (random_.Index(8)) {
      case 0:
        Move(static_cast<int>(submaps_.size()), step);
        break;
      case 1:
        Move(1 + random_.Index(static_cast<int>(submaps_.size())), step);
        break;
      case 2:
        Remove();
        break;
      case 3:
        GrowOpen();
        break;
      case 4:
        ReopenOrClose();
        break;
      default:
        Place();
    }
  }

  /// Compares about `count` answers; adds to `figures`.
  void Compare(std::int64_t count, CheckFigures& figures) {
    const auto share = static_cast<std::size_t>(count / 4 + 1);
    ComparePoints(share, figures);
    CompareVoxels(share, figures);
    CompareBoxes(share, figures);
    CompareRays(share, figures);
  }

 private:
  inline static const SensorModel kModel{SensorModelOptions{}};

  const BenchSubmap& AnySubmap() {
    return submaps_[random_.Index(static_cast<int>(submaps_.size()))];
  }

  template <class Change>
  void OnBoth(Change change) {
    change(*cached_);
    change(*direct_);
  }

  void Place() {
    const auto& [submap, X_WM] = AnySubmap();
    const Pose3 X_placed = Nudged(X_WM, random_);
    OnBoth([&](SubmapMap& map) { map.Place(submap, X_placed); });
  }

  void Move(int count, int round) {
    const PosesWM poses = CorrectedPoses(*scene_, submaps_, count, round);
    OnBoth([&](SubmapMap& map) { map.Move(poses); });
  }

  void Remove() {
    const SubmapId id = AnySubmap().submap->id();
    OnBoth([&](SubmapMap& map) { map.Remove(id); });
  }

  void ReopenOrClose() {
    OnBoth([](SubmapMap& map) { map.SetOpen(nullptr, Pose3::Identity()); });
    open_.reset();
    if (random_.Chance(0.3)) return;
    open_ = std::make_unique<BrickGrid>(scene_->voxel_size_m());
    inserter_ = std::make_unique<ScanInserter>(kModel, scene_->voxel_size_m());
    const Pose3 X_WM = Nudged(open_scans_.front().X_WB, random_);
    OnBoth([&](SubmapMap& map) { map.SetOpen(open_.get(), X_WM); });
    GrowOpen();
  }

  void GrowOpen() {
    if (open_ == nullptr) return;
    for (int i = 0; i < 10; ++i) {
      const PosedScan& posed = open_scans_[random_.Index(static_cast<int>(open_scans_.size()))];
      inserter_->Insert(posed.scan, Ominus(open_scans_.front().X_WB, posed.X_WB), *open_);
    }
    OnBoth([](SubmapMap& map) { map.NoteOpenGrew(); });
  }

  /// Compares `answers` with those of the direct map at `points_W`.
  void CompareWithDirect(const std::vector<Vec3>& points_W, const std::vector<float>& answers,
                         CheckFigures& figures) {
    std::vector<float> truth(points_W.size());
    direct_->LogOddsAt(points_W, truth);
    figures.checks += static_cast<std::int64_t>(points_W.size());
    for (std::size_t i = 0; i < points_W.size(); ++i)
      figures.differences +=
          std::bit_cast<std::uint32_t>(truth[i]) != std::bit_cast<std::uint32_t>(answers[i]);
  }

  std::vector<Vec3> CentersOf(const std::vector<VoxelKey>& voxels) const {
    std::vector<Vec3> centers_W;
    for (const VoxelKey& voxel : voxels) centers_W.push_back(cached_->grid().CenterOf(voxel));
    return centers_W;
  }

  Vec3 AnyPoint_W() {
    // Twice the vehicle's box reaches beyond the walls, where nothing is known.
    return 2 * scene_->AnyPose(random_).position_W_m;
  }
  VoxelKey AnyVoxel() { return cached_->grid().KeyOf(AnyPoint_W()); }

  void ComparePoints(std::size_t count, CheckFigures& figures) {
    std::vector<Vec3> points_W;
    while (points_W.size() < count) points_W.push_back(AnyPoint_W());
    std::vector<float> answers(count);
    cached_->LogOddsAt(points_W, answers);
    CompareWithDirect(points_W, answers, figures);
  }

  void CompareVoxels(std::size_t count, CheckFigures& figures) {
    std::vector<VoxelKey> voxels;
    while (voxels.size() < count) voxels.push_back(AnyVoxel());
    std::vector<float> answers(count);
    cached_->LogOddsOf(voxels, answers);
    CompareWithDirect(CentersOf(voxels), answers, figures);
  }

  void CompareBoxes(std::size_t count, CheckFigures& figures) {
    std::vector<VoxelKey> voxels;
    std::vector<float> answers;
    for (std::size_t read = 0; read < count; read += voxels.size()) {
      const VoxelKey corner = AnyVoxel();
      const VoxelBox box{corner,
                         {corner.x + random_.Index(20), corner.y + random_.Index(20),
                          corner.z + random_.Index(20)}};
      voxels.clear();
      ForEachVoxel(box, [&](const VoxelKey& voxel) { voxels.push_back(voxel); });
      cached_->LogOddsIn(box, answers);
      CompareWithDirect(CentersOf(voxels), answers, figures);
    }
  }

  void CompareRays(std::size_t count, CheckFigures& figures) {
    std::vector<VoxelKey> voxels;
    std::vector<float> answers;
    std::vector<RayVoxel> ray;
    while (voxels.size() < count) {
      const Pose3 X_WB = scene_->AnyPose(random_).X_WB();
      cached_->CastRay(X_WB.translation(), X_WB.linear().col(0), kRayLength_m, ray);
      for (const RayVoxel& voxel : ray) {
        voxels.push_back(voxel.key);
        answers.push_back(voxel.log_odds);
      }
    }
    CompareWithDirect(CentersOf(voxels), answers, figures);
  }

  const BenchScene* scene_;
  std::span<const BenchSubmap> submaps_;
  Random random_;
  std::vector<PosedScan> open_scans_;
  std::unique_ptr<SubmapMap> cached_, direct_;
  std::unique_ptr<BrickGrid> open_;
  std::unique_ptr<ScanInserter> inserter_;
};

}  // namespace

CheckFigures CheckAnswers(const BenchScene& scene, std::span<const BenchSubmap> submaps,
                          std::int64_t checks, const std::function<void(double)>& show) {
  CheckFigures figures;
  History history(scene, submaps);
  for (int step = 0; step < kSteps && figures.checks < checks; ++step) {
    show(static_cast<double>(step) / kSteps);
    history.Step(step);
    history.Compare((checks - figures.checks) / (kSteps - step) + 1, figures);
  }
  return figures;
}

}  // namespace vog
