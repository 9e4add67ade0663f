#include "lib/messages/submap_assembler.h"

#include <limits>

#include "lib/messages/convert.h"

namespace vog {

SubmapAssembler::Result SubmapAssembler::Add(const chunk_t& chunk) {
  if (chunk.item < 0 || chunk.item > std::numeric_limits<SubmapId>::max())
    return {.submap = nullptr, .is_malformed = true};
  const auto id = static_cast<SubmapId>(chunk.item);
  const auto known = checksums_.find(id);
  if (known != checksums_.end() && known->second == chunk.version) return {};
  const auto whole = chunks_.Add(chunk);
  if (!whole) return {};
  submap_t message{};
  std::optional<SubmapPtr> submap;
  if (Decode(whole->bytes, message)) submap = FromMessage(message);
  if (!submap || (*submap)->id() != id) return {.submap = nullptr, .is_malformed = true};
  Result result{.submap = *submap, .is_of_another_map = known != checksums_.end()};
  if (result.is_of_another_map) checksums_.clear();
  checksums_[id] = static_cast<std::uint32_t>(chunk.version);
  return result;
}

}  // namespace vog
