#include "tools/launch/procman_messages.h"

namespace vog::procman {

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
  spec.name = message.command_name;
  spec.exec = message.exec_str;
  spec.group = message.group;
  spec.auto_respawn = message.auto_respawn != 0;
  if (message.stop_signal > 0) spec.stop_signal = message.stop_signal;
  if (message.stop_time_allowed > 0) spec.stop_time_allowed_s = message.stop_time_allowed;
  return spec;
}

}  // namespace vog::procman
