#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "lib/bus/lcm_log.h"
#include "tools/log/log_files.h"
#include "tools/log/mcap_export.h"
#include "tools/log/record.h"
#include "tools/mission/progress_bar.h"
#include "tools/vog/commands.h"
#include "tools/vog/log_arguments.h"

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
  std::string in, out;
  LogSelection selection;
};

struct MergeArguments {
  std::vector<std::string> in;
  std::string out;
};

struct ExportArguments {
  std::string log, mcap;
};

struct RecordArguments {
  RecordOptions record;
  double max_mb = 0;
};

void PrintKept(std::int64_t messages) {
  std::printf("%lld messages kept\n", static_cast<long long>(messages));
}

void RunRecord(RecordArguments arguments) {
  if (arguments.record.recorder.keep > 0 && arguments.max_mb == 0)
    throw UsageError("--keep needs --max-mb; see --help");
  arguments.record.recorder.max_bytes = static_cast<std::uintmax_t>(1e6 * arguments.max_mb);
  PrintKept(Record(arguments.record));
}

void RunExport(const ExportArguments& arguments) {
  const McapExport done = [&] {
    ProgressBar bar;
    return ExportToMcap(arguments.log, arguments.mcap,
                        [&](double share) { bar.Show(share, "messages"); });
  }();
  std::printf("%lld messages written\n", static_cast<long long>(done.messages));
  if (done.malformed > 0)
    std::printf("%lld of them make no sense: topics CHANNEL/malformed\n",
                static_cast<long long>(done.malformed));
}

void AddInfo(CLI::App& log) {
  auto* info = log.add_subcommand("info", "What a log holds, channel by channel.");
  const auto arguments = std::make_shared<InfoArguments>();
  info->add_option("log", arguments->log, "LCM event log")->required();
  info->add_flag("--json", arguments->json, "print JSON");
  info->callback([arguments] { ShowInfo(*arguments); });
}

void AddCut(CLI::App& log) {
  auto* cut = log.add_subcommand("cut", "Keep some channels of a log, or some of its time.");
  const auto arguments = std::make_shared<CutArguments>();
  cut->add_option("in", arguments->in, "LCM event log")->required();
  AddChannelsOption(*cut, arguments->selection.channels);
  AddFromOption(*cut, arguments->selection);
  AddToOption(*cut, arguments->selection);
  cut->add_option("--out", arguments->out, "the new log")->required();
  cut->callback(
      [arguments] { PrintKept(CutLog(arguments->in, arguments->selection, arguments->out)); });
}

void AddMerge(CLI::App& log) {
  auto* merge = log.add_subcommand("merge", "Make one log of several, in the order of time.");
  const auto arguments = std::make_shared<MergeArguments>();
  merge->add_option("in", arguments->in, "LCM event logs")->required();
  merge->add_option("--out", arguments->out, "the new log")->required();
  merge->callback([arguments] { PrintKept(MergeLogs(arguments->in, arguments->out)); });
}

void AddExport(CLI::App& log) {
  auto* command = log.add_subcommand(
      "export",
      "Write a log for other programs: an MCAP file, which Lichtblick, Foxglove, Rerun and "
      "PlotJuggler open.\n"
      "A topic a channel: poses, scans, sonar frames, paths, submaps, the pose graph and STATUS as "
      "Foxglove's messages, which are drawn; with all their fields as CHANNEL/fields. Other "
      "channels with all fields. Frames on topics tf and tf/submaps, voxels on SUBMAP/voxels.");
  const auto arguments = std::make_shared<ExportArguments>();
  command->add_option("log", arguments->log, "LCM event log")->required();
  command->add_option("--mcap", arguments->mcap, "the MCAP file")->required();
  command->callback([arguments] { RunExport(*arguments); });
}

void AddRecord(CLI::App& log) {
  auto* command = log.add_subcommand(
      "record",
      "Record what is said on LCM until Ctrl-C.\n"
      "With --max-mb into FILE.000, FILE.001 and so on, after those that are there. On a full disk "
      "messages are left out until there is room; for that the oldest file is removed where --keep "
      "allows it.");
  const auto arguments = std::make_shared<RecordArguments>();
  RecordOptions& record = arguments->record;
  command->add_option("--out", record.recorder.file, "FILE")->required();
  command->add_option("--max-mb", arguments->max_mb, "of one file")->check(CLI::Range(0.001, 1e9));
  command->add_option("--keep", record.recorder.keep, "so many files; older ones are removed")
      ->check(CLI::Range(1, 1'000'000));
  AddChannelsOption(*command, record.channels);
  command
      ->add_option("--clock", record.clock,
                   "times in the log: the machine's (system), or those in the messages (message), "
                   "for simulators")
      ->transform(CLI::CheckedTransformer(std::map<std::string, ClockSource>{
          {"system", ClockSource::kSystem}, {"message", ClockSource::kMessage}}));
  command->add_option("--url", record.url, "LCM provider")->capture_default_str();
  command->callback([arguments] { RunRecord(*arguments); });
}

}  // namespace

void AddLogCommand(CLI::App& app) {
  auto* log = app.add_subcommand(
      "log", "Record LCM event logs, look into them, cut, merge and export them.");
  log->require_subcommand(1);
  AddInfo(*log);
  AddCut(*log);
  AddMerge(*log);
  AddExport(*log);
  AddRecord(*log);
}

}  // namespace vog
