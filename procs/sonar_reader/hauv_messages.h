#pragma once

#include <optional>

#include "hauv/didson_t.hpp"
#include "lib/scan/sonar_records.h"

namespace vog {

/// HAUV_DIDSON_FRAME of HAUVs' logs (package hauv of perls): a DIDSON's frame of 96 beams. Windows
/// are of the classic table, whatever the header says, as the vehicle's own software reads them.
/// Nothing where the header names no window. The frame number of those logs is none: the time
/// counts.
std::optional<SonarFrame> FromMessage(const hauv::didson_t& message);

}  // namespace vog
