#include "hardware/nav_payload/can_signal.h"

#include <cmath>

namespace vog {
namespace {

constexpr int kBits = 64;

/// Motorola's first byte holds the highest bits.
std::uint64_t Load(const CanData& data, bool is_motorola) {
  std::uint64_t bits = 0;
  for (int i = 0; i < 8; ++i) bits |= std::uint64_t{data[i]} << 8 * (is_motorola ? 7 - i : i);
  return bits;
}

void Store(std::uint64_t bits, bool is_motorola, CanData& data) {
  for (int i = 0; i < 8; ++i)
    data[i] = static_cast<std::uint8_t>(bits >> 8 * (is_motorola ? 7 - i : i));
}

/// How far the signal's lowest bit lies above the lowest of Load()'s.
int ShiftOf(const CanSignal& signal) {
  if (!signal.is_motorola) return signal.start;
  const int highest = kBits - 8 * (signal.start / 8 + 1) + signal.start % 8;
  return highest - signal.length + 1;
}

std::uint64_t MaskOf(const CanSignal& signal) { return (std::uint64_t{1} << signal.length) - 1; }

}  // namespace

std::int64_t ExtractRaw(const CanSignal& signal, const CanData& data) {
  const std::uint64_t raw = Load(data, signal.is_motorola) >> ShiftOf(signal) & MaskOf(signal);
  const std::uint64_t sign = std::uint64_t{1} << (signal.length - 1);
  return static_cast<std::int64_t>(signal.is_signed ? (raw ^ sign) - sign : raw);
}

void InsertRaw(const CanSignal& signal, std::int64_t raw, CanData& data) {
  const int shift = ShiftOf(signal);
  const std::uint64_t mask = MaskOf(signal) << shift;
  const std::uint64_t bits = Load(data, signal.is_motorola) & ~mask;
  Store(bits | (static_cast<std::uint64_t>(raw) << shift & mask), signal.is_motorola, data);
}

std::optional<double> Extract(const CanSignal& signal, const CanData& data) {
  const double raw = static_cast<double>(ExtractRaw(signal, data));
  const double value = signal.offset + signal.scale * raw;
  const double slack = 0.5 * std::abs(signal.scale);
  if (value < signal.low - slack || value > signal.high + slack) return std::nullopt;
  return value;
}

void Insert(const CanSignal& signal, double value, CanData& data) {
  const double held = std::clamp(value, signal.low, signal.high);
  InsertRaw(signal, std::llround((held - signal.offset) / signal.scale), data);
}

std::uint8_t CanCheckOf(std::uint32_t id, const CanData& data) {
  constexpr std::uint8_t kPolynomial = 0x2F;
  std::uint8_t check = 0xFF;
  const auto add = [&](std::uint8_t byte) {
    check ^= byte;
    for (int bit = 0; bit < 8; ++bit)
      check = static_cast<std::uint8_t>(check << 1 ^ (check & 0x80 ? kPolynomial : 0));
  };
  add(static_cast<std::uint8_t>(id));
  add(static_cast<std::uint8_t>(id >> 8));
  for (std::size_t i = 0; i < 7; ++i) add(data[i]);
  return static_cast<std::uint8_t>(~check);
}

}  // namespace vog
