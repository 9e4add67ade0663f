#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

namespace vog {

using ByteSpan = std::span<const std::uint8_t>;
using ByteVector = std::vector<std::uint8_t>;

static_assert(std::endian::native == std::endian::little, "devices and hosts are little endian");

/// The number at `offset`. @pre it lies inside of `bytes`.
template <class Number>
Number LoadLittle(ByteSpan bytes, std::size_t offset) {
  static_assert(std::is_arithmetic_v<Number>);
  Number number;
  std::memcpy(&number, bytes.subspan(offset, sizeof(number)).data(), sizeof(number));
  return number;
}

/// @pre the number's place lies inside of `bytes`.
template <class Number>
void StoreLittle(Number number, std::size_t offset, std::span<std::uint8_t> bytes) {
  static_assert(std::is_arithmetic_v<Number>);
  std::memcpy(bytes.subspan(offset, sizeof(number)).data(), &number, sizeof(number));
}

/// The sum of all bytes modulo 65536: Teledyne's check sum.
inline std::uint16_t SumOf(ByteSpan bytes) {
  std::uint16_t sum = 0;
  for (const std::uint8_t byte : bytes) sum = static_cast<std::uint16_t>(sum + byte);
  return sum;
}

}  // namespace vog
