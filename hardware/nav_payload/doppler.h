#pragma once

#include <array>
#include <optional>

#include "hardware/nav_payload/ned_frames.h"
#include "lib/base/config.h"
#include "lib/base/time.h"
#include "lib/navigation/records.h"

namespace vog {

/// Where a Doppler log's four velocities point. The instrument's frame I: x from beam 1 to beam 2,
/// y from beam 4 to beam 3, z away from the bottom; of a log that looks down with beam 3 ahead, x
/// is starboard and y forward. The ship's: starboard, forward, up. The earth's: east, north, up.
enum class DopplerFrame {
  kBeam,        ///< Of the four beams.
  kInstrument,  ///< x, y, z of I, error velocity.
  kShip,        ///< Starboard, forward, up, error velocity.
  kEarth,       ///< East, north, up, error velocity.
};

/// What any Doppler log of Teledyne RDI's line says of the bottom. Velocities are the vehicle's
/// over the bottom (PD4, PD5, PD6; PD0 has the opposite sign): along a beam positive where the
/// vehicle moves away from where it points.
struct DopplerSample {
  Time time{};
  DopplerFrame frame = DopplerFrame::kInstrument;
  std::array<std::optional<double>, 4> velocity_m_s;
  std::array<std::optional<double>, 4> range_m;  ///< Vertical, without the slant's 1/cos.
  NedAttitude attitude;                          ///< Of the ship, as the log knows it.
  bool is_levelled = false;  ///< The ship's frame was turned by roll and pitch already.
};

/// How a Doppler log sits on the vehicle. The default looks down with beam 3 ahead.
struct DopplerOptions {
  double beam_angle_deg = 30;
  Eigen::Vector3d mounting_rpy_deg = {0, 0, -90};

  void Visit(OptionsVisitor& v) {
    v("beam_angle_deg", beam_angle_deg, Between(5, 60), "between each beam and the log's axis");
    v("mounting_rpy_deg", mounting_rpy_deg, Between(-360, 360),
      "roll, pitch and yaw of the log's frame (x to beam 2, y to beam 3, z away from the bottom) "
      "on "
      "the body, or on the servo that tilts it");
  }
};

/// R_BI: mounted on a servo that stands at `servo_pitch_rad` (bow up positive).
Mat3 DopplerRotation(const DopplerOptions& options, double servo_pitch_rad = 0);

/// The velocity of I from those along four beams of a Janus log [RDI, "ADCP Coordinate
/// Transformation", 1998]. Where one beam is bad, it is taken so that the error velocity is zero;
/// nothing where more are.
std::optional<Vec3> FromBeams(const std::array<std::optional<double>, 4>& velocity_m_s,
                              double beam_angle_rad);
/// Its inverse, without error velocity.
std::array<double, 4> ToBeams(const Vec3& velocity_I_m_s, double beam_angle_rad);

/// The record of the log that is turned by `R_BI`; invalid where the velocity is not known. The
/// log's lever arm is not taken into account.
DvlRecord ToDvlRecord(const DopplerSample& sample, const DopplerOptions& options, const Mat3& R_BI,
                      std::int64_t sequence);

/// The sample that gives the record back, without ranges.
DopplerSample ToDopplerSample(const DvlRecord& record, DopplerFrame frame,
                              const NedAttitude& attitude, const DopplerOptions& options,
                              const Mat3& R_BI);

}  // namespace vog
