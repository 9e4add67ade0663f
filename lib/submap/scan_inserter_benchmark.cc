#include <benchmark/benchmark.h>
#include <octomap/OcTree.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "lib/scan/sonar.h"
#include "lib/submap/scan_inserter.h"

// Beams a second of ScanInserter and of OctoMap's insertPointCloud, on the scans of one submap in a
// tank. A round of each benchmark fills an empty map.

namespace vog {
namespace {

constexpr double kVoxel_m = 0.095;
constexpr double kTankRadius_m = 3.5, kTankHeight_m = 3, kMaxRange_m = 5.6;
constexpr int kScans = 100;

/// Range of the tank's wall, floor or surface; the tank is around the z axis, z = 0 at half height.
double RangeInTank(const Vec3& origin, const Vec3& direction) {
  const double a = direction.head<2>().squaredNorm();
  const double b = origin.head<2>().dot(direction.head<2>());
  const double c = origin.head<2>().squaredNorm() - kTankRadius_m * kTankRadius_m;
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const double wall_m = a > 0 ? (-b + std::sqrt(b * b - a * c)) / a : kFar;
  const double end_z = std::copysign(kTankHeight_m / 2, direction.z());
  const double end_m = direction.z() != 0 ? (end_z - origin.z()) / direction.z() : kFar;
  return std::min(wall_m, end_m);
}

/// A scan and the pose it was taken at.
struct PosedScan {
  Scan scan;
  Pose3 X_MB;
};

/// The scans of a vehicle that moves slowly, turns and tilts its sonar. It starts so far from the
/// opposite wall that level beams have no echo. They begin at the sonar, as OctoMap's do.
std::vector<PosedScan> TankScans() {
  const SonarOptions sonar;
  const std::vector<double> bearings_rad = BeamBearings(sonar);
  std::vector<PosedScan> scans;
  for (int step = 0; step < kScans; ++step) {
    const Time time = FromUtime(200'000 * step);
    PosedScan posed{{time, step, SonarPose(sonar, TiltAt(sonar, time)), 0, kMaxRange_m, {}},
                    MakePose({-2.4 + 0.01 * step, 0.004 * step, 0.002 * step},
                             {0.02, -0.03, -0.3 + 0.01 * step})};
    const Pose3 X_MS = posed.X_MB * posed.scan.X_BS;
    for (const double bearing_rad : bearings_rad) {
      Beam beam{static_cast<float>(bearing_rad), 0, 1, BeamStatus::kClear};
      const double range_m =
          RangeInTank(X_MS.translation(), X_MS.linear() * BeamDirection(beam.bearing_rad));
      if (range_m <= kMaxRange_m) {
        beam.status = BeamStatus::kReturn;
        beam.range_m = static_cast<float>(range_m);
      }
      posed.scan.beams.push_back(beam);
    }
    scans.push_back(posed);
  }
  return scans;
}

/// A scan as OctoMap takes it: the points of beams without an echo lie beyond the longest range.
struct Cloud {
  octomap::Pointcloud points_M;
  octomap::point3d origin_M;
};

octomap::point3d ToOctomap(const Vec3& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

std::vector<Cloud> CloudsOf(const std::vector<PosedScan>& scans) {
  std::vector<Cloud> clouds;
  for (const auto& [scan, X_MB] : scans) {
    const Pose3 X_MS = X_MB * scan.X_BS;
    Cloud cloud{{}, ToOctomap(X_MS.translation())};
    for (const Beam& beam : scan.beams) {
      const double range_m =
          beam.status == BeamStatus::kReturn ? beam.range_m : 2 * scan.max_range_m;
      cloud.points_M.push_back(ToOctomap(X_MS * (range_m * BeamDirection(beam.bearing_rad))));
    }
    clouds.push_back(cloud);
  }
  return clouds;
}

void CountBeams(benchmark::State& state) {
  const auto beams = static_cast<std::int64_t>(kScans * SonarOptions().beams);
  state.SetItemsProcessed(state.iterations() * beams);
}

void Octomap(benchmark::State& state, bool lazy) {
  const std::vector<Cloud> clouds = CloudsOf(TankScans());
  for (auto _ : state) {
    octomap::OcTree tree(kVoxel_m);
    for (const Cloud& cloud : clouds)
      tree.insertPointCloud(cloud.points_M, cloud.origin_M, kMaxRange_m, lazy,
                            /*discretize=*/false);
    if (lazy) tree.updateInnerOccupancy();
    benchmark::DoNotOptimize(tree.size());
  }
  CountBeams(state);
}
BENCHMARK_CAPTURE(Octomap, eager, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Octomap, lazy, true)->Unit(benchmark::kMillisecond);

void Inserter(benchmark::State& state, WalkForm form) {
  if (!Supports(form)) return state.SkipWithError("not on this processor");
  const std::vector<PosedScan> scans = TankScans();
  for (auto _ : state) {
    BrickGrid grid(kVoxel_m);
    ScanInserter inserter(SensorModel(SensorModelOptions{}), kVoxel_m, form);
    for (const auto& [scan, X_MB] : scans) inserter.Insert(scan, X_MB, grid);
    benchmark::DoNotOptimize(grid.bricks());
  }
  CountBeams(state);
}
BENCHMARK_CAPTURE(Inserter, baseline, WalkForm::kBaseline)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Inserter, avx2, WalkForm::kAvx2)->Unit(benchmark::kMillisecond);

/// Prints beams a second of each benchmark, and how many times those of the first that is.
class RatioReporter : public benchmark::ConsoleReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override {
    ConsoleReporter::ReportRuns(runs);
    for (const Run& run : runs) {
      const auto rate = run.counters.find("items_per_second");
      if (rate == run.counters.end()) continue;
      if (first_ == 0) first_ = rate->second;
      std::printf("  %-40s %6.2f Mbeams/s, x %.1f\n", run.benchmark_name().c_str(),
                  rate->second / 1e6, rate->second / first_);
    }
  }

 private:
  double first_ = 0;
};

}  // namespace
}  // namespace vog

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  vog::RatioReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
}
