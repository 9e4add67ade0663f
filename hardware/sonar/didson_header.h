#pragma once

#include <cstdint>
#include <optional>

#include "hardware/frames/bytes.h"
#include "lib/scan/sonar_records.h"

namespace vog {

/// The 1024 bytes before the samples of a DIDSON frame, live and in .ddf files of version 4. Values
/// are as the sonar says them: angles in degrees, no frame of ours.
struct DidsonHeader {
  std::uint32_t frame_number = 0;
  std::uint64_t frame_time = 0;
  std::uint32_t version = 0, status = 0;
  std::uint32_t year = 0, month = 0, day = 0, hour = 0, minute = 0, second = 0;
  std::uint32_t hundredths = 0;     ///< Of a second.
  std::uint32_t transmit_mode = 3;  ///< Bit 0: high frequency, bit 1: transmits.
  std::uint32_t window_start = 1;   ///< In steps, see WindowOf.
  std::uint32_t window_length = 3;  ///< 0..3.
  std::uint32_t threshold = 0, intensity = 0, receiver_gain = 0;
  float depth_m = 0, altitude_m = 0, pitch_deg = 0, roll_deg = 0, heading_deg = 0;
  float sonar_position = 0;
  std::uint32_t config_flags = 1;  ///< Bit 0: classic windows, otherwise extended.
  float prism_tilt_deg = 0;
  float water_temperature_degc = 0;
  float sonar_x = 0, sonar_y = 0, sonar_z = 0;
  float sonar_pan_deg = 0, sonar_tilt_deg = 0, sonar_roll_deg = 0;
  double vehicle_time_s = 0;  ///< Of the Bluefin vehicle, since 1970; 0 without one.
  float pan_offset_deg = 0, tilt_offset_deg = 0, roll_offset_deg = 0;
};

inline constexpr std::size_t kDidsonHeaderBytes = 1024;
inline constexpr int kDidsonBins = 512;

/// @pre bytes.size() >= kDidsonHeaderBytes. Any content is a header; WindowOf judges it.
DidsonHeader DecodeDidsonHeader(ByteSpan bytes);

/// The inverse; bytes of fields that DidsonHeader does not have are 0.
ByteVector EncodeDidsonHeader(const DidsonHeader& header);

/// 96 beams at high frequency, 48 at low.
int BeamsOf(const DidsonHeader& header);

/// Which windows the indices of a header mean.
enum class WindowTable { kFromHeader, kClassic, kExtended };

struct SonarWindow {
  double min_range_m = 0, max_range_m = 0;
};

/// The window in metres of the standard DIDSON; nothing when an index is none. The vehicle's own
/// software takes the classic table whatever the header says.
std::optional<SonarWindow> WindowOf(const DidsonHeader& header,
                                    WindowTable table = WindowTable::kFromHeader);

/// The vehicle's time, else the sonar's calendar time taken as UTC, else 0.
Time TimeOf(const DidsonHeader& header);

/// A frame as the sonar sent it: `samples[bin * beams + beam]`, from near to far.
struct DidsonFrame {
  DidsonHeader header;
  ByteVector samples;
};

/// Nothing when the header's window is none, or the samples are not those of its beams.
std::optional<SonarFrame> ToSonarFrame(const DidsonFrame& frame,
                                       WindowTable table = WindowTable::kFromHeader);

/// The inverse, with the classic window if there is one such, else the extended. Nothing when the
/// sonar has no such window, beams or bins.
std::optional<DidsonFrame> FromSonarFrame(const SonarFrame& frame);

}  // namespace vog
