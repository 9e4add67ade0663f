#pragma once

#include <optional>

#include "foxglove/FrameTransform.pb.h"
#include "foxglove/FrameTransforms.pb.h"
#include "foxglove/Log.pb.h"
#include "foxglove/PointCloud.pb.h"
#include "foxglove/PoseInFrame.pb.h"
#include "foxglove/PosesInFrame.pb.h"
#include "foxglove/RawImage.pb.h"
#include "foxglove/SceneUpdate.pb.h"
#include "lib/submap/submap.h"
#include "vog/graph_t.hpp"
#include "vog/nav_t.hpp"
#include "vog/plan_t.hpp"
#include "vog/pose_estimate_t.hpp"
#include "vog/scan_t.hpp"
#include "vog/sonar_frame_t.hpp"
#include "vog/status_t.hpp"
#include "vog/submap_poses_t.hpp"
#include "vog/truth_t.hpp"
#include "vog/vehicle_nav_t.hpp"

namespace vog {

// Messages as programs that know Foxglove's schemas draw them. Frames have their letters as names:
// W, O, B and S, and M0, M1 ... for the submaps'. Nothing comes of a message with values that no
// sender of ours can mean.

/// X_WB.
std::optional<foxglove::PoseInFrame> ToFoxglove(const truth_t& message);
std::optional<foxglove::PoseInFrame> ToFoxglove(const pose_estimate_t& message);
/// X_OB.
std::optional<foxglove::PoseInFrame> ToFoxglove(const nav_t& message);
std::optional<foxglove::PoseInFrame> ToFoxglove(const vehicle_nav_t& message);

/// The echoes in B: x, y, z [m] and strength, 32-bit floats.
std::optional<foxglove::PointCloud> ToFoxglove(const scan_t& message);

/// A row a range bin, from near to far; a column a beam.
std::optional<foxglove::RawImage> ToFoxglove(const sonar_frame_t& message);

/// The path, in W or O.
std::optional<foxglove::PosesInFrame> ToFoxglove(const plan_t& message);
/// All X_WM.
std::optional<foxglove::PosesInFrame> ToFoxglove(const submap_poses_t& message);

/// What is wrong, as a warning; "ok" for information.
std::optional<foxglove::Log> ToFoxglove(const status_t& message);

/// The edges in W, lines in a colour a kind. Those to submaps that `places` does not know are left
/// out.
std::optional<foxglove::SceneUpdate> ToFoxglove(const graph_t& message,
                                                const submap_poses_t& places);

/// The occupied voxels as cubes in the submap's own frame, with which they move, without those that
/// are almost alone; the colour tells submaps apart. Voxels of the same submap replace each other.
foxglove::SceneUpdate VoxelsOf(const Submap& submap, LogOddsUnits occupied_from);
/// Takes all of those away.
foxglove::SceneUpdate NoVoxels(std::uint64_t time_ns);

/// Where frames are: B in O, O in W, and the submaps' in W.
std::optional<foxglove::FrameTransform> FrameOf(const nav_t& message);
std::optional<foxglove::FrameTransform> FrameOf(const pose_estimate_t& message);
std::optional<foxglove::FrameTransforms> FrameOf(const submap_poses_t& message);

/// A message's time as MCAP has it; times before 1970 or after 2262 become the nearest one between.
std::uint64_t NanosecondsOf(std::int64_t utime_us);

}  // namespace vog
