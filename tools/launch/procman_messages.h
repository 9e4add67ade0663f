#pragma once

#include "bot_procman/discovery_t.hpp"
#include "bot_procman/info2_t.hpp"
#include "bot_procman/orders2_t.hpp"
#include "bot_procman/printf_t.hpp"
#include "lib/messages/endpoint.h"
#include "tools/launch/pmd_file.h"

namespace vog::procman {

// The channels of bot2-procman, whose sheriffs and deputies understand ours.
inline constexpr Channel<bot_procman::orders2_t> kOrders{"PMD_ORDERS2"};
inline constexpr Channel<bot_procman::info2_t> kInfo{"PMD_INFO2"};
inline constexpr Channel<bot_procman::printf_t> kPrintf{"PMD_PRINTF"};
inline constexpr Channel<bot_procman::discovery_t> kDiscovery{"PMD_DISCOVER"};

bot_procman::command2_t ToMessage(const CommandSpec& spec);
/// The host is not part of it; what is left out or cannot be has the defaults of CommandSpec.
CommandSpec FromMessage(const bot_procman::command2_t& message);

/// What a deputy of ours tells of a command besides, as an option that others pass over: why it
/// does not start it any more.
void SetGivenUp(bot_procman::command2_t& message, const std::string& reason);
/// Empty: it has not given up.
std::string GivenUp(const bot_procman::command2_t& message);

/// Calls `handle(now, message)` with each message on a channel; what cannot be decoded is left out.
template <class Message, class Handle>
void Subscribe(Bus& bus, const Channel<Message>& channel, Handle handle) {
  bus.Subscribe(channel.name, [handle](Time now, Bytes bytes) {
    Message message{};
    if (Decode(bytes, message)) handle(now, message);
  });
}

}  // namespace vog::procman
