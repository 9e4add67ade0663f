#pragma once

#include <cstdint>
#include <optional>

namespace vog {

/// What the kernel tells of a running process: proc(5), /proc/PID/stat.
struct ProcessUsage {
  double cpu_s = 0;  ///< User and system time since it began.
  std::int64_t virtual_bytes = 0, resident_bytes = 0;
};
std::optional<ProcessUsage> UsageOf(int pid);

/// Of the whole machine: /proc/stat and /proc/meminfo. Zero where the kernel does not tell.
struct MachineUsage {
  double busy_s = 0, all_s = 0;  ///< Processor time since it was started, over all processors.
  std::int64_t memory_bytes = 0, free_memory_bytes = 0, swap_bytes = 0, free_swap_bytes = 0;
};
MachineUsage UsageOfMachine();

}  // namespace vog
