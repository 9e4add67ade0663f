#pragma once

#include <array>
#include <optional>

#include "hardware/nav_payload/byte_framer.h"
#include "hardware/nav_payload/doppler.h"

namespace vog {

/// Teledyne RDI's binary ensembles PD0 ("WorkHorse Commands and Output Data Format", section
/// "PD0"): a header with a table of offsets, data of several kinds, a check sum. Read here: fixed
/// leader (0x0000), variable leader (0x0080), bottom track (0x0600); the others are passed over.

/// How the log is set up.
struct Pd0FixedLeader {
  std::uint8_t firmware_version = 50, firmware_revision = 0;
  /// Bits as RDI has them; this is 1200 kHz, four beams of a Janus, 30 degrees.
  std::uint16_t system_configuration = 0x4204;
  std::uint8_t pings_per_ensemble = 1;
  DopplerFrame frame = DopplerFrame::kInstrument;
  bool uses_tilts = false, uses_three_beams = true, maps_bins = false;
  std::uint32_t serial_number = 0;
  std::uint8_t beam_angle_deg = 30;  ///< 0 where older firmware does not say.

  bool operator==(const Pd0FixedLeader&) const = default;
};

/// What changes with each ensemble.
struct Pd0VariableLeader {
  std::uint32_t ensemble = 0;  ///< 24 bits.
  Time time{};                 ///< The log's own clock, to 10 ms.
  std::uint16_t built_in_test = 0;
  double sound_speed_m_s = 1500;
  double transducer_depth_m = 0;
  double heading_rad = 0, pitch_rad = 0, roll_rad = 0;  ///< As NedAttitude.
  int salinity_ppt = 35;
  double temperature_degc = 0;
};

/// What the bottom echoed, a value a beam. The velocities are as on the wire: of the bottom seen
/// from the log, which is the opposite of the vehicle's.
struct Pd0BottomTrack {
  std::array<std::optional<double>, 4> range_m;  ///< Vertical, up to 167 km.
  std::array<std::optional<double>, 4> velocity_m_s;
  std::array<std::uint8_t, 4> correlation{}, amplitude{}, percent_good{};
};

struct Pd0Ensemble {
  Pd0FixedLeader fixed;
  Pd0VariableLeader variable;
  std::optional<Pd0BottomTrack> bottom_track;
};

/// Finds ensembles with a right check sum in a stream; holds at most kMaxPd0Size bytes.
inline constexpr std::size_t kMaxPd0Size = 8192;
ByteFramer MakePd0Framer();

/// Reads one ensemble, check sum included. Nothing where it is damaged, has no leaders, or a clock
/// that shows no date.
std::optional<Pd0Ensemble> DecodePd0(ByteSpan bytes);
/// Lengths are rounded to 1 cm, of the transducer's depth to 1 dm; velocities to 1 mm/s; angles to
/// 0.01 degrees.
ByteVector EncodePd0(const Pd0Ensemble& ensemble);

/// With the sign turned to the vehicle's velocity. Empty velocities without bottom track.
DopplerSample ToDopplerSample(const Pd0Ensemble& ensemble);
/// The bottom track of such a sample.
Pd0BottomTrack ToPd0BottomTrack(const DopplerSample& sample);

/// The frame in two bits of RDI's, as all its formats have it: 0 beam .. 3 earth.
DopplerFrame FrameOfBits(int bits);
int BitsOf(DopplerFrame frame);

}  // namespace vog
