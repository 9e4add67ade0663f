#pragma once

#include <cstdint>
#include <optional>

#include "hardware/nav_payload/bluefin_records.h"
#include "hardware/nav_payload/doppler.h"
#include "hardware/nav_payload/time_of_day.h"

namespace vog {

/// Makes records of a front seat's sentences, which tell parts of them: the reckoned position (CNV)
/// belongs to an attitude (RNV) and velocities (NVR), rates (IMU) to an attitude, velocities along
/// beams (DV2) to the angle of the log's servo (PIT). Where no NVR comes, velocities are those
/// between one pose and the next.
class BluefinReader {
 public:
  BluefinReader(const PressureOptions& pressure, const DopplerOptions& doppler)
      : pressure_(pressure), doppler_(doppler) {}

  /// The record that the sentence completes. `now` dates the first time of day.
  std::optional<NavigationRecord> Add(const Sentence& sentence, Time now);

  /// The newest reckoned pose.
  const std::optional<VehicleNavRecord>& newest() const { return newest_; }

 private:
  Time Dated(Duration time_of_day, Time now);
  void Take(const NvrSentence& nvr) { nvr_ = nvr; }
  void Take(const RcmSentence& rcm) { attitude_ = AttitudeOf(rcm); }
  void Take(const PitSentence& pit) { servo_pitch_rad_ = pit.dvl_pitch_rad; }
  void Take(const RnvSentence& rnv);
  VehicleNavRecord WithVelocity(VehicleNavRecord record) const;

  PressureOptions pressure_;
  DopplerOptions doppler_;
  std::optional<TimeOfDayClock> clock_;
  RnvSentence rnv_;
  std::optional<NvrSentence> nvr_;
  std::optional<NedAttitude> attitude_;
  std::optional<VehicleNavRecord> newest_;
  double servo_pitch_rad_ = 0;
  std::int64_t sequence_ = 0;
};

}  // namespace vog
