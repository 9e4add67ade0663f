#include "lib/messages/endpoint.h"

#include <algorithm>

#include "lib/base/files.h"

namespace vog {
namespace {

constexpr std::size_t kChunkBytes = 32000;
constexpr int kMaxParts = 1 << 14;
constexpr std::size_t kMaxPartials = 64;
// Messages of a lower epoch, or after a leap, in a row.
constexpr int kBelieved = 3;
// In a sender's count: more are seldom lost at once, and none comes later. The number is damaged,
// or the one before was.
constexpr std::int64_t kLongestLeap = 1000, kLate = 20;

}  // namespace

Endpoint::Endpoint(Bus& bus, std::string process, std::int64_t run_id)
    : bus_(bus), process_(std::move(process)), run_id_(run_id) {}

void Endpoint::FillHeader(const std::string& channel, Time time, header_t& header) {
  header.utime_us = ToUtime(time);
  header.run_id = run_id_;
  header.epoch = bus_.epoch();
  header.sequence = next_sequence_[channel]++;
  header.sender = process_;
}

/// Of a newer epoch, or later in this one. Who was started again after the machine's clock was set
/// back has a lower epoch, and one damaged number must not make deaf for all that comes after: such
/// are believed when nobody else has said anything between their words.
bool Endpoint::IsFresh(const header_t& header, Heard& heard) {
  if (header.epoch > heard.epoch) return true;
  const std::int64_t ahead = header.sequence - heard.sequence;
  if (header.epoch == heard.epoch && ahead > -kLate && ahead <= kLongestLeap) return ahead > 0;
  const bool goes_on = heard.doubted_in_a_row > 0 && header.epoch == heard.doubted_epoch &&
                       header.sequence > heard.doubted_sequence;
  heard.doubted_in_a_row = goes_on ? heard.doubted_in_a_row + 1 : 1;
  heard.doubted_epoch = header.epoch;
  heard.doubted_sequence = header.sequence;
  return heard.doubted_in_a_row >= kBelieved;
}

bool Endpoint::Accept(const std::string& channel, const header_t& header) {
  if (run_id_ == 0) run_id_ = header.run_id;
  if (header.run_id != run_id_) {
    ++counts_.other_run;
    return false;
  }
  const auto [found, is_first] =
      heard_.try_emplace({channel, header.sender}, Heard{header.epoch, header.sequence - 1});
  Heard& heard = found->second;
  if (!IsFresh(header, heard)) {
    ++counts_.stale;
    return false;
  }
  const std::int64_t ahead = header.sequence - heard.sequence;
  if (!is_first && header.epoch == heard.epoch && ahead > 0 && ahead <= kLongestLeap)
    counts_.missed += ahead - 1;
  heard = {header.epoch, header.sequence};
  ++counts_.received;
  return true;
}

void Endpoint::PublishChunks(const Channel<chunk_t>& channel, std::int64_t item,
                             std::int64_t version, const std::vector<std::uint8_t>& bytes,
                             Time time) {
  chunk_t chunk{};
  chunk.item = item;
  chunk.version = version;
  chunk.parts = static_cast<int>((bytes.size() + kChunkBytes - 1) / kChunkBytes);
  chunk.crc32 = Crc32(AsText(bytes));
  for (chunk.part = 0; chunk.part < chunk.parts; ++chunk.part) {
    const std::size_t from = chunk.part * kChunkBytes;
    const std::size_t to = std::min(bytes.size(), from + kChunkBytes);
    chunk.bytes.assign(bytes.begin() + from, bytes.begin() + to);
    chunk.size = static_cast<int>(chunk.bytes.size());
    FillHeader(channel.name, time, chunk.header);
    bus_.PublishPaced(channel.name, Encode(chunk));
  }
}

void Endpoint::ReportStatus(Report report) {
  bus_.Every(std::chrono::seconds(1), [this, report](Time now) { PublishStatus(now, report); });
}

void Endpoint::ReportStatus(Report report, std::function<Time()> now) {
  bus_.Every(std::chrono::seconds(1), [this, report, now](Time) { PublishStatus(now(), report); });
}

void Endpoint::PublishStatus(Time now, const Report& report) {
  std::map<std::string, std::int64_t> counters = {{"received", counts_.received},
                                                  {"malformed", counts_.malformed},
                                                  {"other_run", counts_.other_run},
                                                  {"stale", counts_.stale},
                                                  {"missed", counts_.missed}};
  status_t status{};
  status.process = process_;
  status.health = report(counters);
  for (const auto& [name, value] : counters) {
    counter_t counter{};
    counter.name = name;
    counter.value = value;
    status.counter.push_back(counter);
  }
  status.counters = static_cast<int>(status.counter.size());
  Publish(outputs::kStatus, status, now);
}

std::optional<ChunkAssembler::Whole> ChunkAssembler::Add(const chunk_t& chunk) {
  if (chunk.parts < 1 || chunk.parts > kMaxParts || chunk.part < 0 || chunk.part >= chunk.parts) {
    ++dropped_;
    return std::nullopt;
  }
  const auto found = partials_.find(chunk.item);
  if (found == partials_.end() || found->second.epoch != chunk.header.epoch ||
      found->second.version != chunk.version || found->second.crc32 != chunk.crc32 ||
      static_cast<int>(found->second.parts.size()) != chunk.parts) {
    if (found != partials_.end()) ++dropped_;
    partials_[chunk.item] = {
        chunk.header.epoch, chunk.version,
        chunk.crc32,        std::vector<std::vector<std::uint8_t>>(chunk.parts),
        chunk.parts,        order_++};
    LimitPartials();
  }
  Partial& partial = partials_[chunk.item];
  if (!partial.parts[chunk.part].empty()) return std::nullopt;
  partial.parts[chunk.part] = chunk.bytes;
  if (chunk.bytes.empty() || --partial.missing > 0) return std::nullopt;
  Whole whole{chunk.item, chunk.version, {}};
  for (const auto& part : partial.parts)
    whole.bytes.insert(whole.bytes.end(), part.begin(), part.end());
  partials_.erase(chunk.item);
  if (Crc32(AsText(whole.bytes)) != static_cast<std::uint32_t>(chunk.crc32)) {
    ++dropped_;
    return std::nullopt;
  }
  return whole;
}

void ChunkAssembler::LimitPartials() {
  if (partials_.size() <= kMaxPartials) return;
  const auto oldest = std::min_element(
      partials_.begin(), partials_.end(),
      [](const auto& a, const auto& b) { return a.second.order < b.second.order; });
  partials_.erase(oldest);
  ++dropped_;
}

}  // namespace vog
