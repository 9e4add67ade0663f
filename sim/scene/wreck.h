#pragma once

#include <cstdint>

#include "lib/geometry/triangle_mesh.h"
#include "sim/scene/scene_options.h"

namespace vog {

/// Shell, deck, stem, deckhouse and mast of the wreck and the sea floor under it, in W. Each part
/// is a closed shell of its own; neighbouring parts overlap. The shell's and the deck's plates have
/// an inner side too, so that the space between them is water. `seed` says where holes are and how
/// the ship broke. @throws UsageError like Validate().
TriangleMesh GenerateWreck(const WreckOptions& options, std::int64_t seed);

}  // namespace vog
