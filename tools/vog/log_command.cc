#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <regex>

#include "lib/bus/lcm_log.h"
#include "lib/messages/channels.h"
#include "tools/vog/commands.h"

namespace vog {
namespace {

struct ChannelStatistics {
  std::int64_t messages = 0, bytes = 0;
  Time first, last;
};

struct InfoArguments {
  std::string log;
  bool json = false;
};

void ShowInfo(const InfoArguments& arguments) {
  std::map<std::string, ChannelStatistics> channels;
  LcmLogReader reader(arguments.log);
  while (const auto event = reader.Next()) {
    ChannelStatistics& channel = channels[event->channel];
    if (channel.messages == 0) channel.first = event->time;
    channel.last = event->time;
    ++channel.messages;
    channel.bytes += static_cast<std::int64_t>(event->bytes.size());
  }
  if (arguments.json) {
    nlohmann::ordered_json json;
    for (const auto& [name, channel] : channels)
      json[name] = {{"messages", channel.messages},
                    {"bytes", channel.bytes},
                    {"first_utime_us", ToUtime(channel.first)},
                    {"last_utime_us", ToUtime(channel.last)}};
    std::printf("%s\n", json.dump(2).c_str());
    return;
  }
  std::printf("%-18s %10s %12s %12s %12s\n", "channel", "messages", "kB", "first s", "last s");
  for (const auto& [name, channel] : channels)
    std::printf("%-18s %10lld %12.1f %12.3f %12.3f\n", name.c_str(),
                static_cast<long long>(channel.messages), 1e-3 * static_cast<double>(channel.bytes),
                ToSeconds(channel.first), ToSeconds(channel.last));
}

struct CutArguments {
  std::string in, out, channels;
};

void Cut(const CutArguments& arguments) {
  std::regex wanted;
  try {
    wanted = arguments.channels == "inputs" ? kInputsRegex : arguments.channels;
  } catch (const std::regex_error&) {
    throw UsageError("--channels " + arguments.channels + ": not a regular expression");
  }
  LcmLogReader reader(arguments.in);
  LcmLogWriter writer(arguments.out);
  std::int64_t kept = 0;
  while (const auto event = reader.Next()) {
    if (!std::regex_match(event->channel, wanted)) continue;
    writer.Write(event->time, event->channel, event->bytes);
    ++kept;
  }
  std::printf("%lld messages kept\n", static_cast<long long>(kept));
}

}  // namespace

void AddLogCommand(CLI::App& app) {
  auto* log = app.add_subcommand("log", "Look into LCM event logs, and cut them.");
  log->require_subcommand(1);

  auto* info = log->add_subcommand("info", "What a log holds, channel by channel.");
  const auto info_arguments = std::make_shared<InfoArguments>();
  info->add_option("log", info_arguments->log, "LCM event log")->required();
  info->add_flag("--json", info_arguments->json, "print JSON");
  info->callback([info_arguments] { ShowInfo(*info_arguments); });

  auto* cut = log->add_subcommand("cut", "Keep some channels of a log.");
  const auto cut_arguments = std::make_shared<CutArguments>();
  cut->add_option("in", cut_arguments->in, "LCM event log")->required();
  cut->add_option("--channels", cut_arguments->channels,
                  "regular expression for whole channel names; the word inputs stands for what "
                  "the vehicle says")
      ->required();
  cut->add_option("--out", cut_arguments->out, "the new log")->required();
  cut->callback([cut_arguments] { Cut(*cut_arguments); });
}

}  // namespace vog
