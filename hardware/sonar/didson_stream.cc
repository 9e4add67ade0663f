#include "hardware/sonar/didson_stream.h"

#include <algorithm>

namespace vog {
namespace {

constexpr std::uint16_t kMark = 0x5a02;
constexpr std::size_t kMarkAt = 0, kTypeAt = 4, kSequenceAt = 6, kPacketHeaderBytes = 8;
constexpr std::size_t kSmallPacket = 8192, kLargePacket = 24576;
// Sequence numbers that are waited for: some four frames.
constexpr int kWindow = 32;

constexpr std::uint16_t kHeader = 0x08, kHeaderToo = 0x48, kData = 0x10, kLastData = 0x30;
constexpr std::uint16_t kHeaderAndData = 0x01, kRestOfData = 0x22;

bool IsHeader(std::uint16_t type) {
  return type == kHeader || type == kHeaderToo || type == kHeaderAndData;
}

/// Bytes after the packet's header; 0 for a type that is none.
std::size_t PayloadBytes(std::uint16_t type) {
  switch (type) {
    case kHeader:
    case kHeaderToo:
      return kDidsonHeaderBytes;
    case kData:
    case kLastData:
      return kSmallPacket;
    case kHeaderAndData:
      return kDidsonHeaderBytes + kLargePacket;
    case kRestOfData:
      return kLargePacket;
    default:
      return 0;
  }
}

ByteVector MakeDatagram(std::uint16_t type, std::uint16_t sequence, ByteSpan front, ByteSpan back) {
  ByteVector datagram(kPacketHeaderBytes);
  StoreLittle(kMark, kMarkAt, datagram);
  StoreLittle(type, kTypeAt, datagram);
  StoreLittle(sequence, kSequenceAt, datagram);
  datagram.insert(datagram.end(), front.begin(), front.end());
  datagram.insert(datagram.end(), back.begin(), back.end());
  return datagram;
}

/// What must follow a frame's first datagram.
struct Plan {
  int packets;
  std::uint16_t type, last_type;
};

Plan PlanOf(std::uint16_t first_type, ByteSpan header) {
  const std::size_t samples =
      static_cast<std::size_t>(BeamsOf(DecodeDidsonHeader(header))) * kDidsonBins;
  if (first_type == kHeaderAndData)
    return {static_cast<int>(samples / kLargePacket) - 1, kRestOfData, kRestOfData};
  return {static_cast<int>(samples / kSmallPacket), kData, kLastData};
}

}  // namespace

std::vector<ByteVector> EncodeDatagrams(DidsonPacking packing, const DidsonFrame& frame,
                                        std::uint16_t sequence) {
  const bool is_huls3 = packing == DidsonPacking::kHuls3;
  const ByteVector header = EncodeDidsonHeader(frame.header);
  const Plan plan = PlanOf(is_huls3 ? kHeader : kHeaderAndData, header);
  const std::size_t packet = is_huls3 ? kSmallPacket : kLargePacket;
  const std::size_t with_header = is_huls3 ? 0 : kLargePacket;
  const ByteSpan samples = frame.samples;
  std::vector<ByteVector> datagrams = {MakeDatagram(is_huls3 ? kHeader : kHeaderAndData, sequence,
                                                    header, samples.first(with_header))};
  for (int i = 0; i < plan.packets; ++i) {
    const bool is_last = i + 1 == plan.packets;
    datagrams.push_back(MakeDatagram(is_last ? plan.last_type : plan.type, ++sequence, {},
                                     samples.subspan(with_header + i * packet, packet)));
  }
  return datagrams;
}

std::optional<DidsonFrame> DidsonStream::Add(ByteSpan datagram) {
  ++counters_.datagrams;
  auto part = Parse(datagram);
  if (!part) {
    ++counters_.malformed;
    return std::nullopt;
  }
  const Arrival arrival = Place(*part);
  if (arrival == Arrival::kDuplicate) {
    ++counters_.duplicated;
    return std::nullopt;
  }
  if (arrival == Arrival::kRestart) Restart();
  Note(part->sequence);
  if (IsHeader(part->type)) {
    header_.assign(part->payload.begin(), part->payload.begin() + kDidsonHeaderBytes);
    header_sequence_ = part->sequence;
  }
  parts_.push_back(std::move(*part));
  DropOld();
  return TakeComplete();
}

std::optional<DidsonStream::Part> DidsonStream::Parse(ByteSpan datagram) {
  if (datagram.size() < kPacketHeaderBytes || LoadLittle<std::uint16_t>(datagram, kMarkAt) != kMark)
    return std::nullopt;
  const auto type = LoadLittle<std::uint16_t>(datagram, kTypeAt);
  const ByteSpan payload = datagram.subspan(kPacketHeaderBytes);
  if (PayloadBytes(type) == 0 || payload.size() != PayloadBytes(type)) return std::nullopt;
  return Part{LoadLittle<std::uint16_t>(datagram, kSequenceAt), type,
              ByteVector(payload.begin(), payload.end())};
}

/// How much older than the newest a sequence number is; below 0 if it is newer.
int DidsonStream::AgeOf(std::uint16_t sequence) const {
  return static_cast<std::int16_t>(newest_ - sequence);
}

DidsonStream::Arrival DidsonStream::Place(const Part& part) const {
  constexpr int kFarAhead = 4096;
  if (!has_begun_) return Arrival::kInTime;
  const int age = AgeOf(part.sequence);
  if (age >= kWindow || age < -kFarAhead) return Arrival::kRestart;
  if (age < 0 || !(seen_ >> age & 1)) return Arrival::kInTime;
  // Some sonars may count from the same number in each frame: another header is another frame.
  const bool is_new_header = IsHeader(part.type) && part.sequence == header_sequence_ &&
                             !std::equal(header_.begin(), header_.end(), part.payload.begin());
  return is_new_header ? Arrival::kRestart : Arrival::kDuplicate;
}

void DidsonStream::Note(std::uint16_t sequence) {
  const int ahead = has_begun_ ? -AgeOf(sequence) : 1;
  if (ahead > 0) {
    seen_ = ahead < 64 ? seen_ << ahead : 0;
    seen_ |= 1;
    counters_.lost += ahead - 1;
    newest_ = sequence;
    has_begun_ = true;
    return;
  }
  seen_ |= std::uint64_t{1} << -ahead;
  ++counters_.reordered;
  counters_.lost = std::max<std::int64_t>(0, counters_.lost - 1);
}

void DidsonStream::Restart() {
  ++counters_.restarts;
  for (const Part& part : parts_) counters_.incomplete += IsHeader(part.type);
  parts_.clear();
  has_begun_ = false;
  seen_ = 0;
}

void DidsonStream::DropOld() {
  std::erase_if(parts_, [&](const Part& part) {
    const bool is_old = AgeOf(part.sequence) >= kWindow;
    counters_.incomplete += is_old && IsHeader(part.type);
    return is_old;
  });
}

const DidsonStream::Part* DidsonStream::Find(std::uint16_t sequence) const {
  const auto found = std::find_if(parts_.begin(), parts_.end(),
                                  [&](const Part& part) { return part.sequence == sequence; });
  return found == parts_.end() ? nullptr : &*found;
}

bool DidsonStream::IsWhole(const Part& first) const {
  const Plan plan = PlanOf(first.type, first.payload);
  for (int i = 1; i <= plan.packets; ++i) {
    if (!Find(static_cast<std::uint16_t>(first.sequence + i))) return false;
  }
  return true;
}

/// Nothing when the parts are not of the types that they should be. @pre IsWhole(first).
std::optional<DidsonFrame> DidsonStream::Assemble(const Part& first) const {
  const Plan plan = PlanOf(first.type, first.payload);
  DidsonFrame frame{DecodeDidsonHeader(first.payload),
                    ByteVector(first.payload.begin() + kDidsonHeaderBytes, first.payload.end())};
  for (int i = 1; i <= plan.packets; ++i) {
    const Part& part = *Find(static_cast<std::uint16_t>(first.sequence + i));
    if (part.type != (i == plan.packets ? plan.last_type : plan.type)) return std::nullopt;
    frame.samples.insert(frame.samples.end(), part.payload.begin(), part.payload.end());
  }
  return frame;
}

std::optional<DidsonFrame> DidsonStream::TakeComplete() {
  const auto whole = std::find_if(parts_.begin(), parts_.end(), [&](const Part& part) {
    return IsHeader(part.type) && IsWhole(part);
  });
  if (whole == parts_.end()) return std::nullopt;
  const std::uint16_t first = whole->sequence;
  auto frame = Assemble(*whole);
  if (frame) {
    ++counters_.frames;
    Remove(first, PlanOf(whole->type, whole->payload).packets);
  } else {
    ++counters_.incomplete;
    Remove(first, 0);
  }
  return frame;
}

/// Forgets a datagram and the `count` that follow it.
void DidsonStream::Remove(std::uint16_t first, int count) {
  std::erase_if(parts_, [&](const Part& part) {
    return static_cast<std::uint16_t>(part.sequence - first) <= count;
  });
}

}  // namespace vog
