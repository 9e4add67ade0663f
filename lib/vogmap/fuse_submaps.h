#pragma once

#include <span>

#include "lib/vogmap/submap_map.h"

namespace vog {

/// One submap in the frame of `into` that stands for `into` and `others` at their present poses.
/// At the centre c of each of its voxels,
///
///   L(c) = clamp( sum_i L_i(X_MiM * c) ),   X_MiM = X_WMi^-1 * X_WM,
///
/// over the parts that observed the place, as in eq. 5; unknown where none did. All but the voxels
/// is that of `into`. The order of `others` does not matter.
///
/// What a map answers with the fused submap in place of the parts differs in two ways only:
///  - Each part but `into` is asked at the centre of the voxel of `into` that holds the point: at
///    most half a voxel's diagonal away from it. `into` is asked where it was asked before. Where
///    all voxels coincide, nothing changes.
///  - What the parts say together is clamped before the other submaps are added. Where it passes a
///    clamp, another submap that contradicts weighs more than before.
/// As long as no clamp cuts, fusing in steps is the same as fusing at once.
///
/// @throws std::length_error where BrickGrid does: the parts span too much.
SubmapPtr Fuse(const PlacedSubmap& into, std::span<const PlacedSubmap> others,
               const SensorModel& model);

/// The share (0..1) of the bricks of `part` whose middle lies in a brick of `whole`; 0 without any.
double OverlapOf(const PlacedSubmap& part, const PlacedSubmap& whole);

}  // namespace vog
