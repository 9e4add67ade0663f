#pragma once

#include <filesystem>
#include <vector>

#include "lib/base/time.h"
#include "lib/geometry/pose.h"

namespace vog {

struct TimedPose {
  Time time;
  Pose3 X_WB = Pose3::Identity();
};

/// In order of time.
using Trajectory = std::vector<TimedPose>;

/// TUM lines, `t x y z qx qy qz qw`, that read back exactly. @throws SystemError.
void WriteTum(const std::filesystem::path& path, const Trajectory& trajectory);

/// @throws UsageError naming file and line; SystemError when the file cannot be read.
Trajectory ReadTum(const std::filesystem::path& path);

double PathLength(const Trajectory& trajectory);

}  // namespace vog
