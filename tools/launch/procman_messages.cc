#include "tools/launch/procman_messages.h"

#include <algorithm>

namespace vog::procman {
namespace {

constexpr const char* kGivenUp = "given_up";
constexpr float kLongestStop_s = 3600;

/// What is sent again may not hold a zero byte.
std::string UpToZero(const std::string& text) { return text.substr(0, text.find('\0')); }

}  // namespace

bot_procman::command2_t ToMessage(const CommandSpec& spec) {
  bot_procman::command2_t message{};
  message.command_name = spec.name;
  message.exec_str = spec.exec;
  message.group = spec.group;
  message.auto_respawn = spec.auto_respawn;
  message.stop_signal = static_cast<std::int8_t>(spec.stop_signal);
  message.stop_time_allowed = static_cast<float>(spec.stop_time_allowed_s);
  return message;
}

CommandSpec FromMessage(const bot_procman::command2_t& message) {
  CommandSpec spec;
  spec.name = UpToZero(message.command_name);
  spec.exec = UpToZero(message.exec_str);
  spec.group = UpToZero(message.group);
  spec.auto_respawn = message.auto_respawn != 0;
  if (message.stop_signal > 0) spec.stop_signal = std::int32_t{message.stop_signal};
  if (message.stop_time_allowed > 0)
    spec.stop_time_allowed_s = std::min(message.stop_time_allowed, kLongestStop_s);
  return spec;
}

void SetGivenUp(bot_procman::command2_t& message, const std::string& reason) {
  message.option_names.push_back(kGivenUp);
  message.option_values.push_back(reason);
  message.num_options = static_cast<std::int32_t>(message.option_names.size());
}

std::string GivenUp(const bot_procman::command2_t& message) {
  for (std::size_t i = 0; i < message.option_names.size(); ++i)
    if (message.option_names[i] == kGivenUp) return message.option_values[i];
  return "";
}

}  // namespace vog::procman
