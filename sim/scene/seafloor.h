#pragma once

#include <cstdint>

#include "lib/geometry/triangle_mesh.h"
#include "sim/scene/scene_options.h"

namespace vog {

/// The floor and what lies on it, in W. Each part is a closed shell of its own, half sunk into the
/// floor. `seed` shapes the floor and the boulders and says where things lie. @throws UsageError
/// like Validate(), and when there is no room for everything.
TriangleMesh GenerateSeafloor(const SeafloorOptions& options, std::int64_t seed);

}  // namespace vog
