#include "procs/viewer/frames.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>

#include "lib/base/random.h"
#include "lib/messages/graph_edges.h"

namespace vog {
namespace {

static_assert(std::endian::native == std::endian::little, "frames go out as they lie in memory");

/// A binary frame piece by piece.
class FrameWriter {
 public:
  FrameWriter(FrameKind kind, std::size_t count, Time time) {
    Put(static_cast<std::uint32_t>(kind));
    Put(static_cast<std::uint32_t>(count));
    Put(static_cast<double>(ToUtime(time)));
  }

  template <class Number>
  void Put(Number number) {
    bytes_.append(reinterpret_cast<const char*>(&number), sizeof(number));
  }
  void PutFloat(double number) { Put(static_cast<float>(number)); }
  void Put(const Vec3& v) {
    for (int i = 0; i < 3; ++i) PutFloat(v[i]);
  }
  void Put(const Pose3& X) {
    const Eigen::Quaterniond q(X.linear());
    Put(Vec3(X.translation()));
    for (const double number : {q.w(), q.x(), q.y(), q.z()}) PutFloat(number);
  }
  void PutText(const std::string& text) { bytes_ += text; }

  std::string Take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

/// A unit vector folded onto a square: octahedral coordinates in -127 .. 127 [Meyer et al. 2010].
std::array<std::int8_t, 2> ToOctahedral(const Vec3& direction) {
  const Vec3 p = direction / direction.cwiseAbs().sum();
  double u = p.x(), v = p.y();
  if (p.z() < 0) {
    u = (1 - std::abs(p.y())) * (p.x() < 0 ? -1 : 1);
    v = (1 - std::abs(p.x())) * (p.y() < 0 ? -1 : 1);
  }
  return {static_cast<std::int8_t>(std::lround(127 * u)),
          static_cast<std::int8_t>(std::lround(127 * v))};
}

/// From an occupied voxel to the free space around it, and away from what else is occupied.
Vec3 DirectionToFree(const BrickGrid& grid, const VoxelKey& key, LogOddsUnits occupied_from) {
  Vec3 sum = Vec3::Zero();
  for (int dz = -1; dz <= 1; ++dz)
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        const LogOddsUnits units = grid.Get({key.x + dx, key.y + dy, key.z + dz});
        if (units == kUnknownUnits) continue;
        sum += (units >= occupied_from ? -0.5 : 1.0) * Vec3(dx, dy, dz);
      }
  return sum.norm() > 1e-9 ? Vec3(sum.normalized()) : Vec3(Vec3::UnitZ());
}

/// Mixes the order, always in the same way: which voxels come first says nothing about where they
/// are.
void Scatter(std::vector<VoxelKey>& voxels) {
  Random random(0, "scatter");
  for (std::size_t i = voxels.size(); i > 1; --i)
    std::swap(voxels[i - 1], voxels[static_cast<std::size_t>(random.Index(static_cast<int>(i)))]);
}

}  // namespace

std::string SubmapFrame(const Submap& submap, LogOddsUnits occupied_from) {
  // Two neighbours as along a line at least: specks that are alone hide what matters.
  std::vector<VoxelKey> occupied = OccupiedVoxels(submap.grid, occupied_from, 2);
  Scatter(occupied);
  FrameWriter out(FrameKind::kSubmap, occupied.size(), submap.first_scan);
  out.Put(static_cast<std::uint32_t>(submap.id()));
  out.PutFloat(submap.grid.grid().voxel_size_m());
  out.Put(static_cast<double>(ToUtime(submap.last_scan)));
  for (const VoxelKey& key : occupied) {
    for (const std::int32_t index : {key.x, key.y, key.z})
      out.Put(static_cast<std::int16_t>(std::clamp(index, -32768, 32767)));
    for (const std::int8_t number : ToOctahedral(DirectionToFree(submap.grid, key, occupied_from)))
      out.Put(number);
  }
  return out.Take();
}

std::string PosesFrame(Time time, std::int64_t version, std::span<const ViewedPlace> places) {
  FrameWriter out(FrameKind::kPoses, places.size(), time);
  out.Put(static_cast<double>(version));
  for (const auto& [place, true_error_m] : places) {
    out.Put(static_cast<std::uint32_t>(place.id));
    out.Put(place.X_WM);
    out.PutFloat(std::sqrt(std::max(0.0, place.covariance_WM.topLeftCorner<3, 3>().trace())));
    out.PutFloat(true_error_m.value_or(std::nan("")));
  }
  return out.Take();
}

std::string ScanFrame(const Scan& scan) {
  FrameWriter out(FrameKind::kScan, scan.beams.size(), scan.time);
  out.Put(scan.X_BS);
  out.PutFloat(scan.min_range_m);
  out.PutFloat(scan.max_range_m);
  for (const Beam& beam : scan.beams) {
    out.PutFloat(beam.bearing_rad);
    out.PutFloat(beam.status == BeamStatus::kReturn  ? beam.range_m
                 : beam.status == BeamStatus::kClear ? 0.0f
                                                     : -1.0f);
  }
  return out.Take();
}

std::string EstimateFrame(const ViewedEstimate& estimate) {
  FrameWriter out(FrameKind::kEstimate, 0, estimate.time);
  out.Put(estimate.X_WB);
  // The perturbation is the body's: turned into W.
  const Mat3 R_WB = estimate.X_WB.linear();
  const Mat3 covariance_W = R_WB * estimate.covariance_WB.topLeftCorner<3, 3>() * R_WB.transpose();
  for (int row = 0; row < 3; ++row)
    for (int column = row; column < 3; ++column) out.PutFloat(covariance_W(row, column));
  out.PutFloat(estimate.speed_m_s);
  out.PutFloat(estimate.yaw_rate_rad_s);
  return out.Take();
}

std::string BodyFrame(FrameKind kind, Time time, const Pose3& X_WB) {
  FrameWriter out(kind, 0, time);
  out.Put(X_WB);
  return out.Take();
}

std::string GraphFrame(const graph_t& graph) {
  constexpr int kMaxFree = 2;
  FrameWriter out(FrameKind::kGraph, graph.edge.size(), TimeOf(graph.header));
  out.Put(static_cast<double>(graph.version));
  std::map<std::string, std::uint16_t> numbers = {{"", 0}};
  std::vector<std::string> reasons = {""};
  for (const graph_edge_t& edge : graph.edge) {
    const auto [reason, is_new] =
        numbers.try_emplace(edge.reason, static_cast<std::uint16_t>(reasons.size()));
    if (is_new) reasons.push_back(edge.reason);  // Their numbers have 16 bits, and there are few.
    out.Put(static_cast<std::uint32_t>(edge.from_id));
    out.Put(static_cast<std::uint32_t>(edge.to_id));
    out.Put(static_cast<std::uint8_t>(edge.kind));
    out.Put(static_cast<std::uint8_t>(edge.directions));
    out.Put(reason->second);
    out.PutFloat(edge.chi_square);
    std::vector<Vec3> free = FreeMotionsOf(edge).directions;
    free.resize(kMaxFree, Vec3::Zero());
    for (const Vec3& direction : free) out.Put(direction);
  }
  out.PutText(
      nlohmann::json(reasons).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  return out.Take();
}

std::string TrailFrame(int trail, int part, std::span<const TrailPoint> points) {
  FrameWriter out(FrameKind::kTrail, points.size(), points.empty() ? Time{} : points.back().time);
  out.Put(static_cast<std::uint32_t>(trail));
  out.Put(static_cast<std::uint32_t>(part));
  for (const TrailPoint& point : points) {
    out.Put(static_cast<double>(ToUtime(point.time)));
    out.Put(static_cast<std::int32_t>(point.anchor));
    out.Put(point.position_m);
  }
  return out.Take();
}

std::string FrontierFrame(const VoxelKey& corner, double voxel_size_m,
                          std::span<const VoxelKey> frontiers) {
  FrameWriter out(FrameKind::kFrontier, frontiers.size(), Time{});
  for (const std::int32_t index : {corner.x, corner.y, corner.z}) out.Put(index);
  out.PutFloat(voxel_size_m);
  for (const VoxelKey& key : frontiers)
    for (const std::int32_t index : {key.x - corner.x, key.y - corner.y, key.z - corner.z})
      out.Put(static_cast<std::uint8_t>(index));
  return out.Take();
}

std::string PlanFrame(const plan_t& plan) {
  using nlohmann::json;
  json path = json::array(), tree = json::array();
  for (const waypoint_t& point : plan.path)
    path.push_back({point.position_m[0], point.position_m[1], point.position_m[2], point.yaw_rad});
  for (const tree_node_t& node : plan.tree)
    tree.push_back({node.parent, node.position_m[0], node.position_m[1], node.position_m[2],
                    node.yaw_rad, node.gain, node.visible});
  return json({{"k", "plan"},
               {"t", plan.header.utime_us},
               {"id", plan.plan_id},
               {"odometry", plan.in_odometry_frame != 0},
               {"path", path},
               {"tree", tree},
               {"best", plan.best}})
      .dump();
}

}  // namespace vog
