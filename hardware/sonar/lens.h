#pragma once

#include <vector>

namespace vog {

/// How beam numbers become bearings.
enum class BeamSpacing { kUniform, kLens };

/// Bearings [rad] of the beams of a DIDSON, ascending with the beam's number, 0 ahead: 28.8 degrees
/// in equal steps, or as the lens bends them. The lens: Johannsson's cubic of beam over bearing,
/// inverted.
/// @throws UsageError if `beams` is neither 96 nor 48.
std::vector<double> DidsonBearings(int beams, BeamSpacing spacing);

/// The lens's beam at a bearing, counted from 0 and not rounded. Beams outside of the fan have
/// numbers too. @throws UsageError as above.
double LensBeamAt(int beams, double bearing_rad);

}  // namespace vog
