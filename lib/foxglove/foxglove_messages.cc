#include "lib/foxglove/foxglove_messages.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <string>

#include "lib/foxglove/utf8.h"
#include "lib/messages/convert.h"

namespace vog {
namespace {

google::protobuf::Timestamp TimestampOf(std::uint64_t time_ns) {
  constexpr std::uint64_t kSecond_ns = 1'000'000'000;
  google::protobuf::Timestamp timestamp;
  timestamp.set_seconds(static_cast<std::int64_t>(time_ns / kSecond_ns));
  timestamp.set_nanos(static_cast<std::int32_t>(time_ns % kSecond_ns));
  return timestamp;
}

google::protobuf::Timestamp TimestampOf(const header_t& header) {
  return TimestampOf(NanosecondsOf(header.utime_us));
}

std::string FrameName(SubmapId id) { return "M" + std::to_string(id); }

template <class Message>
Message InFrame(const header_t& header, const char* frame) {
  Message message;
  *message.mutable_timestamp() = TimestampOf(header);
  message.set_frame_id(frame);
  return message;
}

template <class Vector>
void CopyTo(const Vec3& v, Vector& vector) {
  vector.set_x(v.x());
  vector.set_y(v.y());
  vector.set_z(v.z());
}

void CopyTo(const Eigen::Quaterniond& q, foxglove::Quaternion& quaternion) {
  quaternion.set_x(q.x());
  quaternion.set_y(q.y());
  quaternion.set_z(q.z());
  quaternion.set_w(q.w());
}

void CopyTo(const Pose3& X_AB, foxglove::Pose& pose) {
  CopyTo(X_AB.translation(), *pose.mutable_position());
  CopyTo(Eigen::Quaterniond(X_AB.linear()), *pose.mutable_orientation());
}

/// X_AB, with the name of A.
std::optional<foxglove::PoseInFrame> PoseIn(const char* frame, const header_t& header,
                                            const pose_t& pose) {
  const auto X_AB = FromMessage(pose);
  if (!X_AB) return std::nullopt;
  auto drawn = InFrame<foxglove::PoseInFrame>(header, frame);
  CopyTo(*X_AB, *drawn.mutable_pose());
  return drawn;
}

/// X_AB, with the names of A and B.
foxglove::FrameTransform Transform(const std::string& parent, const std::string& child,
                                   const header_t& header, const Pose3& X_AB) {
  foxglove::FrameTransform transform;
  *transform.mutable_timestamp() = TimestampOf(header);
  transform.set_parent_frame_id(parent);
  transform.set_child_frame_id(child);
  CopyTo(X_AB.translation(), *transform.mutable_translation());
  CopyTo(Eigen::Quaterniond(X_AB.linear()), *transform.mutable_rotation());
  return transform;
}

std::optional<foxglove::FrameTransform> Transform(const char* parent, const char* child,
                                                  const header_t& header, const pose_t& pose) {
  const auto X_AB = FromMessage(pose);
  return X_AB ? std::optional(Transform(parent, child, header, *X_AB)) : std::nullopt;
}

void DescribePoints(foxglove::PointCloud& cloud) {
  std::uint32_t offset = 0;
  for (const char* name : {"x", "y", "z", "strength"}) {
    foxglove::PackedElementField& field = *cloud.add_fields();
    field.set_name(name);
    field.set_offset(offset);
    field.set_type(foxglove::PackedElementField::FLOAT32);
    offset += sizeof(float);
  }
  cloud.set_point_stride(offset);
  CopyTo(Pose3::Identity(), *cloud.mutable_pose());
}

bool IsFinite(const waypoint_t& waypoint) {
  return std::isfinite(waypoint.yaw_rad) &&
         std::all_of(std::begin(waypoint.position_m), std::end(waypoint.position_m),
                     [](double number) { return std::isfinite(number); });
}

foxglove::Color ColorOf(double red, double green, double blue) {
  foxglove::Color color;
  color.set_r(red);
  color.set_g(green);
  color.set_b(blue);
  color.set_a(1);
  return color;
}

/// Submaps that follow each other, and those that meet in a closure, seldom have the same one.
foxglove::Color ColorOf(SubmapId id) {
  constexpr std::array<std::array<double, 3>, 7> kOkabeIto = {{{0.90, 0.62, 0.00},
                                                               {0.34, 0.71, 0.91},
                                                               {0.00, 0.62, 0.45},
                                                               {0.94, 0.89, 0.26},
                                                               {0.00, 0.45, 0.70},
                                                               {0.84, 0.37, 0.00},
                                                               {0.80, 0.47, 0.65}}};
  const auto& [red, green, blue] = kOkabeIto[static_cast<std::size_t>(id) % kOkabeIto.size()];
  return ColorOf(red, green, blue);
}

/// How the edges of one kind are drawn. The colours are Okabe and Ito's, as on the live page.
struct EdgeStyle {
  std::int8_t kind;
  double red, green, blue;
  double width_px;
};
constexpr std::array kEdgeStyles = {
    EdgeStyle{graph_edge_t::ODOMETRY, 0.49, 0.55, 0.60, 1.5},
    EdgeStyle{graph_edge_t::FULL_CLOSURE, 0.12, 0.78, 0.63, 3},
    EdgeStyle{graph_edge_t::PARTIAL_CLOSURE, 0.94, 0.89, 0.26, 2.5},
    EdgeStyle{graph_edge_t::REJECTED_CLOSURE, 0.91, 0.45, 0.23, 1},
};

using Positions = std::map<std::int32_t, Vec3>;

Positions PositionsOf(const submap_poses_t& places) {
  Positions positions_W_m;
  for (std::size_t i = 0; i < places.X_WM.size(); ++i)
    positions_W_m[places.submap_id[i]] = Vec3(places.X_WM[i].position_m);
  return positions_W_m;
}

/// The edges of one kind.
foxglove::LinePrimitive LinesOf(const graph_t& graph, const Positions& positions_W_m,
                                const EdgeStyle& style) {
  foxglove::LinePrimitive lines;
  lines.set_type(foxglove::LinePrimitive::LINE_LIST);
  CopyTo(Pose3::Identity(), *lines.mutable_pose());
  lines.set_thickness(style.width_px);
  lines.set_scale_invariant(true);
  *lines.mutable_color() = ColorOf(style.red, style.green, style.blue);
  for (const graph_edge_t& edge : graph.edge) {
    const auto from = positions_W_m.find(edge.from_id), to = positions_W_m.find(edge.to_id);
    if (edge.kind != style.kind || from == positions_W_m.end() || to == positions_W_m.end())
      continue;
    CopyTo(from->second, *lines.add_points());
    CopyTo(to->second, *lines.add_points());
  }
  return lines;
}

}  // namespace

std::optional<foxglove::PoseInFrame> ToFoxglove(const truth_t& message) {
  return PoseIn("W", message.header, message.X_WB);
}

std::optional<foxglove::PoseInFrame> ToFoxglove(const pose_estimate_t& message) {
  return PoseIn("W", message.header, message.X_WB);
}

std::optional<foxglove::PoseInFrame> ToFoxglove(const nav_t& message) {
  return PoseIn("O", message.header, message.X_OB);
}

std::optional<foxglove::PoseInFrame> ToFoxglove(const vehicle_nav_t& message) {
  return PoseIn("O", message.header, message.X_OB);
}

std::optional<foxglove::PointCloud> ToFoxglove(const scan_t& message) {
  const auto scan = FromMessage(message);
  if (!scan) return std::nullopt;
  auto cloud = InFrame<foxglove::PointCloud>(message.header, "B");
  DescribePoints(cloud);
  const std::vector<Vec3> points_B_m = EndPoints_B(*scan);
  std::size_t next = 0;
  for (const Beam& beam : scan->beams) {
    if (beam.status != BeamStatus::kReturn) continue;
    const Eigen::Vector3f p_B = points_B_m[next++].cast<float>();
    const std::array point = {p_B.x(), p_B.y(), p_B.z(), beam.strength};
    cloud.mutable_data()->append(reinterpret_cast<const char*>(point.data()), sizeof(point));
  }
  return cloud;
}

std::optional<foxglove::RawImage> ToFoxglove(const sonar_frame_t& message) {
  const auto frame = FromMessage(message);
  if (!frame) return std::nullopt;
  auto image = InFrame<foxglove::RawImage>(message.header, "S");
  image.set_width(static_cast<std::uint32_t>(frame->beams));
  image.set_height(static_cast<std::uint32_t>(frame->bins));
  image.set_encoding("mono8");
  image.set_step(image.width());
  image.set_data(frame->samples.data(), frame->samples.size());
  return image;
}

std::optional<foxglove::PosesInFrame> ToFoxglove(const plan_t& message) {
  if (!std::all_of(message.path.begin(), message.path.end(), IsFinite)) return std::nullopt;
  auto drawn =
      InFrame<foxglove::PosesInFrame>(message.header, message.in_odometry_frame ? "O" : "W");
  for (const waypoint_t& waypoint : message.path)
    CopyTo(MakePose(Vec3(waypoint.position_m), {0, 0, waypoint.yaw_rad}), *drawn.add_poses());
  return drawn;
}

std::optional<foxglove::PosesInFrame> ToFoxglove(const submap_poses_t& message) {
  const auto places = FromMessage(message);
  if (!places) return std::nullopt;
  auto drawn = InFrame<foxglove::PosesInFrame>(message.header, "W");
  for (const SubmapPlace& place : *places) CopyTo(place.X_WM, *drawn.add_poses());
  return drawn;
}

std::optional<foxglove::Log> ToFoxglove(const status_t& message) {
  foxglove::Log log;
  *log.mutable_timestamp() = TimestampOf(message.header);
  log.set_level(message.health == "ok" ? foxglove::Log::INFO : foxglove::Log::WARNING);
  log.set_name(ToUtf8(message.process));
  log.set_message(ToUtf8(message.health));
  return log;
}

std::optional<foxglove::SceneUpdate> ToFoxglove(const graph_t& message,
                                                const submap_poses_t& places) {
  const Positions positions_W_m = PositionsOf(places);
  foxglove::SceneUpdate update;
  foxglove::SceneEntity& entity = *update.add_entities();
  entity = InFrame<foxglove::SceneEntity>(message.header, "W");
  entity.set_id("graph");
  for (const EdgeStyle& style : kEdgeStyles) {
    const foxglove::LinePrimitive lines = LinesOf(message, positions_W_m, style);
    if (lines.points_size() > 0) *entity.add_lines() = lines;
  }
  return update;
}

foxglove::SceneUpdate VoxelsOf(const Submap& submap, LogOddsUnits occupied_from) {
  constexpr int kMinNeighbours = 2;  // As along a line.
  const double side_m = submap.grid.grid().voxel_size_m();
  foxglove::SceneUpdate update;
  foxglove::SceneEntity& entity = *update.add_entities();
  *entity.mutable_timestamp() = TimestampOf(NanosecondsOf(ToUtime(submap.last_scan)));
  entity.set_frame_id(FrameName(submap.id()));
  entity.set_id(FrameName(submap.id()));
  entity.set_frame_locked(true);
  for (const Vec3& p_M : OccupiedPoints(submap.grid, occupied_from, kMinNeighbours)) {
    foxglove::CubePrimitive& cube = *entity.add_cubes();
    CopyTo(MakePose(p_M), *cube.mutable_pose());
    CopyTo(Vec3(Vec3::Constant(side_m)), *cube.mutable_size());
    *cube.mutable_color() = ColorOf(submap.id());
  }
  return update;
}

foxglove::SceneUpdate NoVoxels(std::uint64_t time_ns) {
  foxglove::SceneUpdate update;
  foxglove::SceneEntityDeletion& deletion = *update.add_deletions();
  *deletion.mutable_timestamp() = TimestampOf(time_ns);
  deletion.set_type(foxglove::SceneEntityDeletion::ALL);
  return update;
}

std::optional<foxglove::FrameTransform> FrameOf(const nav_t& message) {
  return Transform("O", "B", message.header, message.X_OB);
}

std::optional<foxglove::FrameTransform> FrameOf(const pose_estimate_t& message) {
  return Transform("W", "O", message.header, message.X_WO);
}

std::optional<foxglove::FrameTransforms> FrameOf(const submap_poses_t& message) {
  const auto places = FromMessage(message);
  if (!places) return std::nullopt;
  foxglove::FrameTransforms frames;
  for (const SubmapPlace& place : *places)
    *frames.add_transforms() = Transform("W", FrameName(place.id), message.header, place.X_WM);
  return frames;
}

std::uint64_t NanosecondsOf(std::int64_t utime_us) {
  constexpr std::int64_t kLast_us = std::numeric_limits<std::int64_t>::max() / 1000;
  return 1000 * static_cast<std::uint64_t>(std::clamp<std::int64_t>(utime_us, 0, kLast_us));
}

}  // namespace vog
