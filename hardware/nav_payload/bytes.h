#pragma once

#include <concepts>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

namespace vog {

using Bytes = std::vector<std::uint8_t>;
using ByteSpan = std::span<const std::uint8_t>;

/// The integer at `offset`, least significant byte first. @pre it lies within `bytes`.
template <std::integral Integer>
Integer GetLittleEndian(ByteSpan bytes, std::size_t offset) {
  std::make_unsigned_t<Integer> value = 0;
  for (std::size_t i = 0; i < sizeof(Integer); ++i)
    value |= static_cast<std::make_unsigned_t<Integer>>(
        static_cast<std::make_unsigned_t<Integer>>(bytes[offset + i]) << (8 * i));
  return static_cast<Integer>(value);
}

/// Its inverse. @pre it lies within `bytes`.
template <std::integral Integer>
void PutLittleEndian(Integer value, std::span<std::uint8_t> bytes, std::size_t offset) {
  for (std::size_t i = 0; i < sizeof(Integer); ++i)
    bytes[offset + i] =
        static_cast<std::uint8_t>(static_cast<std::make_unsigned_t<Integer>>(value) >> (8 * i));
}

/// The sum of all bytes modulo 65536: Teledyne's check sum.
inline std::uint16_t SumOf(ByteSpan bytes) {
  std::uint16_t sum = 0;
  for (const std::uint8_t byte : bytes) sum = static_cast<std::uint16_t>(sum + byte);
  return sum;
}

}  // namespace vog
