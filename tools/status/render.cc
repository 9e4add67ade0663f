#include "tools/status/render.h"

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>

#include "tools/launch/child_process.h"
#include "tools/launch/procman_messages.h"

namespace vog {
namespace {

__attribute__((format(printf, 1, 2))) std::string Format(const char* format, ...) {
  std::array<char, 1024> text{};
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text.data(), text.size(), format, arguments);
  va_end(arguments);
  return text.data();
}

/// What came in a message may not command the terminal.
std::string Plain(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < ' ' || c == 0x7f; }, '?');
  return text;
}

/// ": text" for a text that is there.
std::string Named(const std::string& text) { return text.empty() ? "" : ": " + Plain(text); }

double AgeOf(Time heard, Time now) { return std::max(0.0, ToSeconds(now - heard)); }
bool IsSilent(Time heard, Time now) { return now - heard > kSilentAfter; }

std::string SilenceOf(Time heard, Time now) {
  return IsSilent(heard, now) ? Format("silent for %.0f s", AgeOf(heard, now)) : "";
}

/// Those that tell of trouble first, and none that are zero.
std::string CountersOf(const status_t& status) {
  std::string troubles, others;
  for (const counter_t& counter : status.counter) {
    if (counter.value == 0 || counter.name == "received") continue;
    const bool is_trouble = counter.name == "malformed" || counter.name == "missed" ||
                            counter.name == "stale" || counter.name == "other_run";
    std::string& to = is_trouble ? troubles : others;
    to += counter.name + " " + std::to_string(counter.value) + "  ";
  }
  return Plain(troubles + others);
}

std::string StateOf(const bot_procman::deputy_cmd2_t& command) {
  const std::string given_up = procman::GivenUp(command.cmd);
  if (command.pid != 0) return "runs";
  if (!given_up.empty()) return "given up: " + Plain(given_up);
  return command.actual_runid == 0 ? "not started" : HowItEnded(command.exit_code);
}

void AddProcesses(const SystemView& view, Time now, std::vector<std::string>& lines) {
  lines.push_back(Format("%-20s %-24s %6s %7s %8s  %s", "process", "health", "age s", "msg/s",
                         "restarts", "counters"));
  for (const auto& [name, process] : view.processes()) {
    const std::string silence = SilenceOf(process.status.time, now);
    lines.push_back(
        Format("%-20s %-24s %6.1f %7.1f %8d  %s", Plain(name).c_str(),
               silence.empty() ? Plain(process.status.message.health).c_str() : silence.c_str(),
               AgeOf(process.status.time, now), process.messages.rate_hz(), process.restarts,
               CountersOf(process.status.message).c_str()));
  }
}

void AddDeputy(const Heard<bot_procman::info2_t>& heard, Time now,
               std::vector<std::string>& lines) {
  const bot_procman::info2_t& info = heard.message;
  lines.push_back("");
  lines.push_back(Format("deputy %s: processors %.0f %%, memory free %.1f of %.1f GB  %s",
                         Plain(info.host).c_str(), 100 * static_cast<double>(info.cpu_load),
                         1e-9 * static_cast<double>(info.phys_mem_free_bytes),
                         1e-9 * static_cast<double>(info.phys_mem_total_bytes),
                         SilenceOf(heard.time, now).c_str()));
  lines.push_back(
      Format("  %-18s %8s %6s %8s %4s  %s", "command", "pid", "cpu %", "MB", "run", "state"));
  for (const auto& command : info.cmds)
    lines.push_back(Format("  %-18s %8d %6.1f %8.1f %4d  %s",
                           Plain(command.cmd.command_name).c_str(), command.pid,
                           100 * static_cast<double>(command.cpu_usage),
                           1e-6 * static_cast<double>(command.mem_rss_bytes), command.actual_runid,
                           StateOf(command).c_str()));
}

void AddMission(const SystemView& view, Time now, std::vector<std::string>& lines) {
  if (view.mission() || view.map()) lines.push_back("");
  if (const auto& mission = view.mission())
    lines.push_back(Format("mission  %s%s, %lld plans, %d submaps, %.1f m3 explored  %s",
                           Plain(mission->message.state).c_str(),
                           Named(mission->message.end_reason).c_str(),
                           static_cast<long long>(mission->message.plans), mission->message.submaps,
                           mission->message.explored_m3, SilenceOf(mission->time, now).c_str()));
  if (const auto& map = view.map())
    lines.push_back(Format("map      %d submaps%s%s%s  %s", map->message.submaps,
                           map->message.has_open ? " and an open one" : "",
                           map->message.complete ? ", complete" : "",
                           Named(map->message.fault).c_str(), SilenceOf(map->time, now).c_str()));
}

void AddChannels(const SystemView& view, Time now, std::vector<std::string>& lines) {
  lines.push_back("");
  lines.push_back(Format("%-20s %9s %9s %7s %10s", "channel", "msg/s", "messages", "age s", "kB"));
  for (const auto& [name, channel] : view.channels())
    lines.push_back(Format("%-20s %9.1f %9lld %7.1f %10.1f", Plain(name).c_str(),
                           channel.messages.rate_hz(),
                           static_cast<long long>(channel.messages.count()),
                           AgeOf(channel.last, now), 1e-3 * static_cast<double>(channel.bytes)));
}

nlohmann::ordered_json ToJson(const SystemView::Process& process, Time now) {
  nlohmann::ordered_json counters = nlohmann::ordered_json::object();
  for (const counter_t& counter : process.status.message.counter)
    counters[counter.name] = counter.value;
  return {{"health", process.status.message.health},
          {"silent", IsSilent(process.status.time, now)},
          {"age_s", AgeOf(process.status.time, now)},
          {"rate_hz", process.messages.rate_hz()},
          {"restarts", process.restarts},
          {"counters", counters}};
}

nlohmann::ordered_json ToJson(const Heard<bot_procman::info2_t>& heard, Time now) {
  nlohmann::ordered_json commands = nlohmann::ordered_json::object();
  for (const auto& command : heard.message.cmds)
    commands[command.cmd.command_name] = {{"pid", command.pid},
                                          {"state", StateOf(command)},
                                          {"run", command.actual_runid},
                                          {"exit_status", command.exit_code},
                                          {"cpu_share", command.cpu_usage},
                                          {"resident_bytes", command.mem_rss_bytes},
                                          {"virtual_bytes", command.mem_vsize_bytes}};
  return {{"silent", IsSilent(heard.time, now)},
          {"age_s", AgeOf(heard.time, now)},
          {"cpu_load", heard.message.cpu_load},
          {"memory_bytes", heard.message.phys_mem_total_bytes},
          {"free_memory_bytes", heard.message.phys_mem_free_bytes},
          {"commands", commands}};
}

}  // namespace

std::vector<std::string> RenderText(const SystemView& view, Time now) {
  std::vector<std::string> lines;
  AddProcesses(view, now, lines);
  for (const auto& [host, heard] : view.deputies()) AddDeputy(heard, now, lines);
  AddMission(view, now, lines);
  AddChannels(view, now, lines);
  for (std::string& line : lines) line.resize(line.find_last_not_of(' ') + 1);
  return lines;
}

nlohmann::ordered_json RenderJson(const SystemView& view, Time now) {
  nlohmann::ordered_json json = {{"processes", nlohmann::ordered_json::object()},
                                 {"deputies", nlohmann::ordered_json::object()},
                                 {"mission", nullptr},
                                 {"map", nullptr},
                                 {"channels", nlohmann::ordered_json::object()}};
  for (const auto& [name, process] : view.processes())
    json["processes"][name] = ToJson(process, now);
  for (const auto& [host, heard] : view.deputies()) json["deputies"][host] = ToJson(heard, now);
  if (const auto& mission = view.mission())
    json["mission"] = {{"state", mission->message.state},
                       {"end_reason", mission->message.end_reason},
                       {"plans", mission->message.plans},
                       {"submaps", mission->message.submaps},
                       {"unseen_voxels", mission->message.unseen_voxels},
                       {"unseen_in_vain", mission->message.unseen_in_vain},
                       {"explored_m3", mission->message.explored_m3},
                       {"age_s", AgeOf(mission->time, now)}};
  if (const auto& map = view.map())
    json["map"] = {{"submaps", map->message.submaps},
                   {"has_open", map->message.has_open != 0},
                   {"complete", map->message.complete != 0},
                   {"fault", map->message.fault},
                   {"age_s", AgeOf(map->time, now)}};
  for (const auto& [name, channel] : view.channels())
    json["channels"][name] = {{"rate_hz", channel.messages.rate_hz()},
                              {"messages", channel.messages.count()},
                              {"bytes", channel.bytes},
                              {"age_s", AgeOf(channel.last, now)}};
  return json;
}

}  // namespace vog
