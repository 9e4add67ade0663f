#pragma once

#include <array>
#include <optional>

#include "hardware/nav_payload/byte_framer.h"
#include "hardware/nav_payload/doppler.h"

namespace vog {

/// What PD5 says more than PD4.
struct Pd5Extra {
  int salinity_ppt = 35;
  double depth_m = 0;
  double pitch_rad = 0, roll_rad = 0, heading_rad = 0;            ///< As NedAttitude.
  std::array<double, 4> distance_bottom_m{}, distance_water_m{};  ///< Made good.
};

/// Teledyne RDI's short binary ensembles PD4 (47 bytes) and PD5 (88 bytes) ("WorkHorse Commands and
/// Output Data Format", sections "PD4" and "PD5"). Velocities are the vehicle's.
struct Pd45Ensemble {
  DopplerFrame frame = DopplerFrame::kInstrument;
  bool uses_tilts = false, uses_three_beams = true;
  std::uint8_t frequency = 4;  ///< 2: 300, 3: 600, 4: 1200 kHz.
  std::array<std::optional<double>, 4> bottom_velocity_m_s, water_velocity_m_s;
  std::array<std::optional<double>, 4> range_m;      ///< Vertical.
  std::uint8_t bottom_status = 0, water_status = 0;  ///< Bits of RDI's: 0 is good.
  double layer_start_m = 0, layer_end_m = 0;         ///< Of the water that is tracked.
  Duration time_of_first_ping{};                     ///< Since midnight, to 10 ms.
  std::uint16_t built_in_test = 0;
  double sound_speed_m_s = 1500;
  double temperature_degc = 0;
  std::optional<Pd5Extra> extra;  ///< Of PD5.
};

/// Finds ensembles with a right check sum in a stream; holds at most kMaxPd45Size bytes.
inline constexpr std::size_t kMaxPd45Size = 88;
ByteFramer MakePd45Framer();

/// Reads one ensemble, check sum included. Nothing where it is damaged, or its clock shows no time.
std::optional<Pd45Ensemble> DecodePd45(ByteSpan bytes);
/// PD5 where there is `extra`, else PD4. Ranges are rounded to 1 cm, velocities to 1 mm/s, layers
/// and distances to 1 dm, angles to 0.01 degrees.
ByteVector EncodePd45(const Pd45Ensemble& ensemble);

/// `time` is `time_of_first_ping`, dated. PD4 knows no attitude: 0.
DopplerSample ToDopplerSample(const Pd45Ensemble& ensemble, Time time);

}  // namespace vog
