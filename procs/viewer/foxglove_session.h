#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "procs/viewer/foxglove_feed.h"
#include "procs/viewer/web_session.h"

namespace vog {

/// A client that speaks Foxglove's WebSocket protocol, version 1 (github.com/foxglove/ws-protocol,
/// docs/spec.md). It is told of channels, subscribes, and gets first the newest messages of each,
/// then all that come. It can tell us nothing else: what it asks beyond that is answered with a
/// status and counted.
class FoxgloveSession final : public WebSession {
 public:
  /// Two names of one protocol.
  static constexpr std::array<std::string_view, 2> kSubprotocols = {"foxglove.websocket.v1",
                                                                    "foxglove.sdk.v1"};

  /// Both must outlive it.
  FoxgloveSession(const FoxgloveFeed& feed, WebCounts& counts) : feed_(feed), counts_(counts) {}

  std::optional<std::uint16_t> OnMessage(const std::string& bytes, bool is_text) override;
  std::optional<Frame> NextFrame() override;
  bool HasAnswers() const override { return !answers_.empty(); }
  bool IsWelcome() const override { return true; }  // Its address has shown the token.

 private:
  struct Subscription {
    std::uint32_t channel_id;
    std::int64_t since;         ///< Revision: of what is older, only the newest are told.
    std::int64_t number;        ///< Of the channel's last message that was told, or was before.
    std::int64_t revision = 0;  ///< As far as the channel was read.
  };
  using Subscriptions = std::map<std::uint32_t, Subscription>;  // By the client's id.
  using Entry = std::pair<const std::int64_t, FoxgloveFeed::Message>;

  void Handle(const nlohmann::json& message);
  void Subscribe(const nlohmann::json& subscriptions);
  /// What is wrong with it; empty when it is subscribed.
  std::string Subscribe(const nlohmann::json& id, const nlohmann::json& channel_id);
  void Unsubscribe(const nlohmann::json& ids);
  void Refuse(const std::string& why);

  std::optional<Frame> Unadvertise();
  std::optional<Frame> Advertise();
  std::optional<Frame> TellTime();
  std::optional<Frame> TellMessage();
  const Entry* NextOf(Subscription& subscription) const;

  const FoxgloveFeed& feed_;
  WebCounts& counts_;
  std::deque<Frame> answers_;
  Subscriptions subscriptions_;
  bool has_greeted_ = false, has_advertised_ = false;
  std::uint32_t next_channel_ = 0;  // Those below were advertised, or have ended.
  std::set<std::uint32_t> advertised_;
  std::int64_t ended_ = 0;
  std::optional<std::uint64_t> told_time_ns_;
};

}  // namespace vog
