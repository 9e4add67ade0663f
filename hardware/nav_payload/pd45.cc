#include "hardware/nav_payload/pd45.h"

#include "hardware/nav_payload/pd0.h"
#include "hardware/nav_payload/quantise.h"

namespace vog {
namespace {

constexpr std::uint8_t kHeadByte = 0x7D;
constexpr std::size_t kSizeField = 2, kPd4Size = 45, kPd5Size = 86, kChecksumSize = 2;
constexpr std::int16_t kBadVelocity = -32768;
constexpr double kStep = 1e-3, kHundredth = 0.01, kTenth = 0.1;
constexpr double kAngleStep = ToRadians(0.01);

HeadOfStream LookForPd45(ByteSpan bytes) {
  if (bytes[0] != kHeadByte) return {};
  if (bytes.size() < kSizeField + 2) return {HeadOfStream::kIncomplete};
  const std::size_t size = bytes[1] == 0 ? kPd4Size : kPd5Size;
  if (bytes[1] > 1 || LoadLittle<std::uint16_t>(bytes, kSizeField) != size) return {};
  if (bytes.size() < size + kChecksumSize) return {HeadOfStream::kIncomplete};
  if (SumOf(bytes.first(size)) != LoadLittle<std::uint16_t>(bytes, size)) return {};
  return {HeadOfStream::kFrame, size + kChecksumSize};
}

using FourValues = std::array<std::optional<double>, 4>;

FourValues GetVelocities(ByteSpan b, std::size_t offset) {
  FourValues values;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto raw = LoadLittle<std::int16_t>(b, offset + 2 * i);
    if (raw != kBadVelocity) values[i] = kStep * raw;
  }
  return values;
}

void PutVelocities(const FourValues& values, std::span<std::uint8_t> b, std::size_t offset) {
  for (std::size_t i = 0; i < 4; ++i)
    StoreLittle(values[i] ? Quantise<std::int16_t>(*values[i], kStep) : kBadVelocity,
                offset + 2 * i, b);
}

std::optional<Duration> GetTime(ByteSpan b) {
  using namespace std::chrono;
  if (b[0] > 23 || b[1] > 59 || b[2] > 59 || b[3] > 99) return std::nullopt;
  return hours(b[0]) + minutes(b[1]) + seconds(b[2]) + milliseconds(10 * b[3]);
}

void PutTime(Duration since_midnight, std::span<std::uint8_t> b) {
  using Centiseconds = std::chrono::duration<std::int64_t, std::centi>;
  const std::int64_t t = std::chrono::round<Centiseconds>(since_midnight).count() % 8'640'000;
  b[0] = static_cast<std::uint8_t>(t / 360'000);
  b[1] = static_cast<std::uint8_t>(t / 6'000 % 60);
  b[2] = static_cast<std::uint8_t>(t / 100 % 60);
  b[3] = static_cast<std::uint8_t>(t % 100);
}

Pd5Extra DecodeExtra(ByteSpan b) {
  Pd5Extra extra;
  extra.salinity_ppt = b[45];
  extra.depth_m = kTenth * LoadLittle<std::uint16_t>(b, 46);
  extra.pitch_rad = kAngleStep * LoadLittle<std::int16_t>(b, 48);
  extra.roll_rad = kAngleStep * LoadLittle<std::int16_t>(b, 50);
  extra.heading_rad = kAngleStep * LoadLittle<std::uint16_t>(b, 52);
  for (std::size_t i = 0; i < 4; ++i) {
    extra.distance_bottom_m[i] = kTenth * LoadLittle<std::int32_t>(b, 54 + 4 * i);
    extra.distance_water_m[i] = kTenth * LoadLittle<std::int32_t>(b, 70 + 4 * i);
  }
  return extra;
}

void EncodeExtra(const Pd5Extra& extra, std::span<std::uint8_t> b) {
  b[45] = Quantise<std::uint8_t>(extra.salinity_ppt);
  StoreLittle(Quantise<std::uint16_t>(extra.depth_m, kTenth), 46, b);
  StoreLittle(Quantise<std::int16_t>(extra.pitch_rad, kAngleStep), 48, b);
  StoreLittle(Quantise<std::int16_t>(extra.roll_rad, kAngleStep), 50, b);
  StoreLittle(Quantise<std::uint16_t>(extra.heading_rad, kAngleStep), 52, b);
  for (std::size_t i = 0; i < 4; ++i) {
    StoreLittle(Quantise<std::int32_t>(extra.distance_bottom_m[i], kTenth), 54 + 4 * i, b);
    StoreLittle(Quantise<std::int32_t>(extra.distance_water_m[i], kTenth), 70 + 4 * i, b);
  }
}

}  // namespace

ByteFramer MakePd45Framer() { return ByteFramer(&LookForPd45); }

std::optional<Pd45Ensemble> DecodePd45(ByteSpan b) {
  if (b.empty()) return std::nullopt;
  const HeadOfStream head = LookForPd45(b);
  if (head.kind != HeadOfStream::kFrame || head.size != b.size()) return std::nullopt;
  const auto time = GetTime(b.subspan(35, 4));
  if (!time) return std::nullopt;
  Pd45Ensemble e;
  e.frame = FrameOfBits(b[4] >> 6);
  e.uses_tilts = (b[4] & 0x20) != 0;
  e.uses_three_beams = (b[4] & 0x10) != 0;
  e.frequency = b[4] & 7;
  e.bottom_velocity_m_s = GetVelocities(b, 5);
  for (std::size_t i = 0; i < 4; ++i) {
    const auto range_cm = LoadLittle<std::uint16_t>(b, 13 + 2 * i);
    if (range_cm != 0) e.range_m[i] = kHundredth * range_cm;
  }
  e.bottom_status = b[21];
  e.water_velocity_m_s = GetVelocities(b, 22);
  e.layer_start_m = kTenth * LoadLittle<std::uint16_t>(b, 30);
  e.layer_end_m = kTenth * LoadLittle<std::uint16_t>(b, 32);
  e.water_status = b[34];
  e.time_of_first_ping = *time;
  e.built_in_test = LoadLittle<std::uint16_t>(b, 39);
  e.sound_speed_m_s = LoadLittle<std::uint16_t>(b, 41);
  e.temperature_degc = kHundredth * LoadLittle<std::int16_t>(b, 43);
  if (b[1] == 1) e.extra = DecodeExtra(b);
  return e;
}

ByteVector EncodePd45(const Pd45Ensemble& e) {
  const std::size_t size = e.extra ? kPd5Size : kPd4Size;
  ByteVector bytes(size + kChecksumSize);
  const std::span<std::uint8_t> b = bytes;
  b[0] = kHeadByte;
  b[1] = e.extra ? 1 : 0;
  StoreLittle(static_cast<std::uint16_t>(size), kSizeField, b);
  b[4] = static_cast<std::uint8_t>(BitsOf(e.frame) << 6 | e.uses_tilts << 5 |
                                   e.uses_three_beams << 4 | (e.frequency & 7));
  PutVelocities(e.bottom_velocity_m_s, b, 5);
  for (std::size_t i = 0; i < 4; ++i)
    StoreLittle(Quantise<std::uint16_t>(e.range_m[i].value_or(0), kHundredth), 13 + 2 * i, b);
  b[21] = e.bottom_status;
  PutVelocities(e.water_velocity_m_s, b, 22);
  StoreLittle(Quantise<std::uint16_t>(e.layer_start_m, kTenth), 30, b);
  StoreLittle(Quantise<std::uint16_t>(e.layer_end_m, kTenth), 32, b);
  b[34] = e.water_status;
  PutTime(e.time_of_first_ping, b.subspan(35));
  StoreLittle(e.built_in_test, 39, b);
  StoreLittle(Quantise<std::uint16_t>(e.sound_speed_m_s), 41, b);
  StoreLittle(Quantise<std::int16_t>(e.temperature_degc, kHundredth), 43, b);
  if (e.extra) EncodeExtra(*e.extra, b);
  StoreLittle(SumOf(b.first(size)), size, b);
  return bytes;
}

DopplerSample ToDopplerSample(const Pd45Ensemble& ensemble, Time time) {
  DopplerSample sample;
  sample.time = time;
  sample.frame = ensemble.frame;
  sample.velocity_m_s = ensemble.bottom_velocity_m_s;
  sample.range_m = ensemble.range_m;
  sample.is_levelled = ensemble.uses_tilts;
  if (const auto& extra = ensemble.extra)
    sample.attitude = {extra->heading_rad, extra->pitch_rad, extra->roll_rad};
  return sample;
}

}  // namespace vog
