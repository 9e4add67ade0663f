#pragma once

#include <cstdint>

#include "lib/geometry/triangle_mesh.h"
#include "sim/scene/scene_options.h"

namespace vog {

/// The piles with their braces, what is on top of them and the sea floor, in W. Each part is a
/// closed shell of its own; neighbouring parts overlap. `seed` says how the piles differ.
/// @throws UsageError like Validate().
TriangleMesh GeneratePier(const PierOptions& options, std::int64_t seed);

}  // namespace vog
