#include "tools/launch/deputy.h"

#include <unistd.h>

#include <algorithm>
#include <utility>

#include "lib/base/errors.h"

namespace vog {
namespace {

constexpr Duration kTickPeriod = std::chrono::milliseconds(10);
constexpr Duration kInfoPeriod = std::chrono::seconds(1);
constexpr Duration kDiscoveryPeriod = std::chrono::milliseconds(200);
constexpr Duration kDiscoveryTime = std::chrono::milliseconds(500);
constexpr Duration kOldestOrders = std::chrono::seconds(60);
// Of output over LCM, a second; all of it is in the files.
constexpr std::size_t kMostPrinted_bytes = 200'000;
constexpr std::size_t kMostInMessage_bytes = 30'000;

}  // namespace

Deputy::Deputy(Bus& bus, DeputyOptions options)
    : bus_(bus), options_(std::move(options)), nonce_(::getpid()) {
  std::error_code error;
  std::filesystem::create_directories(options_.output_folder, error);
  if (error)
    throw SystemError(options_.output_folder.string() + ": cannot create: " + error.message());
  procman::Subscribe(bus, procman::kOrders,
                     [this](Time now, const auto& orders) { OnOrders(now, orders); });
  procman::Subscribe(bus, procman::kDiscovery,
                     [this](Time now, const auto& message) { OnDiscovery(now, message); });
  procman::Subscribe(bus, procman::kInfo, [this](Time, const auto& info) {
    if (!is_ready_ && info.host == options_.host) has_rival_ = true;
  });
  bus.Every(kTickPeriod, [this](Time now) { Tick(now); });
}

bool Deputy::IsAnyRunning() const {
  return std::any_of(commands_.begin(), commands_.end(),
                     [](const auto& entry) { return entry.second->command.IsRunning(); });
}

void Deputy::StopAll() {
  is_over_ = true;
  for (auto& [id, managed] : commands_) managed->is_ordered = false;
  StopUnordered();
}

void Deputy::Tick(Time now) {
  if (!is_ready_) {
    LookAround(now);
    return;
  }
  for (auto& [id, managed] : commands_) Step(id, *managed, now);
  std::erase_if(commands_, [](const auto& entry) {
    return !entry.second->is_ordered && !entry.second->command.IsRunning();
  });
  if (now - last_info_ >= kInfoPeriod) {
    may_print_bytes_ = kMostPrinted_bytes;
    MeasureUsage(now);
    PublishInfo(now);
  } else if (std::exchange(has_changed_, false)) {
    PublishInfo(now);
  }
}

void Deputy::LookAround(Time now) {
  if (began_ == Time()) began_ = now;
  if (now - last_discovery_ >= kDiscoveryPeriod) PublishDiscovery(now);
  is_ready_ = now - began_ >= kDiscoveryTime;
}

void Deputy::PublishDiscovery(Time now) {
  last_discovery_ = now;
  bus_.Publish(procman::kDiscovery.name,
               Encode(bot_procman::discovery_t{ToUtime(now), options_.host, nonce_}));
}

void Deputy::OnDiscovery(Time now, const bot_procman::discovery_t& message) {
  if (message.host != options_.host || message.nonce == nonce_) return;
  if (is_ready_) {
    PublishInfo(now);  // The newcomer gives way.
  } else {
    has_rival_ = true;
  }
}

void Deputy::OnOrders(Time now, const bot_procman::orders2_t& orders) {
  if (!is_ready_ || is_over_ || orders.host != options_.host ||
      FromUtime(orders.utime) < now - kOldestOrders)
    return;
  for (auto& [id, managed] : commands_) managed->is_ordered = false;
  for (const auto& order : orders.cmds) {
    try {
      if (IsCommandName(order.cmd.command_name)) Obey(order);
    } catch (const SystemError& error) {
      Print(order.sheriff_id, order.cmd.command_name + ": " + error.what() + "\n", now);
    }
  }
  StopUnordered();
}

void Deputy::StopUnordered() {
  for (auto& [id, managed] : commands_)
    if (!managed->is_ordered) managed->command.Order(managed->command.spec(), 0, true);
}

void Deputy::Obey(const bot_procman::sheriff_cmd2_t& order) {
  const CommandSpec spec = procman::FromMessage(order.cmd);
  auto found = commands_.find(order.sheriff_id);
  if (found == commands_.end())
    found = commands_.emplace(order.sheriff_id, std::make_unique<Managed>(spec, options_)).first;
  Managed& managed = *found->second;
  // Another sheriff's numbers: what runs under this one is stopped first. Orders come again.
  if (managed.command.spec().name != spec.name) return;
  managed.is_ordered = true;
  managed.command.Order(spec, order.desired_runid, order.force_quit != 0);
}

void Deputy::Step(std::int32_t id, Managed& managed, Time now) {
  const int pid = managed.command.pid(), run = managed.command.actual_run();
  Print(id, managed.command.Step(now), now);
  if (managed.command.pid() == pid && managed.command.actual_run() == run) return;
  has_changed_ = true;
  managed.cpu_s = 0;
  managed.cpu_usage = 0;
}

void Deputy::Print(std::int32_t id, std::string text, Time now) {
  std::replace(text.begin(), text.end(), '\0', ' ');  // Which ends a string of LCM.
  for (std::size_t from = 0; from < text.size() && may_print_bytes_ > 0;) {
    const std::size_t size = std::min({text.size() - from, kMostInMessage_bytes, may_print_bytes_});
    bus_.Publish(procman::kPrintf.name, Encode(bot_procman::printf_t{ToUtime(now), options_.host,
                                                                     id, text.substr(from, size)}));
    from += size;
    may_print_bytes_ -= size;
  }
}

void Deputy::MeasureUsage(Time now) {
  const double elapsed_s = last_info_ == Time() ? 0 : ToSeconds(now - last_info_);
  const MachineUsage machine = UsageOfMachine();
  const double all_s = machine.all_s - machine_.all_s;
  cpu_load_ = all_s > 0 ? static_cast<float>((machine.busy_s - machine_.busy_s) / all_s) : 0;
  machine_ = machine;
  for (auto& [id, managed] : commands_) {
    const auto usage = UsageOf(managed->command.pid());
    if (!usage) continue;
    managed->cpu_usage =
        elapsed_s > 0 ? static_cast<float>((usage->cpu_s - managed->cpu_s) / elapsed_s) : 0;
    managed->cpu_s = usage->cpu_s;
  }
  last_info_ = now;
}

void Deputy::PublishInfo(Time now) {
  bot_procman::info2_t info{};
  info.utime = ToUtime(now);
  info.host = options_.host;
  info.cpu_load = cpu_load_;
  info.phys_mem_total_bytes = machine_.memory_bytes;
  info.phys_mem_free_bytes = machine_.free_memory_bytes;
  info.swap_total_bytes = machine_.swap_bytes;
  info.swap_free_bytes = machine_.free_swap_bytes;
  for (const auto& [id, managed] : commands_) {
    const SupervisedCommand& command = managed->command;
    bot_procman::deputy_cmd2_t told{};
    told.cmd = procman::ToMessage(command.spec());
    if (!command.given_up().empty()) procman::SetGivenUp(told.cmd, command.given_up());
    told.pid = command.pid();
    told.actual_runid = command.actual_run();
    told.exit_code = command.exit_status();
    told.cpu_usage = managed->cpu_usage;
    if (const auto usage = UsageOf(command.pid())) {
      told.mem_vsize_bytes = usage->virtual_bytes;
      told.mem_rss_bytes = usage->resident_bytes;
    }
    told.sheriff_id = id;
    info.cmds.push_back(told);
  }
  info.ncmds = static_cast<std::int32_t>(info.cmds.size());
  bus_.Publish(procman::kInfo.name, Encode(info));
}

}  // namespace vog
