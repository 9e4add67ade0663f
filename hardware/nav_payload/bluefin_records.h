#pragma once

#include <optional>

#include "hardware/nav_payload/bluefin_sentences.h"
#include "hardware/nav_payload/ned_frames.h"
#include "hardware/nav_payload/pressure.h"
#include "lib/navigation/records.h"

namespace vog {

/// The front seat's sentences as our records and back: FRD and NED become B (x forward, y left, z
/// up) and W (x east, y north, z up). `time` is the sentence's own, dated by a TimeOfDayClock.

/// A velocity is asked for as the place (GBP) and the turn (RBO) of so much later: the interface
/// has no command for velocities.
inline constexpr double kBluefinLookahead_s = 1;

NedAttitude AttitudeOf(const NvgSentence& nvg);
NedAttitude AttitudeOf(const RcmSentence& rcm);
NedAttitude AttitudeOf(const RnvAbsolute& rnv);

/// Valid where all three velocities are there.
DvlRecord ToDvlRecord(const DvlSentence& dvl, Time time, std::int64_t sequence);
/// Without ranges and temperature.
DvlSentence ToDvlSentence(const DvlRecord& record);

/// The sentence has the rates alone: the attitude is the newest of another sentence.
ImuRecord ToImuRecord(const ImuSentence& imu, const NedAttitude& attitude, Time time,
                      std::int64_t sequence);
/// The accelerations, which records do not hold, stay 0.
ImuSentence ToImuSentence(const ImuRecord& record);

/// Nothing where the fix has no depth.
std::optional<DepthRecord> ToDepthRecord(const NvgSentence& nvg, Time time, std::int64_t sequence);
DepthRecord ToDepthRecord(const RdpSentence& rdp, const PressureOptions& options, Time time,
                          std::int64_t sequence);
RdpSentence ToRdpSentence(const DepthRecord& record, const PressureOptions& options);

/// The three sentences that hold a VehicleNavRecord.
struct VehicleNavSentences {
  CnvSentence cnv;
  RnvSentence rnv;
  NvrSentence nvr;
};
/// The reckoned position of CNV with the attitude of RNV, which belong together where their
/// `time_nav` is the same (else nothing), and the newest velocities. O's axes are W's. NVR's rates
/// are those of the three angles.
std::optional<VehicleNavRecord> ToVehicleNavRecord(const VehicleNavSentences& sentences,
                                                   std::int64_t origin, std::int64_t sequence);
/// RNV's place relative to the hull, which records do not hold, stays 0; the rates of roll and
/// pitch too.
VehicleNavSentences ToVehicleNavSentences(const VehicleNavRecord& record);

}  // namespace vog
