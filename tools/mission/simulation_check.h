#pragma once

#include "procs/sim/sim_node.h"

namespace vog {

/// The simulator's settings, after a look whether the mission can be flown at all: the scene is
/// there, the vehicle starts in free water inside the exploration box, and fits into it.
/// @throws UsageError that says what to set.
SimSettings CheckedSimSettings(const Config& config);

}  // namespace vog
