#include "hardware/nav_payload/bluefin_reader.h"

namespace vog {

Time BluefinReader::Dated(Duration time_of_day, Time now) {
  if (!clock_) clock_.emplace(now);
  return clock_->ToTime(time_of_day);
}

void BluefinReader::Take(const RnvSentence& rnv) {
  rnv_ = rnv;
  if (rnv.absolute) attitude_ = AttitudeOf(*rnv.absolute);
}

VehicleNavRecord BluefinReader::WithVelocity(VehicleNavRecord record) const {
  if (nvr_ || !newest_ || record.time <= newest_->time) return record;
  const Vec6 motion = Log(Ominus(newest_->X_OB, record.X_OB));
  const double dt_s = ToSeconds(record.time - newest_->time);
  record.velocity_B_m_s = motion.head<3>() / dt_s;
  record.yaw_rate_rad_s = motion[5] / dt_s;
  return record;
}

std::optional<NavigationRecord> BluefinReader::Add(const Sentence& sentence, Time now) {
  if (const auto* nvr = std::get_if<NvrSentence>(&sentence)) Take(*nvr);
  if (const auto* rcm = std::get_if<RcmSentence>(&sentence)) Take(*rcm);
  if (const auto* pit = std::get_if<PitSentence>(&sentence)) Take(*pit);
  if (const auto* rnv = std::get_if<RnvSentence>(&sentence)) Take(*rnv);
  if (const auto* cnv = std::get_if<CnvSentence>(&sentence)) {
    const auto record =
        ToVehicleNavRecord({*cnv, rnv_, nvr_.value_or(NvrSentence{})}, /*origin=*/0, sequence_);
    if (!record) return std::nullopt;
    ++sequence_;
    newest_ = WithVelocity(*record);
    return *newest_;
  }
  if (const auto* dvl = std::get_if<DvlSentence>(&sentence))
    return ToDvlRecord(*dvl, Dated(dvl->time, now), sequence_++);
  if (const auto* dv2 = std::get_if<Dv2Sentence>(&sentence)) {
    const DopplerSample sample{
        Dated(dv2->time, now), DopplerFrame::kBeam, dv2->velocity_m_s, dv2->range_m, {}, false};
    return ToDvlRecord(sample, doppler_, DopplerRotation(doppler_, servo_pitch_rad_), sequence_++);
  }
  if (const auto* rdp = std::get_if<RdpSentence>(&sentence))
    return ToDepthRecord(*rdp, pressure_, Dated(rdp->time, now), sequence_++);
  const auto* imu = std::get_if<ImuSentence>(&sentence);
  if (imu == nullptr || !attitude_) return std::nullopt;
  return ToImuRecord(*imu, *attitude_, Dated(imu->time, now), sequence_++);
}

}  // namespace vog
