#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "hardware/nav_payload/doppler.h"

namespace vog {

/// Teledyne RDI's ensembles as text, PD6 ("WorkHorse H-ADCP Operation Manual", section "PD6"): a
/// line a kind of data, each with two letters behind a colon. There is no check sum. Velocities are
/// the vehicle's.

/// :BI, :BS, :BE and (of the water) :WI, :WS, :WE; [m/s].
struct Pd6Velocity {
  std::array<std::optional<double>, 4> velocity_m_s;  ///< The fourth of BI and WI alone.
  bool good = false;                                  ///< "A", not "V".
};

/// :BD and (of the water) :WD.
struct Pd6Distance {
  double east_m = 0, north_m = 0, up_m = 0;  ///< Made good.
  double range_m = 0;                        ///< To the bottom, vertical; 0 where it is not known.
  double since_good_s = 0;                   ///< The newest good velocity.
};

/// The lines of one ensemble; those that the log was not told to send are missing.
struct Pd6Ensemble {
  std::optional<NedAttitude> attitude;  ///< :SA
  std::optional<Time> time;             ///< :TS, to 10 ms, and with it
  double salinity_ppt = 35, temperature_degc = 0, transducer_depth_m = 0, sound_speed_m_s = 1500;
  int built_in_test = 0;
  std::optional<Pd6Velocity> water_instrument, water_ship, water_earth;
  std::optional<Pd6Distance> water_distance;
  std::optional<Pd6Velocity> bottom_instrument, bottom_ship, bottom_earth;
  std::optional<Pd6Distance> bottom_distance;
};

/// Puts the lines of a stream together to ensembles.
class Pd6Reader {
 public:
  /// The ensemble that `line` completes: :BD is its last, and one without it ends where the next
  /// :SA or :TS begins one. A line that is damaged is left out.
  std::optional<Pd6Ensemble> Add(std::string_view line);

  /// Lines that begin like PD6's and are not.
  std::int64_t bad_lines() const { return bad_lines_; }

 private:
  Pd6Ensemble ensemble_;
  bool has_lines_ = false;
  std::int64_t bad_lines_ = 0;
};

/// The lines of an ensemble, each with "\r\n". Velocities are rounded to 1 mm/s, angles to 0.01
/// degrees, lengths to 0.01 m.
std::string FormatPd6(const Pd6Ensemble& ensemble);

/// Of the bottom velocity in the first frame that is good, out of instrument, ship and earth.
/// Nothing where the ensemble has no time.
std::optional<DopplerSample> ToDopplerSample(const Pd6Ensemble& ensemble);

}  // namespace vog
