#pragma once

#include <array>
#include <cstdint>

#include "lib/base/time.h"

namespace vog {

/// One frame on a CAN bus (ISO 11898-1), classic or FD.
struct CanFrame {
  std::uint32_t id = 0;  ///< 11 bits, or 29 where `extended`; of an error frame: its class.
  bool extended = false, remote = false, error = false, fd = false;
  std::uint8_t fd_flags = 0;  ///< Bit 0: bit-rate switch, bit 1: error state. Of FD frames only.
  std::uint8_t size = 0;      ///< Bytes of data: up to 8, of FD up to 64.
  std::array<std::uint8_t, 64> data{};  ///< 0 beyond `size`.
  Time time{};                          ///< When it was received.

  bool operator==(const CanFrame&) const = default;
};

inline constexpr std::uint8_t kMaxClassicSize = 8, kMaxFdSize = 64;
inline constexpr std::uint32_t kMaxStandardId = 0x7FF, kMaxExtendedId = 0x1FFFFFFF;

}  // namespace vog
