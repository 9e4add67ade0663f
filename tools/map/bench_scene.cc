#include "tools/map/bench_scene.h"

#include <algorithm>
#include <memory>
#include <numbers>

#include "lib/base/parallel.h"
#include "lib/scan/range_detector.h"
#include "sim/scene/scene.h"
#include "sim/sensors/sonar_model_options.h"

namespace vog {
namespace {

const Vec3 kHull_m = {1.0, 1.0, 0.5};

/// The windows and speeds of config/mission/tank.toml and propeller.toml.
SonarOptions SonarIn(SceneKind kind) {
  SonarOptions sonar;
  if (kind != SceneKind::kTank) return sonar;
  sonar.max_range_m = 5.63;
  sonar.rate_hz = 10;
  sonar.tilt_rate_deg_s = 20;
  return sonar;
}

/// Where the vehicle's centre may be. In the tank all of it is inside the round wall.
Eigen::AlignedBox3d VehicleBoxIn(SceneKind kind) {
  const Vec3 half_m = kind == SceneKind::kTank ? Vec3(2.4, 2.4, 1.2) : Vec3(6, 3.5, 1.75);
  return {-half_m, half_m};
}

TriangleMesh MeshOf(SceneKind kind) {
  SceneSettings settings;
  settings.scene.kind = kind;
  return MakeScene(settings);
}

}  // namespace

BenchScene::BenchScene(SceneKind kind, std::uint64_t seed)
    : seed_(seed),
      sonar_(SonarIn(kind)),
      vehicle_box_W_(VehicleBoxIn(kind)),
      space_(MeshOf(kind), kHull_m) {}

Waypoint BenchScene::AnyPose(Random& random) const {
  const Vec3 &lo = vehicle_box_W_.min(), &hi = vehicle_box_W_.max();
  const double x = random.Uniform(lo.x(), hi.x()), y = random.Uniform(lo.y(), hi.y()),
               z = random.Uniform(lo.z(), hi.z());
  return {{x, y, z}, random.Uniform(-std::numbers::pi, std::numbers::pi)};
}

Waypoint BenchScene::FreePose(Random& random) const {
  Waypoint pose = AnyPose(random);
  while (!space_.Fits(pose.position_W_m)) pose = AnyPose(random);
  return pose;
}

Waypoint BenchScene::FreePoseNear(const Waypoint& from, double reach_m, Random& random) const {
  for (;;) {
    const Waypoint pose = FreePose(random);
    if (LengthOf(from, pose) <= reach_m) return pose;
  }
}

BenchScene::Way BenchScene::WayOf(SubmapId id) const {
  constexpr double kLength_m = 1, kTurn_rad = 0.8;
  constexpr int kSamples = 5;
  Random random(seed_, "bench way", id);
  for (;;) {
    const Waypoint from = FreePose(random);
    Waypoint to = from;
    to.position_W_m += random.GaussianVector(Vec3::Constant(kLength_m / 2));
    to.yaw_rad += random.Uniform(-kTurn_rad, kTurn_rad);
    const auto is_free = [&](int sample) {
      const Vec3 p_W = Interpolate(from, to, static_cast<double>(sample) / kSamples).position_W_m;
      return vehicle_box_W_.contains(p_W) && space_.Fits(p_W);
    };
    int free = 0;
    while (free < kSamples && is_free(free + 1)) ++free;
    if (free == kSamples) return {from, to};
  }
}

Scan BenchScene::Ping(Time time, const Pose3& X_WB, Random& random) const {
  const SonarModelOptions model;
  Scan scan{time,
            ToUtime(time),
            SonarPose(sonar_, TiltAt(sonar_, time)),
            sonar_.min_range_m,
            sonar_.max_range_m,
            {}};
  const Pose3 X_WS = X_WB * scan.X_BS;
  for (const double bearing_rad : BeamBearings(sonar_)) {
    const auto hit = space_.scene().Cast(
        X_WS.translation(), X_WS.linear() * BeamDirection(bearing_rad), sonar_.max_range_m);
    const double range_m = hit ? hit->range_m + random.Gaussian(model.range_noise_m) : 0;
    const bool has_echo = range_m >= sonar_.min_range_m && range_m <= sonar_.max_range_m;
    scan.beams.push_back({static_cast<float>(bearing_rad),
                          has_echo ? static_cast<float>(range_m) : 0, has_echo ? 1.0f : 0.0f,
                          has_echo ? BeamStatus::kReturn : BeamStatus::kUncertain});
  }
  ClassifySilentBeams(RangeDetectorOptions{}.guard_beams, scan.beams);
  return scan;
}

std::vector<PosedScan> BenchScene::ScansOf(SubmapId id) const {
  const Way way = WayOf(id);
  Random random(seed_, "bench scans", id);
  std::vector<PosedScan> scans;
  for (int i = 0; i < submap_.scans_per_submap; ++i) {
    const double share = static_cast<double>(i) / submap_.scans_per_submap;
    const Pose3 X_WB = Interpolate(way.from, way.to, share).X_WB();
    scans.push_back({Ping(Time{} + i * sonar_.period(), X_WB, random), X_WB});
  }
  return scans;
}

BenchSubmap BenchScene::SubmapOf(SubmapId id) const {
  const std::vector<PosedScan> scans = ScansOf(id);
  const auto submap =
      std::make_shared<Submap>(Submap{.base = {},
                                      .first_scan = scans.front().scan.time,
                                      .last_scan = scans.back().scan.time,
                                      .scans = static_cast<int>(scans.size()),
                                      .X_ML = Ominus(scans.front().X_WB, scans.back().X_WB),
                                      .grid = BrickGrid(submap_.voxel_size_m)});
  submap->base.id = id;
  ScanInserter inserter(SensorModel(SensorModelOptions{}), submap_.voxel_size_m);
  for (const PosedScan& posed : scans)
    inserter.Insert(posed.scan, Ominus(scans.front().X_WB, posed.X_WB), submap->grid);
  submap->grid.Compact();
  Random random(seed_, "bench poses", id);
  return {submap, Nudged(scans.front().X_WB, random)};
}

Pose3 Nudged(const Pose3& X_WM, Random& random) {
  constexpr double kSigma_m = 0.02, kSigma_rad = 0.004;
  Vec6 xi;
  xi << random.GaussianVector(Vec3::Constant(kSigma_m)),
      random.GaussianVector(Vec3::Constant(kSigma_rad));
  return X_WM * Exp(xi);
}

std::vector<BenchSubmap> MakeSubmaps(const BenchScene& scene, int count,
                                     const std::function<void(double)>& show) {
  constexpr int kBatch = 50;
  std::vector<BenchSubmap> submaps(count);
  for (int begin = 0; begin < count; begin += kBatch) {
    show(static_cast<double>(begin) / count);
    ParallelFor(std::min(kBatch, count - begin), [&](std::size_t i) {
      submaps[begin + i] = scene.SubmapOf(begin + static_cast<int>(i));
    });
  }
  return submaps;
}

}  // namespace vog
