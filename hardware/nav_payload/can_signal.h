#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "hardware/frames/can_frame.h"

namespace vog {

/// Where a number lies in the data of a classic CAN frame and what it means, as a DBC file says it:
/// physical = offset + scale * raw, within [low, high].
struct CanSignal {
  int start = 0;   ///< Intel: the lowest bit's place, byte * 8 + bit; Motorola: the highest bit's.
  int length = 0;  ///< [bits], up to 53.
  bool is_motorola = false, is_signed = false;
  double scale = 1, offset = 0, low = 0, high = 0;
};

/// The first eight bytes of a frame.
using CanData = std::array<std::uint8_t, 8>;

/// The number of the signal's bits, its sign extended.
std::int64_t ExtractRaw(const CanSignal& signal, const CanData& data);
/// Puts the lowest bits of `raw` there and leaves all others.
void InsertRaw(const CanSignal& signal, std::int64_t raw, CanData& data);

/// Nothing where the number is outside the signal's range.
std::optional<double> Extract(const CanSignal& signal, const CanData& data);
/// Rounded to the signal's step and held within its range. @pre value is finite.
void Insert(const CanSignal& signal, double value, CanData& data);

/// AUTOSAR's CRC-8H2F of a frame: of its identifier, low byte first, and the first seven bytes. Any
/// three flipped bits are noticed.
std::uint8_t CanCheckOf(std::uint32_t id, const CanData& data);

/// The frame of a message of vogmap.dbc (vogmap_dbc.h), which has a counter and a check.
template <class Message>
CanFrame ToCanFrame(Message message, int counter) {
  CanData data{};
  message.counter = counter;
  message.Visit([&](const CanSignal& signal, double value) { Insert(signal, value, data); });
  data[7] = CanCheckOf(Message::kId, data);
  CanFrame frame;
  frame.id = Message::kId;
  frame.extended = Message::kExtended;
  frame.size = Message::kSize;
  std::copy(data.begin(), data.end(), frame.data.begin());
  return frame;
}

/// Its inverse; nothing where the frame is another message, damaged, or a number is out of range.
template <class Message>
std::optional<Message> FromCanFrame(const CanFrame& frame) {
  if (frame.id != Message::kId || frame.extended != Message::kExtended || frame.remote ||
      frame.error || frame.fd || frame.size != Message::kSize)
    return std::nullopt;
  CanData data;
  std::copy_n(frame.data.begin(), data.size(), data.begin());
  if (data[7] != CanCheckOf(frame.id, data)) return std::nullopt;
  Message message;
  bool is_good = true;
  message.Visit([&](const CanSignal& signal, double& value) {
    const auto extracted = Extract(signal, data);
    is_good = is_good && extracted.has_value();
    value = extracted.value_or(0);
  });
  return is_good ? std::optional(message) : std::nullopt;
}

}  // namespace vog
