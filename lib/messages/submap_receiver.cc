#include "lib/messages/submap_receiver.h"

#include <array>
#include <cstring>

#include "lib/base/files.h"

namespace vog {
namespace {

// Submaps asked for at once: what the service can send before the next tick.
constexpr int kMaxRequested = 16;

}  // namespace

void AskForPoses(Endpoint& endpoint, Time now) {
  map_request_t request{};
  request.kind = "poses";
  endpoint.Publish(outputs::kMapRequest, request, now);
}

std::uint32_t ContentChecksum(submap_t message) {
  message.header = header_t{};
  return Crc32(AsText(Encode(message)));
}

std::int64_t AppendToDigest(std::int64_t digest, std::uint32_t checksum) {
  std::array<char, sizeof(digest) + sizeof(checksum)> bytes;
  std::memcpy(bytes.data(), &digest, sizeof(digest));
  std::memcpy(bytes.data() + sizeof(digest), &checksum, sizeof(checksum));
  const std::string_view text(bytes.data(), bytes.size());
  return static_cast<std::int64_t>(Crc32(text)) << 16 ^ Crc32(text.substr(4));
}

SubmapReceiver::SubmapReceiver(Endpoint& endpoint, Callbacks callbacks)
    : endpoint_(endpoint), callbacks_(std::move(callbacks)) {
  endpoint_.Subscribe(outputs::kSubmap, [this](Time, const chunk_t& chunk) { OnChunk(chunk); });
  endpoint_.Subscribe(outputs::kMapStatus,
                      [this](Time, const map_status_t& status) { OnMapStatus(status); });
  endpoint_.bus().Every(std::chrono::seconds(1), [this](Time now) { AskForMissing(now); });
}

void SubmapReceiver::OnChunk(const chunk_t& chunk) {
  const SubmapAssembler::Result result = submaps_.Add(chunk);
  if (result.is_malformed) endpoint_.NoteMalformed();
  if (result.is_of_another_map) callbacks_.on_reset();
  if (result.submap) callbacks_.on_submap(result.submap);
}

bool SubmapReceiver::IsComplete() const {
  return announced_ >= 0 && static_cast<int>(submaps_.checksums().size()) >= announced_;
}

std::int64_t SubmapReceiver::DigestOf(int submaps) const {
  std::int64_t digest = 0;
  SubmapId newest = -1;
  for (const auto& [id, checksum] : submaps_.checksums()) {
    if (id != ++newest || id >= submaps) break;
    digest = AppendToDigest(digest, checksum);
  }
  return digest;
}

void SubmapReceiver::OnMapStatus(const map_status_t& status) {
  if (status.submaps < 0 || status.first < 0 || status.first > status.submaps) {
    endpoint_.NoteMalformed();
    return;
  }
  announced_ = status.submaps;
  if (Contradicts(status)) {
    submaps_.Clear();
    callbacks_.on_reset();
  }
  callbacks_.on_status(status);
}

bool SubmapReceiver::Contradicts(const map_status_t& status) const {
  if (static_cast<int>(submaps_.checksums().size()) > announced_) return true;
  for (int id = 0; id < announced_; ++id) {
    if (!submaps_.checksums().count(id)) return false;  // Not all here yet.
  }
  return DigestOf(announced_) != status.digest;
}

void SubmapReceiver::AskForMissing(Time now) {
  map_request_t request{};
  request.request_id = next_request_;
  request.kind = "submaps";
  for (int id = 0; id < announced_before_ && request.ids < kMaxRequested; ++id) {
    if (submaps_.checksums().count(id)) continue;
    request.submap_id.push_back(id);
    ++request.ids;
  }
  announced_before_ = announced_;
  if (request.ids == 0) return;
  ++next_request_;
  endpoint_.Publish(outputs::kMapRequest, request, now);
}

}  // namespace vog
