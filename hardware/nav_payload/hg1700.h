#pragma once

#include <array>
#include <optional>

#include "hardware/nav_payload/byte_framer.h"

namespace vog {

/// Honeywell's HG1700 inertial unit: SDLC frames of address 0x0A, a message's number, its data and
/// a check sequence, least significant byte first. The flags between frames are the line's, and
/// gone.

/// The variants, which differ in the step of their velocities.
enum class Hg1700Model { kAg11, kAg17, kAg58, kAg62 };

/// Message 2 has more than message 1: what was gathered over its period of 10 ms.
struct Hg1700Increments {
  std::array<double, 3> angle_rad{}, velocity_m_s{};
};

/// Message 1 (flight control, 600 Hz) or 2 (inertial, 100 Hz), in the unit's own axes.
struct Hg1700Record {
  std::array<double, 3> rate_rad_s{}, acceleration_m_s2{};
  std::uint16_t status = 0, status_multiplexed = 0;
  std::optional<Hg1700Increments> increments;  ///< Of message 2.
};

/// Finds messages with a right check sequence in a stream; holds at most kMaxHg1700Size bytes.
inline constexpr std::size_t kMaxHg1700Size = 44;
ByteFramer MakeHg1700Framer();

/// Reads one message, check sequence included; nothing where it is damaged.
std::optional<Hg1700Record> DecodeHg1700(ByteSpan bytes, Hg1700Model model);
/// Message 2 where there are increments, else 1. Steps: rates 600 * 2^-20 rad/s, accelerations 600
/// * 2^-14 ft/s^2, angles 2^-33 rad, velocities 2^-27 ft/s (AG11, AG58) or 2^-26 ft/s (AG17, AG62).
ByteVector EncodeHg1700(const Hg1700Record& record, Hg1700Model model);

/// The check sequence of SDLC (ISO/IEC 13239): CRC-16 of CCITT, preset to ones, inverted.
std::uint16_t SdlcCheckOf(ByteSpan bytes);

}  // namespace vog
