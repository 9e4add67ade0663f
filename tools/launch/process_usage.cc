#include "tools/launch/process_usage.h"

#include <unistd.h>

#include <fstream>
#include <map>
#include <sstream>
#include <string>

namespace vog {
namespace {

double SecondsOf(std::int64_t ticks) {
  return static_cast<double>(ticks) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

}  // namespace

std::optional<ProcessUsage> UsageOf(int pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string text;
  if (!std::getline(file, text)) return std::nullopt;
  // The name, in parentheses, may hold anything.
  const std::size_t name_end = text.rfind(')');
  if (name_end == std::string::npos) return std::nullopt;
  std::istringstream fields(text.substr(name_end + 1));
  constexpr int kUserTime = 14, kSystemTime = 15, kVirtual = 23, kResident = 24;  // From 1.
  std::map<int, std::int64_t> values;
  std::string field;
  for (int number = 3; number <= kResident && fields >> field; ++number)
    if (number >= kUserTime) values[number] = std::atoll(field.c_str());
  return ProcessUsage{SecondsOf(values[kUserTime] + values[kSystemTime]), values[kVirtual],
                      values[kResident] * ::sysconf(_SC_PAGESIZE)};
}

MachineUsage UsageOfMachine() {
  MachineUsage usage;
  std::ifstream stat("/proc/stat");
  std::string word;
  stat >> word;  // "cpu": user nice system idle iowait irq softirq steal ...
  std::int64_t ticks = 0;
  for (int field = 0; field < 8 && stat >> ticks; ++field) {
    usage.all_s += SecondsOf(ticks);
    if (field != 3 && field != 4) usage.busy_s += SecondsOf(ticks);
  }
  std::map<std::string, std::int64_t> kilobytes;
  std::ifstream meminfo("/proc/meminfo");
  for (std::string line; std::getline(meminfo, line);) {
    std::istringstream words(line);
    words >> word;
    words >> kilobytes[word];
  }
  usage.memory_bytes = 1024 * kilobytes["MemTotal:"];
  usage.free_memory_bytes = 1024 * kilobytes["MemAvailable:"];
  usage.swap_bytes = 1024 * kilobytes["SwapTotal:"];
  usage.free_swap_bytes = 1024 * kilobytes["SwapFree:"];
  return usage;
}

}  // namespace vog
