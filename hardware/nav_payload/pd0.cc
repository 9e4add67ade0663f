#include "hardware/nav_payload/pd0.h"

#include <algorithm>

#include "hardware/nav_payload/quantise.h"

namespace vog {
namespace {

constexpr std::uint8_t kHeadByte = 0x7F;
constexpr std::size_t kHeaderSize = 6, kChecksumSize = 2;
constexpr std::uint16_t kFixedId = 0x0000, kVariableId = 0x0080, kBottomId = 0x0600;
constexpr std::size_t kFixedSize = 59, kVariableSize = 65, kBottomSize = 85;
// What older firmware sends at least of each.
constexpr std::size_t kMinFixedSize = 42, kMinVariableSize = 28, kMinBottomSize = 44;
constexpr std::size_t kBottomMsb = 77;
constexpr std::int16_t kBadVelocity = -32768;
constexpr double kStep = 1e-3, kHundredth = 0.01, kTenth = 0.1;
constexpr double kAngleStep = ToRadians(0.01);

std::size_t OffsetOf(ByteSpan bytes, std::size_t i) {
  return LoadLittle<std::uint16_t>(bytes, kHeaderSize + 2 * i);
}

HeadOfStream LookForPd0(ByteSpan bytes) {
  if (bytes[0] != kHeadByte) return {};
  if (bytes.size() < 2) return {HeadOfStream::kIncomplete};
  if (bytes[1] != kHeadByte) return {};
  if (bytes.size() < kHeaderSize) return {HeadOfStream::kIncomplete};
  const std::size_t size = LoadLittle<std::uint16_t>(bytes, 2);
  const std::size_t table_end = kHeaderSize + 2 * std::size_t{bytes[5]};
  if (size + kChecksumSize > kMaxPd0Size || size < table_end) return {};
  if (bytes.size() < size + kChecksumSize) return {HeadOfStream::kIncomplete};
  if (SumOf(bytes.first(size)) != LoadLittle<std::uint16_t>(bytes, size)) return {};
  return {HeadOfStream::kFrame, size + kChecksumSize};
}

/// The data of kind `id`, up to where the next begins; empty where there is none, or less than
/// `min_size`.
ByteSpan Find(ByteSpan bytes, std::uint16_t id, std::size_t min_size) {
  const std::size_t size = bytes.size() - kChecksumSize;
  for (std::size_t i = 0; i < bytes[5]; ++i) {
    const std::size_t begin = OffsetOf(bytes, i);
    if (begin + min_size > size || LoadLittle<std::uint16_t>(bytes, begin) != id) continue;
    std::size_t end = size;
    for (std::size_t j = 0; j < bytes[5]; ++j) {
      if (OffsetOf(bytes, j) > begin) end = std::min(end, OffsetOf(bytes, j));
    }
    if (end - begin >= min_size) return bytes.subspan(begin, end - begin);
  }
  return {};
}

Pd0FixedLeader DecodeFixed(ByteSpan b) {
  Pd0FixedLeader fixed;
  fixed.firmware_version = b[2];
  fixed.firmware_revision = b[3];
  fixed.system_configuration = LoadLittle<std::uint16_t>(b, 4);
  fixed.pings_per_ensemble = b[10];
  fixed.frame = FrameOfBits(b[25] >> 3 & 3);
  fixed.uses_tilts = (b[25] & 4) != 0;
  fixed.uses_three_beams = (b[25] & 2) != 0;
  fixed.maps_bins = (b[25] & 1) != 0;
  fixed.serial_number = b.size() >= kFixedSize ? LoadLittle<std::uint32_t>(b, 54) : 0;
  fixed.beam_angle_deg = b.size() >= kFixedSize ? b[58] : 0;
  return fixed;
}

void EncodeFixed(const Pd0FixedLeader& fixed, std::span<std::uint8_t> b) {
  StoreLittle(kFixedId, 0, b);
  b[2] = fixed.firmware_version;
  b[3] = fixed.firmware_revision;
  StoreLittle(fixed.system_configuration, 4, b);
  b[8] = 4;  // Beams.
  b[10] = fixed.pings_per_ensemble;
  b[25] = static_cast<std::uint8_t>(BitsOf(fixed.frame) << 3 | fixed.uses_tilts << 2 |
                                    fixed.uses_three_beams << 1 | int{fixed.maps_bins});
  StoreLittle(fixed.serial_number, 54, b);
  b[58] = fixed.beam_angle_deg;
}

/// The clock's bytes: year of the century, month, day, hour, minute, second, hundredths.
std::optional<Time> DecodeClock(ByteSpan b) {
  using namespace std::chrono;
  const year_month_day date(year(b[0] < 80 ? 2000 + b[0] : 1900 + b[0]), month(b[1]), day(b[2]));
  if (b[0] > 99 || !date.ok() || b[3] > 23 || b[4] > 59 || b[5] > 59 || b[6] > 99)
    return std::nullopt;
  return Time(sys_days(date).time_since_epoch() + hours(b[3]) + minutes(b[4]) + seconds(b[5]) +
              milliseconds(10 * b[6]));
}

void EncodeClock(Time time, std::span<std::uint8_t> b) {
  using namespace std::chrono;
  using Centiseconds = duration<std::int64_t, std::centi>;
  const auto since_epoch = round<Centiseconds>(time.time_since_epoch());
  const days day = floor<days>(since_epoch);
  const year_month_day date{sys_days(day)};
  const std::int64_t of_day = (since_epoch - day).count();
  const std::array<std::int64_t, 7> fields = {
      int{date.year()} % 100, unsigned{date.month()}, unsigned{date.day()}, of_day / 360'000,
      of_day / 6'000 % 60,    of_day / 100 % 60,      of_day % 100};
  std::transform(fields.begin(), fields.end(), b.begin(),
                 [](std::int64_t field) { return static_cast<std::uint8_t>(field); });
}

std::optional<Pd0VariableLeader> DecodeVariable(ByteSpan b) {
  const auto time = DecodeClock(b.subspan(4, 7));
  if (!time) return std::nullopt;
  Pd0VariableLeader variable;
  variable.ensemble = LoadLittle<std::uint16_t>(b, 2) | std::uint32_t{b[11]} << 16;
  variable.time = *time;
  variable.built_in_test = LoadLittle<std::uint16_t>(b, 12);
  variable.sound_speed_m_s = LoadLittle<std::uint16_t>(b, 14);
  variable.transducer_depth_m = kTenth * LoadLittle<std::uint16_t>(b, 16);
  variable.heading_rad = kAngleStep * LoadLittle<std::uint16_t>(b, 18);
  variable.pitch_rad = kAngleStep * LoadLittle<std::int16_t>(b, 20);
  variable.roll_rad = kAngleStep * LoadLittle<std::int16_t>(b, 22);
  variable.salinity_ppt = LoadLittle<std::uint16_t>(b, 24);
  variable.temperature_degc = kHundredth * LoadLittle<std::int16_t>(b, 26);
  return variable;
}

void EncodeVariable(const Pd0VariableLeader& variable, std::span<std::uint8_t> b) {
  StoreLittle(kVariableId, 0, b);
  StoreLittle(static_cast<std::uint16_t>(variable.ensemble), 2, b);
  b[11] = static_cast<std::uint8_t>(variable.ensemble >> 16);
  EncodeClock(variable.time, b.subspan(4));
  StoreLittle(variable.built_in_test, 12, b);
  StoreLittle(Quantise<std::uint16_t>(variable.sound_speed_m_s), 14, b);
  StoreLittle(Quantise<std::uint16_t>(variable.transducer_depth_m, kTenth), 16, b);
  StoreLittle(Quantise<std::uint16_t>(variable.heading_rad, kAngleStep), 18, b);
  StoreLittle(Quantise<std::int16_t>(variable.pitch_rad, kAngleStep), 20, b);
  StoreLittle(Quantise<std::int16_t>(variable.roll_rad, kAngleStep), 22, b);
  StoreLittle(Quantise<std::uint16_t>(variable.salinity_ppt), 24, b);
  StoreLittle(Quantise<std::int16_t>(variable.temperature_degc, kHundredth), 26, b);
  b[57] = 20;  // The century of the clock that knows it.
  EncodeClock(variable.time, b.subspan(58));
}

Pd0BottomTrack DecodeBottom(ByteSpan b) {
  Pd0BottomTrack bottom;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::uint32_t msb = b.size() > kBottomMsb + i ? b[kBottomMsb + i] : 0;
    const std::uint32_t range_cm = LoadLittle<std::uint16_t>(b, 16 + 2 * i) | msb << 16;
    const auto velocity = LoadLittle<std::int16_t>(b, 24 + 2 * i);
    if (range_cm != 0) bottom.range_m[i] = kHundredth * range_cm;
    if (velocity != kBadVelocity) bottom.velocity_m_s[i] = kStep * velocity;
    bottom.correlation[i] = b[32 + i];
    bottom.amplitude[i] = b[36 + i];
    bottom.percent_good[i] = b[40 + i];
  }
  return bottom;
}

void EncodeBottom(const Pd0BottomTrack& bottom, std::span<std::uint8_t> b) {
  constexpr std::uint32_t kMaxRange = 0xFFFFFF;
  StoreLittle(kBottomId, 0, b);
  StoreLittle(std::uint16_t{1}, 2, b);  // Pings.
  for (std::size_t i = 0; i < 4; ++i) {
    const auto range_cm =
        std::min(kMaxRange, Quantise<std::uint32_t>(bottom.range_m[i].value_or(0), kHundredth));
    const auto& velocity = bottom.velocity_m_s[i];
    StoreLittle(static_cast<std::uint16_t>(range_cm), 16 + 2 * i, b);
    b[kBottomMsb + i] = static_cast<std::uint8_t>(range_cm >> 16);
    StoreLittle(velocity ? Quantise<std::int16_t>(*velocity, kStep) : kBadVelocity, 24 + 2 * i, b);
    b[32 + i] = bottom.correlation[i];
    b[36 + i] = bottom.amplitude[i];
    b[40 + i] = bottom.percent_good[i];
  }
}

}  // namespace

DopplerFrame FrameOfBits(int bits) { return static_cast<DopplerFrame>(bits); }
int BitsOf(DopplerFrame frame) { return static_cast<int>(frame); }

ByteFramer MakePd0Framer() { return ByteFramer(&LookForPd0); }

std::optional<Pd0Ensemble> DecodePd0(ByteSpan bytes) {
  if (bytes.empty()) return std::nullopt;
  const HeadOfStream head = LookForPd0(bytes);
  if (head.kind != HeadOfStream::kFrame || head.size != bytes.size()) return std::nullopt;
  const ByteSpan fixed = Find(bytes, kFixedId, kMinFixedSize);
  const ByteSpan leader = Find(bytes, kVariableId, kMinVariableSize);
  const ByteSpan bottom = Find(bytes, kBottomId, kMinBottomSize);
  const auto variable = leader.empty() ? std::nullopt : DecodeVariable(leader);
  if (fixed.empty() || !variable) return std::nullopt;
  Pd0Ensemble ensemble{DecodeFixed(fixed), *variable, std::nullopt};
  if (!bottom.empty()) ensemble.bottom_track = DecodeBottom(bottom);
  return ensemble;
}

ByteVector EncodePd0(const Pd0Ensemble& ensemble) {
  const std::size_t kinds = ensemble.bottom_track ? 3 : 2;
  const std::size_t fixed = kHeaderSize + 2 * kinds, variable = fixed + kFixedSize;
  const std::size_t bottom = variable + kVariableSize;
  const std::size_t size = bottom + (ensemble.bottom_track ? kBottomSize : 0);
  ByteVector bytes(size + kChecksumSize);
  const std::span<std::uint8_t> all = bytes;
  bytes[0] = bytes[1] = kHeadByte;
  StoreLittle(static_cast<std::uint16_t>(size), 2, all);
  bytes[5] = static_cast<std::uint8_t>(kinds);
  const std::array offsets = {fixed, variable, bottom};
  for (std::size_t i = 0; i < kinds; ++i)
    StoreLittle(static_cast<std::uint16_t>(offsets[i]), kHeaderSize + 2 * i, all);
  EncodeFixed(ensemble.fixed, all.subspan(fixed));
  EncodeVariable(ensemble.variable, all.subspan(variable));
  if (ensemble.bottom_track) EncodeBottom(*ensemble.bottom_track, all.subspan(bottom));
  StoreLittle(SumOf(all.first(size)), size, all);
  return bytes;
}

DopplerSample ToDopplerSample(const Pd0Ensemble& ensemble) {
  const Pd0VariableLeader& variable = ensemble.variable;
  DopplerSample sample;
  sample.time = variable.time;
  sample.frame = ensemble.fixed.frame;
  sample.attitude = {variable.heading_rad, variable.pitch_rad, variable.roll_rad};
  sample.is_levelled = ensemble.fixed.uses_tilts;
  if (!ensemble.bottom_track) return sample;
  sample.range_m = ensemble.bottom_track->range_m;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& velocity = ensemble.bottom_track->velocity_m_s[i];
    if (velocity) sample.velocity_m_s[i] = -*velocity;
  }
  return sample;
}

Pd0BottomTrack ToPd0BottomTrack(const DopplerSample& sample) {
  Pd0BottomTrack bottom;
  bottom.range_m = sample.range_m;
  for (std::size_t i = 0; i < 4; ++i) {
    if (!sample.velocity_m_s[i]) continue;
    bottom.velocity_m_s[i] = -*sample.velocity_m_s[i];
    bottom.correlation[i] = 255;
    bottom.percent_good[i] = 100;
  }
  return bottom;
}

}  // namespace vog
