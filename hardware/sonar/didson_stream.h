#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "hardware/sonar/didson_header.h"

namespace vog {

/// How a frame is spread over UDP datagrams. Each begins with four little-endian words of 16 bits:
/// 0x5a02, one whose meaning is not known, the type, the sequence number.
enum class DidsonPacking {
  kHuls3,   ///< A header, then packets of 8192 samples, the last of its own type.
  kHauv1b,  ///< The header with 24576 samples, then the rest in one packet.
};

/// The datagrams of a frame; the first has sequence number `sequence`, the others follow it.
std::vector<ByteVector> EncodeDatagrams(DidsonPacking packing, const DidsonFrame& frame,
                                        std::uint16_t sequence);

/// Puts frames together from datagrams of either packing. It takes them in any order within a
/// window of some frames, and holds no more than that. A datagram's place in its frame is told by
/// its distance in sequence numbers from the frame's header alone, so two frames never mix.
class DidsonStream {
 public:
  struct Counters {
    std::int64_t datagrams = 0;
    std::int64_t frames = 0;      ///< Complete.
    std::int64_t incomplete = 0;  ///< Dropped: parts did not come, or are not those of one frame.
    std::int64_t lost = 0;        ///< Sequence numbers that did not come, so far.
    std::int64_t duplicated = 0;
    std::int64_t reordered = 0;
    std::int64_t malformed = 0;  ///< No datagram of the sonar: wrong mark, type or length.
    std::int64_t restarts = 0;   ///< Sequence numbers that began anew, or jumped far.
  };

  /// Takes one datagram; returns the frame that it completes.
  std::optional<DidsonFrame> Add(ByteSpan datagram);

  const Counters& counters() const { return counters_; }

 private:
  struct Part {
    std::uint16_t sequence = 0, type = 0;
    ByteVector payload;
  };

  enum class Arrival { kInTime, kDuplicate, kRestart };

  static std::optional<Part> Parse(ByteSpan datagram);
  Arrival Place(const Part& part) const;
  void Note(std::uint16_t sequence);
  void Restart();
  void DropOld();
  int AgeOf(std::uint16_t sequence) const;
  const Part* Find(std::uint16_t sequence) const;
  std::optional<DidsonFrame> Assemble(const Part& first) const;
  bool IsWhole(const Part& first) const;
  std::optional<DidsonFrame> TakeComplete();
  void Remove(std::uint16_t first, int count);

  Counters counters_;
  std::vector<Part> parts_;
  bool has_begun_ = false;
  std::uint16_t newest_ = 0;
  std::uint64_t seen_ = 0;  // Bit i: sequence number newest_ - i came.
  ByteVector header_;       // Of the last frame that began.
  std::uint16_t header_sequence_ = 0;
};

}  // namespace vog
