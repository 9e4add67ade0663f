#include "hardware/nav_payload/bluefin_records.h"

#include <algorithm>

#include "hardware/nav_payload/time_of_day.h"

namespace vog {
namespace {

Vec3 ToVector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

}  // namespace

NedAttitude AttitudeOf(const NvgSentence& nvg) {
  return {nvg.heading_rad, nvg.pitch_rad, nvg.roll_rad};
}

NedAttitude AttitudeOf(const RcmSentence& rcm) {
  return {rcm.heading_rad, rcm.pitch_rad, rcm.roll_rad};
}

NedAttitude AttitudeOf(const RnvAbsolute& rnv) {
  return {rnv.heading_rad, rnv.pitch_rad, rnv.roll_rad};
}

DvlRecord ToDvlRecord(const DvlSentence& dvl, Time time, std::int64_t sequence) {
  const auto& v = dvl.velocity_m_s;
  DvlRecord record{time, sequence};
  record.valid = v[0] && v[1] && v[2];
  if (record.valid) record.velocity_B_m_s = SwapFrdFlu({*v[0], *v[1], *v[2]});
  return record;
}

DvlSentence ToDvlSentence(const DvlRecord& record) {
  DvlSentence dvl;
  dvl.time = dvl.time_measured = TimeOfDay(record.time);
  if (!record.valid) return dvl;
  const Vec3 v = SwapFrdFlu(record.velocity_B_m_s);
  std::copy(v.begin(), v.end(), dvl.velocity_m_s.begin());
  return dvl;
}

ImuRecord ToImuRecord(const ImuSentence& imu, const NedAttitude& attitude, Time time,
                      std::int64_t sequence) {
  const RollPitchYaw angles = FromNed(attitude);
  return {time, sequence, angles.roll, angles.pitch, SwapFrdFlu(ToVector(imu.rate_rad_s))};
}

ImuSentence ToImuSentence(const ImuRecord& record) {
  ImuSentence imu;
  imu.time = imu.time_measured = TimeOfDay(record.time);
  const Vec3 rates = SwapFrdFlu(record.angular_velocity_B_rad_s);
  std::copy(rates.begin(), rates.end(), imu.rate_rad_s.begin());
  return imu;
}

std::optional<DepthRecord> ToDepthRecord(const NvgSentence& nvg, Time time, std::int64_t sequence) {
  if (!nvg.depth_m) return std::nullopt;
  return DepthRecord{time, sequence, *nvg.depth_m};
}

DepthRecord ToDepthRecord(const RdpSentence& rdp, const PressureOptions& options, Time time,
                          std::int64_t sequence) {
  return {time, sequence, ToDepth(rdp.pressure, options)};
}

RdpSentence ToRdpSentence(const DepthRecord& record, const PressureOptions& options) {
  return {TimeOfDay(record.time), ToGauge(record.depth_m, options)};
}

std::optional<VehicleNavRecord> ToVehicleNavRecord(const VehicleNavSentences& sentences,
                                                   std::int64_t origin, std::int64_t sequence) {
  const auto& [cnv, rnv, nvr] = sentences;
  if (!rnv.absolute || rnv.absolute->time_nav != cnv.time_nav) return std::nullopt;
  const RollPitchYaw angles = FromNed(AttitudeOf(*rnv.absolute));
  const Pose3 X_OB = MakePose(SwapNedEnu({cnv.x_m, cnv.y_m, cnv.z_m}), angles);
  const Vec3 velocity_W_m_s(nvr.east_m_s, nvr.north_m_s, -nvr.down_m_s);
  return VehicleNavRecord{
      cnv.time_nav,       sequence, origin, X_OB, X_OB.linear().transpose() * velocity_W_m_s,
      -nvr.yaw_rate_rad_s};
}

VehicleNavSentences ToVehicleNavSentences(const VehicleNavRecord& record) {
  const Vec3 p_NED = SwapNedEnu(record.X_OB.translation());
  const NedAttitude attitude = ToNed(AnglesOf(record.X_OB));
  const Vec3 velocity_W_m_s = record.X_OB.linear() * record.velocity_B_m_s;
  const Duration time = TimeOfDay(record.time);
  VehicleNavSentences sentences;
  sentences.cnv = {record.time, p_NED.x(), p_NED.y(), p_NED.z(), attitude.heading_rad};
  sentences.rnv.time = time;
  sentences.rnv.absolute = RnvAbsolute{p_NED.z(), attitude.heading_rad, attitude.roll_rad,
                                       attitude.pitch_rad, record.time};
  sentences.nvr.time = time;
  sentences.nvr.east_m_s = velocity_W_m_s.x();
  sentences.nvr.north_m_s = velocity_W_m_s.y();
  sentences.nvr.down_m_s = -velocity_W_m_s.z();
  sentences.nvr.yaw_rate_rad_s = -record.yaw_rate_rad_s;
  return sentences;
}

}  // namespace vog
