#pragma once

#include <optional>
#include <span>

#include "hardware/sonar/didson_header.h"
#include "hardware/sonar/recording.h"

namespace vog {

/// Nothing when `bytes` do not begin like a .ddf file of version 3 or 4 of 96 or 48 beams.
std::optional<RecordingLayout> DdfLayout(ByteSpan bytes);

/// `bytes` are the frame's header and samples. Nothing when the header is not that of the file's
/// frames. Version 3 has the first 256 bytes of version 4's headers: no vehicle's time.
std::optional<SonarFrame> DecodeDdfFrame(const RecordingLayout& layout, ByteSpan bytes);

enum class DdfVersion { k3 = 3, k4 = 4 };

/// A whole .ddf file. @pre all frames have as many beams, and samples for them.
ByteVector EncodeDdf(DdfVersion version, double rate_hz, std::span<const DidsonFrame> frames);

}  // namespace vog
