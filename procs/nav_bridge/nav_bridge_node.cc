#include "procs/nav_bridge/nav_bridge_node.h"

#include <algorithm>
#include <utility>

#include "lib/bus/lcm_bus.h"
#include "lib/messages/convert.h"
#include "lib/scan/sonar.h"
#include "procs/nav_bridge/hauv_messages.h"

namespace vog {
namespace {

constexpr Duration kWatchdogPeriod = std::chrono::milliseconds(100);
constexpr Duration kLinkPeriod = std::chrono::milliseconds(5);

const Channel<vehicle_nav_t>& ChannelOf(const VehicleNavRecord&) { return inputs::kVehicleNav; }
const Channel<dvl_t>& ChannelOf(const DvlRecord&) { return inputs::kDvl; }
const Channel<imu_t>& ChannelOf(const ImuRecord&) { return inputs::kImu; }
const Channel<depth_t>& ChannelOf(const DepthRecord&) { return inputs::kDepth; }

template <class Record>
std::int64_t EpochOf(const Record&, std::int64_t epoch) {
  return epoch;
}
std::int64_t EpochOf(const VehicleNavRecord& record, std::int64_t) { return record.origin; }

}  // namespace

NavBridgeSettings NavBridgeSettings::From(const Config& config) {
  return {config.Read<NavBridgeOptions>("navigation"),
          config.Read<DeadReckoningOptions>("dead_reckoning"),
          config.Read<DriftOptions>("drift"),
          ToSeconds(config.Read<SonarOptions>("sonar").period()),
          config.Read<VehicleLinkOptions>("vehicle_link"),
          config.Read<PressureOptions>("pressure"),
          config.Read<DopplerOptions>("doppler"),
          config.Read<BusOptions>("bus").run_id};
}

NavBridgeNode::NavBridgeNode(Bus& bus, const NavBridgeSettings& settings,
                             std::unique_ptr<VehicleLink> link)
    : settings_(settings),
      endpoint_(bus, "vog-nav-bridge", settings.run_id),
      link_(std::move(link)),
      hauv_reader_(settings.pressure, settings.doppler),
      tracker_(settings.drift, settings.scan_period_s, bus.epoch(),
               {settings.bridge.jump_m, settings.bridge.max_speed_m_s}),
      reckoner_(settings.dead_reckoning, bus.epoch()) {
  endpoint_.Subscribe(inputs::kVehicleNav,
                      [this](Time, const vehicle_nav_t& message) { OnVehicleNav(message); });
  endpoint_.Subscribe(inputs::kDvl, [this](Time, const dvl_t& message) { Reckon(message); });
  endpoint_.Subscribe(inputs::kDepth, [this](Time, const depth_t& message) { Reckon(message); });
  endpoint_.Subscribe(inputs::kImu, [this](Time, const imu_t& message) { OnImu(message); });
  endpoint_.Subscribe(outputs::kControl,
                      [this](Time now, const control_t& message) { OnControl(now, message); });
  endpoint_.ReportStatus([this](auto& counters) {
    counters["watchdog_stops"] = stops_;
    counters["held_commands"] = held_;
    counters["navigation_jumps"] = tracker_.jumps();
    counters["dvl_outliers"] = reckoner_.outliers();
    if (link_) link_->Count(counters);
    if (refused_hauv_ > 0) counters["refused_hauv_messages"] = refused_hauv_;
    return Health();
  });
  bus.Every(kWatchdogPeriod, [this](Time now) { StopIfCommandIsOld(now); });
  if (link_) bus.Every(kLinkPeriod, [this](Time now) { StepLink(now); });
  SubscribeToHauv(
      bus,
      [this](const Sentence& sentence, Time time) {
        if (const auto record = hauv_reader_.Add(sentence, time)) Tell(*record);
      },
      [this] { ++refused_hauv_; });
}

void NavBridgeNode::StepLink(Time now) {
  for (const auto& record : link_->Step(since_start_.time(), now)) Tell(record);
}

void NavBridgeNode::Tell(const NavigationRecord& record) {
  std::visit(
      [&](const auto& each) {
        endpoint_.Publish(ChannelOf(each), ToMessage(each), each.time,
                          EpochOf(each, endpoint_.epoch()));
      },
      record);
}

void NavBridgeNode::Command(const VelocityCommand& command, Time answered) {
  endpoint_.Publish(outputs::kVehicleCommand, ToMessage(command), answered);
  if (link_) link_->Send(command, answered);
}

void NavBridgeNode::OnVehicleNav(const vehicle_nav_t& message) {
  const auto record = FromMessage(message);
  if (!record) {
    endpoint_.NoteMalformed();
    return;
  }
  if (settings_.bridge.source == NavigationSource::kVehicle) {
    PublishNav(tracker_.Add(*record));
  } else {
    reckoner_.SetFix(record->X_OB);
  }
}

template <class Message>
void NavBridgeNode::Reckon(const Message& message) {
  if (const auto record = FromMessage(message)) {
    reckoner_.Add(*record);
  } else {
    endpoint_.NoteMalformed();
  }
}

void NavBridgeNode::OnImu(const imu_t& message) {
  const auto record = FromMessage(message);
  if (!record) {
    endpoint_.NoteMalformed();
    return;
  }
  const auto sample = reckoner_.Add(*record);
  if (!sample || settings_.bridge.source != NavigationSource::kInstruments) return;
  // Without bottom lock our own reckoning does not know where a velocity leads, nor what is seen
  // where.
  has_lock_ = reckoner_.HasLock(sample->time);
  if (has_lock_) PublishNav(*sample);
}

void NavBridgeNode::PublishNav(const OdometrySample& sample) {
  endpoint_.Publish(outputs::kNav, ToMessage(sample), sample.time, sample.segment);
  has_told_nav_ = true;
}

std::string NavBridgeNode::Health() {
  const bool has_told = std::exchange(has_told_nav_, false);
  if (!has_lock_) return "no bottom lock";
  return has_told ? "ok" : "no navigation";
}

void NavBridgeNode::OnControl(Time now, const control_t& message) {
  auto command = FromMessage(message);
  if (!command) {
    endpoint_.NoteMalformed();
    return;
  }
  const NavBridgeOptions& limits = settings_.bridge;
  const double speed_m_s = command->velocity_B_m_s.norm();
  if (speed_m_s > limits.max_speed_m_s) command->velocity_B_m_s *= limits.max_speed_m_s / speed_m_s;
  command->yaw_rate_rad_s =
      std::clamp(command->yaw_rate_rad_s, -limits.max_yaw_rate_rad_s, limits.max_yaw_rate_rad_s);
  if (!has_lock_) {
    *command = {};
    ++held_;
  }
  // When it came: the vehicle's clock may be another than ours.
  commanded_at_ = now;
  Command(*command, TimeOf(message.header));
}

void NavBridgeNode::StopIfCommandIsOld(Time now) {
  if (!commanded_at_ || ToSeconds(now - *commanded_at_) <= settings_.bridge.command_timeout_s)
    return;
  commanded_at_.reset();
  ++stops_;
  Command({}, now);
}

}  // namespace vog
