#include "procs/viewer/foxglove_session.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

namespace vog {
namespace {

using nlohmann::json;

enum : std::uint8_t { kMessageData = 1, kTime = 2 };  // Opcodes of binary frames.
constexpr int kError = 2;                             // A level of "status".

constexpr std::uint64_t kTimePeriod_ns = 100'000'000;

Frame ToFrame(const json& object) {
  return TextFrame(object.dump(-1, ' ', false, json::error_handler_t::replace));
}

template <class Number>
void Append(Number number, std::string& bytes) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof(number));
}

std::optional<std::uint32_t> AsId(const json& value) {
  if (!value.is_number_unsigned() ||
      value.get<std::uint64_t>() > std::numeric_limits<std::uint32_t>::max())
    return std::nullopt;
  return value.get<std::uint32_t>();
}

/// A field of an object; null where there is none.
json FieldOf(const json& object, const char* name) {
  return object.is_object() ? object.value(name, json()) : json();
}

}  // namespace

std::optional<std::uint16_t> FoxgloveSession::OnMessage(const std::string& bytes, bool is_text) {
  if (is_text) {
    Handle(json::parse(bytes, nullptr, false));
  } else {
    Refuse("nothing can be published here");
  }
  return std::nullopt;
}

void FoxgloveSession::Handle(const json& message) {
  const json op = FieldOf(message, "op");
  if (!op.is_string()) {
    Refuse("not understood: a JSON object with its op is expected");
  } else if (op == "subscribe") {
    Subscribe(FieldOf(message, "subscriptions"));
  } else if (op == "unsubscribe") {
    Unsubscribe(FieldOf(message, "subscriptionIds"));
  } else {
    Refuse("only subscribe and unsubscribe are understood here, not " +
           op.get<std::string>().substr(0, 40));
  }
}

void FoxgloveSession::Refuse(const std::string& why) {
  ++counts_.malformed;
  answers_.push_back(ToFrame({{"op", "status"}, {"level", kError}, {"message", why}}));
}

void FoxgloveSession::Subscribe(const json& subscriptions) {
  if (!subscriptions.is_array()) return Refuse("subscribe: subscriptions must be a list");
  std::size_t refused = 0;
  std::string first_why;
  for (const json& wanted : subscriptions) {
    const std::string why = Subscribe(FieldOf(wanted, "id"), FieldOf(wanted, "channelId"));
    if (!why.empty() && refused++ == 0) first_why = why;
  }
  if (refused > 0)
    Refuse("subscribe: " + std::to_string(refused) + " of " + std::to_string(subscriptions.size()) +
           " refused, the first because " + first_why);
}

std::string FoxgloveSession::Subscribe(const json& id, const json& channel_id) {
  const auto number = AsId(id), channel_number = AsId(channel_id);
  if (!number || !channel_number) return "id and channelId must be integers of 32 bits";
  const auto channel = feed_.channels().find(*channel_number);
  if (channel == feed_.channels().end())
    return "there is no channel " + std::to_string(*channel_number);
  const bool is_double =
      std::any_of(subscriptions_.begin(), subscriptions_.end(),
                  [&](const auto& entry) { return entry.second.channel_id == *channel_number; });
  if (is_double) return "channel " + std::to_string(*channel_number) + " is subscribed to already";
  const Subscription subscription{*channel_number, feed_.revision(), channel->second.posted};
  if (!subscriptions_.emplace(*number, subscription).second)
    return "id " + std::to_string(*number) + " is in use";
  return "";
}

void FoxgloveSession::Unsubscribe(const json& ids) {
  if (!ids.is_array()) return Refuse("unsubscribe: subscriptionIds must be a list");
  std::size_t unknown = 0;
  for (const json& id : ids) {
    const auto number = AsId(id);
    if (!number || subscriptions_.erase(*number) == 0) ++unknown;
  }
  if (unknown > 0)
    Refuse("unsubscribe: " + std::to_string(unknown) + " of " + std::to_string(ids.size()) +
           " are no ids of subscriptions");
}

std::optional<Frame> FoxgloveSession::NextFrame() {
  if (!std::exchange(has_greeted_, true))
    return ToFrame(
        {{"op", "serverInfo"}, {"name", "Vogmap " VOG_VERSION}, {"capabilities", {"time"}}});
  if (!answers_.empty()) {
    const Frame frame = answers_.front();
    answers_.pop_front();
    return frame;
  }
  for (const auto tell : {&FoxgloveSession::Unadvertise, &FoxgloveSession::Advertise,
                          &FoxgloveSession::TellTime, &FoxgloveSession::TellMessage}) {
    if (auto frame = (this->*tell)()) return frame;
  }
  return std::nullopt;
}

std::optional<Frame> FoxgloveSession::Unadvertise() {
  if (std::exchange(ended_, feed_.ended()) == feed_.ended()) return std::nullopt;
  const auto is_gone = [&](std::uint32_t id) { return !feed_.channels().contains(id); };
  json gone = json::array();
  std::copy_if(advertised_.begin(), advertised_.end(), std::back_inserter(gone), is_gone);
  std::erase_if(advertised_, is_gone);
  if (gone.empty()) return std::nullopt;
  return ToFrame({{"op", "unadvertise"}, {"channelIds", gone}});
}

std::optional<Frame> FoxgloveSession::Advertise() {
  if (has_advertised_ && next_channel_ == feed_.next_id()) return std::nullopt;
  std::string channels;
  const auto& all = feed_.channels();
  for (auto channel = all.lower_bound(next_channel_); channel != all.end(); ++channel) {
    channels += (channels.empty() ? "" : ",") + channel->second.description;
    advertised_.insert(channel->first);
  }
  next_channel_ = feed_.next_id();
  if (std::exchange(has_advertised_, true) && channels.empty()) return std::nullopt;
  return TextFrame(R"({"op":"advertise","channels":[)" + channels + "]}");
}

std::optional<Frame> FoxgloveSession::TellTime() {
  const std::uint64_t now_ns = feed_.time_ns();
  if (feed_.revision() == 0) return std::nullopt;  // Nobody knows it yet.
  if (told_time_ns_ && now_ns >= *told_time_ns_ && now_ns - *told_time_ns_ < kTimePeriod_ns)
    return std::nullopt;
  told_time_ns_ = now_ns;
  std::string bytes;
  Append(kTime, bytes);
  Append(now_ns, bytes);
  return BinaryFrame(std::move(bytes));
}

std::optional<Frame> FoxgloveSession::TellMessage() {
  const Entry* oldest = nullptr;
  Subscriptions::iterator reader;
  for (auto entry = subscriptions_.begin(); entry != subscriptions_.end(); ++entry) {
    const Entry* const next = NextOf(entry->second);
    if (next == nullptr || (oldest != nullptr && next->first > oldest->first)) continue;
    oldest = next;
    reader = entry;
  }
  if (oldest == nullptr) return std::nullopt;
  auto& [id, subscription] = *reader;
  const auto& [revision, message] = *oldest;
  subscription.revision = revision;
  if (revision > subscription.since)
    counts_.skipped += message.number - std::exchange(subscription.number, message.number) - 1;
  std::string bytes;
  Append(kMessageData, bytes);
  Append(id, bytes);
  return BinaryFrame(bytes + *message.bytes);
}

/// nullptr for a channel that has ended: its subscriptions stay until the client ends them.
const FoxgloveSession::Entry* FoxgloveSession::NextOf(Subscription& subscription) const {
  const auto found = feed_.channels().find(subscription.channel_id);
  if (found == feed_.channels().end()) return nullptr;
  const FoxgloveFeed::Channel& channel = found->second;
  auto next = channel.messages.upper_bound(subscription.revision);
  while (next != channel.messages.end() && next->first <= subscription.since &&
         !channel.IsNewest(next->first, next->second)) {
    subscription.revision = next->first;
    ++next;
  }
  return next != channel.messages.end() ? &*next : nullptr;
}

}  // namespace vog
