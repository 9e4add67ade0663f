#pragma once

#include <memory>
#include <utility>

#include "hardware/link/link.h"

namespace vog {

/// Two ends in one process: what is written to one is read from the other. Each direction holds at
/// most kMaxLoopbackBytes bytes or kMaxLoopbackFrames frames. Bytes and frames come without a
/// time; where one end is gone, the other is closed once it is empty.
inline constexpr std::size_t kMaxLoopbackBytes = 1 << 16, kMaxLoopbackFrames = 1024;
std::pair<std::unique_ptr<ByteLink>, std::unique_ptr<ByteLink>> MakeLoopback();
std::pair<std::unique_ptr<CanLink>, std::unique_ptr<CanLink>> MakeCanLoopback();

}  // namespace vog
