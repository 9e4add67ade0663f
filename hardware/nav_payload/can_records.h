#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <tuple>
#include <variant>
#include <vector>

#include "dbc/vogmap_dbc.h"
#include "lib/navigation/records.h"

namespace vog {

/// What travels over vogmap.dbc's bus. Records that have no time of their own on the bus have the
/// time at which their frame was received.

struct CanDvl {
  DvlRecord record;
  std::array<std::optional<double>, 4> range_m;  ///< Along the log's axis.
};

/// The vehicle's clock.
struct VehicleTime {
  Time time{}, received{};
};

enum class VehicleMode { kIdle, kManual, kVehicle, kPayload, kFault };

struct VehicleStatus {
  Time time{};
  VehicleMode mode = VehicleMode::kIdle;
  double battery_v = 0, battery_fraction = 0;
  bool leak = false;
};

struct Heartbeat {
  Time time{};
  double uptime_s = 0;
  bool ready = false;
};
struct VehicleHeartbeat : Heartbeat {};
struct PayloadHeartbeat : Heartbeat {};

struct CanVelocityCommand {
  Time time{};  ///< Of the navigation that it answers.
  VelocityCommand command;
};

/// Shares of the greatest thrust, -1..1.
struct ThrusterCommand {
  std::array<double, 8> thrust{};
};

using CanRecord =
    std::variant<CanDvl, ImuRecord, DepthRecord, VehicleNavRecord, VehicleTime, VehicleStatus,
                 VehicleHeartbeat, PayloadHeartbeat, CanVelocityCommand, ThrusterCommand>;

/// The messages of each record, in the order in which they are sent. Numbers are rounded and held
/// within the ranges of vogmap.dbc.
std::tuple<dbc::DvlTime, dbc::DvlVelocity, dbc::DvlRanges> ToMessages(const CanDvl& dvl);
std::tuple<dbc::ImuTime, dbc::ImuAttitude, dbc::ImuRates> ToMessages(const ImuRecord& imu);
std::tuple<dbc::DepthTime, dbc::Depth> ToMessages(const DepthRecord& depth);
std::tuple<dbc::NavTime, dbc::NavOrigin, dbc::NavXY, dbc::NavZYaw, dbc::NavRollPitch,
           dbc::NavMotion>
ToMessages(const VehicleNavRecord& nav);
std::tuple<dbc::VehicleTime> ToMessages(const VehicleTime& time);
std::tuple<dbc::VehicleStatus> ToMessages(const VehicleStatus& status);
std::tuple<dbc::VehicleHeartbeat> ToMessages(const VehicleHeartbeat& heartbeat);
std::tuple<dbc::PayloadHeartbeat> ToMessages(const PayloadHeartbeat& heartbeat);
std::tuple<dbc::CommandTime, dbc::VelocityCommand> ToMessages(const CanVelocityCommand& command);
std::tuple<dbc::Thrusters14, dbc::Thrusters58> ToMessages(const ThrusterCommand& command);

template <class Record>
using MessagesOf = decltype(ToMessages(std::declval<const Record&>()));

/// Makes frames of records and numbers them, each kind of record by itself.
class CanRecordWriter {
 public:
  std::vector<CanFrame> Write(const CanRecord& record);

 private:
  std::array<int, std::variant_size_v<CanRecord>> counters_{};
};

/// Puts the frames of one kind of record together: those of one record come one after another and
/// have one counter.
template <class Record>
struct CanGroup {
  MessagesOf<Record> messages;
  std::size_t next = 0;        ///< The message that is awaited.
  int counter = 0;             ///< Of the messages so far.
  std::optional<int> newest;   ///< Counter of the newest record,
  std::int64_t sequence = -1;  ///< and its number since the first.
};

/// Makes records of frames. A record that lost a frame is left out whole.
class CanRecordReader {
 public:
  /// The record that `frame` completes.
  std::optional<CanRecord> Add(const CanFrame& frame);

  /// Frames of known identifier that are damaged or say a number out of range.
  std::int64_t rejected_frames() const { return rejected_frames_; }
  /// Frames out of order: of records that lost a frame, or repeated.
  std::int64_t stray_frames() const { return stray_frames_; }
  /// Records that never came whole, by their counters (modulo 16).
  std::int64_t lost_records() const { return lost_records_; }

 private:
  template <class Record>
  bool TryGroup(const CanFrame& frame, std::optional<CanRecord>& record);
  template <class Record, std::size_t I>
  bool TryMessage(const CanFrame& frame, CanGroup<Record>& group);
  template <class Record>
  std::optional<CanRecord> Finish(const CanFrame& frame, CanGroup<Record>& group);

  std::tuple<CanGroup<CanDvl>, CanGroup<ImuRecord>, CanGroup<DepthRecord>,
             CanGroup<VehicleNavRecord>, CanGroup<VehicleTime>, CanGroup<VehicleStatus>,
             CanGroup<VehicleHeartbeat>, CanGroup<PayloadHeartbeat>, CanGroup<CanVelocityCommand>,
             CanGroup<ThrusterCommand>>
      groups_;
  std::int64_t rejected_frames_ = 0, stray_frames_ = 0, lost_records_ = 0;
};

}  // namespace vog
