#include "hardware/nav_payload/doppler.h"

#include <algorithm>
#include <cmath>

namespace vog {
namespace {

/// The ship's axes starboard, forward, up.
Vec3 FromShip(const Vec3& v) { return {v.y(), -v.x(), v.z()}; }
Vec3 ToShip(const Vec3& v) { return {-v.y(), v.x(), v.z()}; }

/// Turns B into B laid level, or into W.
Mat3 RotationOf(const NedAttitude& attitude, bool with_heading) {
  RollPitchYaw angles = FromNed(attitude);
  if (!with_heading) angles.yaw = 0;
  return MakePose(Vec3::Zero(), angles).linear();
}

std::optional<Vec3> FirstThree(const std::array<std::optional<double>, 4>& v) {
  if (!v[0] || !v[1] || !v[2]) return std::nullopt;
  return Vec3(*v[0], *v[1], *v[2]);
}

std::optional<Vec3> VelocityB(const DopplerSample& sample, const DopplerOptions& options,
                              const Mat3& R_BI) {
  auto v = sample.frame == DopplerFrame::kBeam
               ? FromBeams(sample.velocity_m_s, ToRadians(options.beam_angle_deg))
               : FirstThree(sample.velocity_m_s);
  if (!v) return std::nullopt;
  switch (sample.frame) {
    case DopplerFrame::kBeam:
    case DopplerFrame::kInstrument:
      return R_BI * *v;
    case DopplerFrame::kShip:
      if (!sample.is_levelled) return FromShip(*v);
      return RotationOf(sample.attitude, false).transpose() * FromShip(*v);
    case DopplerFrame::kEarth:
      return RotationOf(sample.attitude, true).transpose() * *v;
  }
  return std::nullopt;
}

}  // namespace

Mat3 DopplerRotation(const DopplerOptions& options, double servo_pitch_rad) {
  const Vec3 rpy = options.mounting_rpy_deg.unaryExpr(&ToRadians);
  return MakePose(Vec3::Zero(), {0, -servo_pitch_rad, 0}).linear() *
         MakePose(Vec3::Zero(), {rpy.x(), rpy.y(), rpy.z()}).linear();
}

std::optional<Vec3> FromBeams(const std::array<std::optional<double>, 4>& velocity_m_s,
                              double beam_angle_rad) {
  const auto bad = std::count(velocity_m_s.begin(), velocity_m_s.end(), std::nullopt);
  if (bad > 1) return std::nullopt;
  std::array<double, 4> b;
  std::transform(velocity_m_s.begin(), velocity_m_s.end(), b.begin(),
                 [](const auto& v) { return v.value_or(0); });
  for (int i = 0; i < 4; ++i) {
    // Zero error velocity: both pairs of beams have one sum.
    const int partner = i ^ 1, other = i ^ 2;
    if (!velocity_m_s[i]) b[i] = b[other] + b[other ^ 1] - b[partner];
  }
  const double s = std::sin(beam_angle_rad), c = std::cos(beam_angle_rad);
  return Vec3((b[0] - b[1]) / (2 * s), (b[3] - b[2]) / (2 * s),
              (b[0] + b[1] + b[2] + b[3]) / (4 * c));
}

std::array<double, 4> ToBeams(const Vec3& v, double beam_angle_rad) {
  const double s = std::sin(beam_angle_rad), c = std::cos(beam_angle_rad);
  return {s * v.x() + c * v.z(), -s * v.x() + c * v.z(), -s * v.y() + c * v.z(),
          s * v.y() + c * v.z()};
}

DvlRecord ToDvlRecord(const DopplerSample& sample, const DopplerOptions& options, const Mat3& R_BI,
                      std::int64_t sequence) {
  const auto velocity_B_m_s = VelocityB(sample, options, R_BI);
  return {sample.time, sequence, velocity_B_m_s.value_or(Vec3::Zero()), velocity_B_m_s.has_value()};
}

DopplerSample ToDopplerSample(const DvlRecord& record, DopplerFrame frame,
                              const NedAttitude& attitude, const DopplerOptions& options,
                              const Mat3& R_BI) {
  DopplerSample sample;
  sample.time = record.time;
  sample.frame = frame;
  sample.attitude = attitude;
  if (!record.valid) return sample;
  const Vec3& v_B = record.velocity_B_m_s;
  if (frame == DopplerFrame::kBeam) {
    const auto beams = ToBeams(R_BI.transpose() * v_B, ToRadians(options.beam_angle_deg));
    std::copy(beams.begin(), beams.end(), sample.velocity_m_s.begin());
    return sample;
  }
  const Vec3 v = frame == DopplerFrame::kInstrument ? Vec3(R_BI.transpose() * v_B)
                 : frame == DopplerFrame::kShip     ? ToShip(v_B)
                                                    : Vec3(RotationOf(attitude, true) * v_B);
  sample.velocity_m_s = {v.x(), v.y(), v.z(), 0.0};
  return sample;
}

}  // namespace vog
