#include "lib/evaluation/coverage.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <unordered_set>

#include "lib/scan/sonar.h"

namespace vog {
namespace {

/// The n-th number of the van der Corput sequence in a base: evenly spread over [0, 1).
double VanDerCorput(std::uint64_t n, int base) {
  double value = 0, digit = 1;
  for (++n; n > 0; n /= base) {
    digit /= base;
    value += digit * static_cast<double>(n % base);
  }
  return value;
}

struct Ray {
  Vec3 direction_W;
  double range_m;
  bool has_echo;
};

/// Calls `visit` with the beams that say something.
template <class Visit>
void ForEachRay(const Scan& scan, const Pose3& X_WS, Visit visit) {
  for (const Beam& beam : scan.beams) {
    if (beam.status == BeamStatus::kUncertain) continue;
    const bool has_echo = beam.status == BeamStatus::kReturn;
    visit(Ray{X_WS.linear() * BeamDirection(beam.bearing_rad),
              has_echo ? beam.range_m : scan.max_range_m, has_echo});
  }
}

double Share(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

std::vector<SurfaceSample> SampleSurface(const TriangleMesh& mesh_W, double spacing_m) {
  std::vector<SurfaceSample> samples;
  double owed = 0;  // Area that small triangles hand on to the next.
  for (const auto& triangle : mesh_W.triangles) {
    const Vec3& a = mesh_W.vertices[triangle[0]];
    const Vec3 ab = mesh_W.vertices[triangle[1]] - a, ac = mesh_W.vertices[triangle[2]] - a;
    const Vec3 cross = ab.cross(ac);
    owed += 0.5 * cross.norm() / (spacing_m * spacing_m);
    for (; owed >= 1; owed -= 1) {
      double u = VanDerCorput(samples.size(), 2), v = VanDerCorput(samples.size(), 3);
      if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
      }
      samples.push_back({a + u * ab + v * ac, cross.normalized()});
    }
  }
  return samples;
}

Reachability::Reachability(const TrueWorld& world, const Eigen::AlignedBox3d& box_W,
                           const Vec3& start_W, double step_m)
    : world_(world) {
  // Numbers of lattice places relative to the start.
  std::unordered_set<VoxelKey> visited = {VoxelKey{}};
  std::deque<VoxelKey> front = {VoxelKey{}};
  constexpr std::array<VoxelKey, 6> kSteps = {
      {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
  while (!front.empty()) {
    const VoxelKey at = front.front();
    front.pop_front();
    const Vec3 p_W = start_W + step_m * Vec3(at.x, at.y, at.z);
    if (!world.hull_fits(p_W)) continue;
    places_W_.push_back(p_W);
    for (const VoxelKey& step : kSteps) {
      const VoxelKey next{at.x + step.x, at.y + step.y, at.z + step.z};
      const Vec3 next_W = start_W + step_m * Vec3(next.x, next.y, next.z);
      if (box_W.contains(next_W) && visited.insert(next).second) front.push_back(next);
    }
  }
}

bool Reachability::IsVisible(const Vec3& p_W, double range_m, const Vec3* normal_W) const {
  return std::any_of(places_W_.begin(), places_W_.end(), [&](const Vec3& place_W) {
    const Vec3 to_place = place_W - p_W;
    return to_place.squaredNorm() <= range_m * range_m &&
           (normal_W == nullptr || normal_W->dot(to_place) > 0) &&
           !world_.is_occluded(place_W, p_W);
  });
}

std::optional<double> CoverageCurve::TimeTo(double share) const {
  for (const Point& point : points) {
    if (point.share >= share) return point.time_s;
  }
  return std::nullopt;
}

SurfaceCoverage::SurfaceCoverage(std::vector<SurfaceSample> reachable, double tolerance_m)
    : samples_(std::move(reachable)),
      tolerance_m_(tolerance_m),
      cells_(tolerance_m),
      seen_(samples_.size(), false) {
  for (std::size_t i = 0; i < samples_.size(); ++i)
    samples_in_cell_[cells_.KeyOf(samples_[i].position_W_m)].push_back(
        static_cast<std::uint32_t>(i));
}

void SurfaceCoverage::SeeAround(const Vec3& end_W, const Vec3& direction_W) {
  const VoxelKey key = cells_.KeyOf(end_W);
  ForEachVoxel({{key.x - 1, key.y - 1, key.z - 1}, {key.x + 1, key.y + 1, key.z + 1}},
               [&](const VoxelKey& cell) {
                 const auto found = samples_in_cell_.find(cell);
                 if (found == samples_in_cell_.end()) return;
                 for (const std::uint32_t i : found->second) {
                   const SurfaceSample& sample = samples_[i];
                   if (seen_[i] || sample.normal_W.dot(direction_W) >= 0 ||
                       (sample.position_W_m - end_W).norm() > tolerance_m_)
                     continue;
                   seen_[i] = true;
                   ++count_;
                 }
               });
}

void SurfaceCoverage::AddScan(const Scan& scan, const Pose3& X_WB_true) {
  const Pose3 X_WS = X_WB_true * scan.X_BS;
  ForEachRay(scan, X_WS, [&](const Ray& ray) {
    if (ray.has_echo)
      SeeAround(X_WS.translation() + ray.range_m * ray.direction_W, ray.direction_W);
  });
  curve_.points.push_back({ToSeconds(scan.time), Share(count_, samples_.size())});
}

VolumeCoverage::VolumeCoverage(const VoxelGrid& grid, const VoxelBox& box,
                               std::vector<bool> reachable)
    : grid_(grid), box_(box), missing_(std::move(reachable)) {
  reachable_ = static_cast<std::size_t>(std::count(missing_.begin(), missing_.end(), true));
}

void VolumeCoverage::AddScan(const Scan& scan, const Pose3& X_WB_true) {
  const Pose3 X_WS = X_WB_true * scan.X_BS;
  ForEachRay(scan, X_WS, [&](const Ray& ray) {
    const Vec3 start_W = X_WS.translation() + scan.min_range_m * ray.direction_W;
    WalkVoxels(grid_, start_W, ray.direction_W, ray.range_m - scan.min_range_m,
               [&](const VoxelKey& voxel, double) {
                 if (!box_.Contains(voxel)) return true;
                 const std::size_t i = box_.IndexOf(voxel);
                 if (missing_[i]) {
                   missing_[i] = false;
                   ++seen_;
                 }
                 return true;
               });
  });
  curve_.points.push_back({ToSeconds(scan.time), Share(seen_, reachable_)});
}

}  // namespace vog
