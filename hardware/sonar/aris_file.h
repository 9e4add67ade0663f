#pragma once

#include <optional>
#include <span>

#include "hardware/sonar/recording.h"

namespace vog {

inline constexpr char kArisFormat[] = "DDF_05";

/// Nothing when `bytes` do not begin like an .aris file with a first frame.
std::optional<RecordingLayout> ArisLayout(ByteSpan bytes);

/// `bytes` are the frame's header and samples. Nothing when the header has other beams or samples
/// than the file's first, or no window. The time is that of the recording host.
std::optional<SonarFrame> DecodeArisFrame(const RecordingLayout& layout, ByteSpan bytes);

/// A whole .aris file of frames of `beams` 48, 96, 64 or 128. Its windows are exact to the
/// microsecond of the sound's way at 1500 m/s.
/// @pre all frames have as many beams and bins, and samples for them.
ByteVector EncodeAris(double rate_hz, std::span<const SonarFrame> frames);

}  // namespace vog
