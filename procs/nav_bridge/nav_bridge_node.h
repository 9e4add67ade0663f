#pragma once

#include <memory>
#include <optional>

#include "lib/base/config.h"
#include "lib/bus/stopwatch.h"
#include "lib/messages/endpoint.h"
#include "lib/navigation/dead_reckoning.h"
#include "procs/nav_bridge/vehicle_link.h"

namespace vog {

/// Where NAV comes from.
enum class NavigationSource { kVehicle, kInstruments };

struct NavBridgeOptions {
  NavigationSource source = NavigationSource::kVehicle;
  double max_speed_m_s = 0.3;
  double max_yaw_rate_rad_s = 0.2;
  double command_timeout_s = 0.5;
  double jump_m = 0.5;

  void Visit(OptionsVisitor& v) {
    v("source", source,
      Names<NavigationSource>{{NavigationSource::kVehicle, "vehicle"},
                              {NavigationSource::kInstruments, "instruments"}},
      "the vehicle's own reckoning (VEHICLE_NAV), or ours from DVL, IMU and DEPTH");
    v("max_speed_m_s", max_speed_m_s, Between(0.01, 10), "no command above passes to the vehicle");
    v("max_yaw_rate_rad_s", max_yaw_rate_rad_s, Between(0.01, 10), "nor above this");
    v("command_timeout_s", command_timeout_s, Between(0.05, 60),
      "without a command for so long the vehicle is told to stop");
    v("jump_m", jump_m, Between(0.05, 1e6),
      "a pose so far from where the vehicle's velocity leads is a jump of its reckoning");
  }
};

struct NavBridgeSettings {
  NavBridgeOptions bridge;
  DeadReckoningOptions dead_reckoning;
  DriftOptions drift;
  double scan_period_s = 0.2;
  VehicleLinkOptions vehicle_link;
  PressureOptions pressure;
  DopplerOptions doppler;
  std::int64_t run_id = 0;

  static NavBridgeSettings From(const Config& config);
};

/// Between the vehicle's navigation and the rest: dead-reckons NAV, and passes CONTROL on as
/// VEHICLE_COMMAND, within limits and only while it is fresh. What comes over a link is told as
/// messages, which a log keeps, before it is heard like those of others; commands go over it too.
/// In: VEHICLE_NAV, DVL, IMU, DEPTH, CONTROL; HAUV_BS_RNV_2, _CNV, _DVL_2, _IMU, _RDP of others'
/// logs, told anew like what comes over a link. Out: NAV, VEHICLE_COMMAND, STATUS; with a link or
/// those also the first four.
class NavBridgeNode {
 public:
  /// `link` may be none.
  NavBridgeNode(Bus& bus, const NavBridgeSettings& settings,
                std::unique_ptr<VehicleLink> link = nullptr);

 private:
  void StepLink(Time now);
  void Tell(const NavigationRecord& record);
  void Command(const VelocityCommand& command, Time answered);
  void OnVehicleNav(const vehicle_nav_t& message);
  template <class Message>
  void Reckon(const Message& message);
  void OnImu(const imu_t& message);
  void OnControl(Time now, const control_t& message);
  std::string Health();
  void PublishNav(const OdometrySample& sample);
  void StopIfCommandIsOld(Time now);

  NavBridgeSettings settings_;
  Endpoint endpoint_;
  std::unique_ptr<VehicleLink> link_;
  Stopwatch since_start_;
  BluefinReader hauv_reader_;
  std::int64_t refused_hauv_ = 0;
  VehicleNavTracker tracker_;
  DeadReckoner reckoner_;
  std::optional<Time> commanded_at_;  // While the vehicle moves on a command.
  bool has_told_nav_ = false;         // Since the last STATUS.
  bool has_lock_ = true;              // Of the Doppler log, with the newest NAV of ours.
  std::int64_t stops_ = 0, held_ = 0;
};

}  // namespace vog
