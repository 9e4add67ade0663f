#include "hardware/nav_payload/hg1700.h"

#include <cmath>

#include "hardware/nav_payload/quantise.h"

namespace vog {
namespace {

constexpr std::uint8_t kAddress = 0x0A, kFlightControl = 1, kInertial = 2;
constexpr std::size_t kHeadSize = 2, kCheckSize = 2;
constexpr std::size_t kFlightControlSize = kHeadSize + 16, kInertialSize = kHeadSize + 40;
constexpr std::size_t kRates = 2, kAccelerations = 8, kStatus = 14, kAngles = 18, kVelocities = 30;
constexpr double kMetresPerFoot = 0.3048;
constexpr double kRateStep = 600.0 / (1 << 20);
constexpr double kAccelerationStep = 600.0 / (1 << 14) * kMetresPerFoot;

double AngleStep() { return std::ldexp(1.0, -33); }

double VelocityStep(Hg1700Model model) {
  const bool is_fine = model == Hg1700Model::kAg11 || model == Hg1700Model::kAg58;
  return std::ldexp(kMetresPerFoot, is_fine ? -27 : -26);
}

HeadOfStream LookForHg1700(ByteSpan bytes) {
  if (bytes[0] != kAddress) return {};
  if (bytes.size() < kHeadSize) return {HeadOfStream::kIncomplete};
  if (bytes[1] != kFlightControl && bytes[1] != kInertial) return {};
  const std::size_t size = bytes[1] == kInertial ? kInertialSize : kFlightControlSize;
  if (bytes.size() < size + kCheckSize) return {HeadOfStream::kIncomplete};
  if (SdlcCheckOf(bytes.first(size)) != LoadLittle<std::uint16_t>(bytes, size)) return {};
  return {HeadOfStream::kFrame, size + kCheckSize};
}

template <class Integer>
std::array<double, 3> GetThree(ByteSpan bytes, std::size_t offset, double step) {
  std::array<double, 3> values;
  for (std::size_t i = 0; i < 3; ++i)
    values[i] = step * LoadLittle<Integer>(bytes, offset + i * sizeof(Integer));
  return values;
}

template <class Integer>
void PutThree(const std::array<double, 3>& values, double step, std::span<std::uint8_t> bytes,
              std::size_t offset) {
  for (std::size_t i = 0; i < 3; ++i)
    StoreLittle(Quantise<Integer>(values[i], step), offset + i * sizeof(Integer), bytes);
}

}  // namespace

std::uint16_t SdlcCheckOf(ByteSpan bytes) {
  constexpr std::uint16_t kPolynomial = 0x8408;  // x^16 + x^12 + x^5 + 1, lowest bit first.
  std::uint16_t check = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    check ^= byte;
    for (int bit = 0; bit < 8; ++bit)
      check = static_cast<std::uint16_t>(check >> 1 ^ (check & 1 ? kPolynomial : 0));
  }
  return static_cast<std::uint16_t>(~check);
}

ByteFramer MakeHg1700Framer() { return ByteFramer(&LookForHg1700); }

std::optional<Hg1700Record> DecodeHg1700(ByteSpan bytes, Hg1700Model model) {
  if (bytes.empty()) return std::nullopt;
  const HeadOfStream head = LookForHg1700(bytes);
  if (head.kind != HeadOfStream::kFrame || head.size != bytes.size()) return std::nullopt;
  Hg1700Record record;
  record.rate_rad_s = GetThree<std::int16_t>(bytes, kRates, kRateStep);
  record.acceleration_m_s2 = GetThree<std::int16_t>(bytes, kAccelerations, kAccelerationStep);
  record.status = LoadLittle<std::uint16_t>(bytes, kStatus);
  record.status_multiplexed = LoadLittle<std::uint16_t>(bytes, kStatus + 2);
  if (bytes[1] == kInertial)
    record.increments =
        Hg1700Increments{GetThree<std::int32_t>(bytes, kAngles, AngleStep()),
                         GetThree<std::int32_t>(bytes, kVelocities, VelocityStep(model))};
  return record;
}

ByteVector EncodeHg1700(const Hg1700Record& record, Hg1700Model model) {
  const std::size_t size = record.increments ? kInertialSize : kFlightControlSize;
  ByteVector bytes(size + kCheckSize);
  const std::span<std::uint8_t> all = bytes;
  bytes[0] = kAddress;
  bytes[1] = record.increments ? kInertial : kFlightControl;
  PutThree<std::int16_t>(record.rate_rad_s, kRateStep, all, kRates);
  PutThree<std::int16_t>(record.acceleration_m_s2, kAccelerationStep, all, kAccelerations);
  StoreLittle(record.status, kStatus, all);
  StoreLittle(record.status_multiplexed, kStatus + 2, all);
  if (record.increments) {
    PutThree<std::int32_t>(record.increments->angle_rad, AngleStep(), all, kAngles);
    PutThree<std::int32_t>(record.increments->velocity_m_s, VelocityStep(model), all, kVelocities);
  }
  StoreLittle(SdlcCheckOf(all.first(size)), size, all);
  return bytes;
}

}  // namespace vog
