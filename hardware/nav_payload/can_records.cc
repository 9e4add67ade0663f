#include "hardware/nav_payload/can_records.h"

#include <algorithm>
#include <utility>

namespace vog {
namespace {

constexpr int kCounters = 16;

double FromTime(Time time) { return static_cast<double>(ToUtime(time)); }
Time ToTime(double utime_us) { return FromUtime(static_cast<std::int64_t>(utime_us)); }

template <class Message>
Message HeartbeatMessage(const Heartbeat& heartbeat) {
  Message message;
  message.uptime_s = heartbeat.uptime_s;
  message.ready = heartbeat.ready;
  return message;
}

/// What a record takes from its frames beyond their messages.
struct Origin {
  Time received;
  std::int64_t sequence;
};

CanDvl ToRecord(const MessagesOf<CanDvl>& messages, const Origin& origin) {
  const auto& [time, velocity, ranges] = messages;
  CanDvl dvl;
  dvl.record = {
      ToTime(time.utime_us), origin.sequence,
      Vec3(velocity.velocity_x_B_m_s, velocity.velocity_y_B_m_s, velocity.velocity_z_B_m_s),
      velocity.valid != 0};
  const std::array range_m = {ranges.range_1_m, ranges.range_2_m, ranges.range_3_m,
                              ranges.range_4_m};
  std::transform(range_m.begin(), range_m.end(), dvl.range_m.begin(),
                 [](double range) { return range > 0 ? std::optional(range) : std::nullopt; });
  return dvl;
}

ImuRecord ToRecord(const MessagesOf<ImuRecord>& messages, const Origin& origin) {
  const auto& [time, attitude, rates] = messages;
  return {ToTime(time.utime_us), origin.sequence, attitude.roll_rad, attitude.pitch_rad,
          Vec3(rates.rate_x_B_rad_s, rates.rate_y_B_rad_s, rates.rate_z_B_rad_s)};
}

DepthRecord ToRecord(const MessagesOf<DepthRecord>& messages, const Origin& origin) {
  const auto& [time, depth] = messages;
  return {ToTime(time.utime_us), origin.sequence, depth.depth_m};
}

VehicleNavRecord ToRecord(const MessagesOf<VehicleNavRecord>& messages, const Origin& origin) {
  const auto& [time, start, x_y, z_yaw, roll_pitch, motion] = messages;
  return {ToTime(time.utime_us),
          origin.sequence,
          static_cast<std::int64_t>(start.origin),
          MakePose({x_y.x_OB_m, x_y.y_OB_m, z_yaw.z_OB_m},
                   {roll_pitch.roll_OB_rad, roll_pitch.pitch_OB_rad, z_yaw.yaw_OB_rad}),
          Vec3(motion.velocity_x_B_m_s, motion.velocity_y_B_m_s, motion.velocity_z_B_m_s),
          motion.yaw_rate_rad_s};
}

VehicleTime ToRecord(const MessagesOf<VehicleTime>& messages, const Origin& origin) {
  return {ToTime(std::get<0>(messages).utime_us), origin.received};
}

VehicleStatus ToRecord(const MessagesOf<VehicleStatus>& messages, const Origin& origin) {
  const auto& [status] = messages;
  return {origin.received, static_cast<VehicleMode>(static_cast<int>(status.mode)),
          status.battery_v, status.battery_fraction, status.leak != 0};
}

VehicleHeartbeat ToRecord(const MessagesOf<VehicleHeartbeat>& messages, const Origin& origin) {
  const auto& [heartbeat] = messages;
  return {{origin.received, heartbeat.uptime_s, heartbeat.ready != 0}};
}

PayloadHeartbeat ToRecord(const MessagesOf<PayloadHeartbeat>& messages, const Origin& origin) {
  const auto& [heartbeat] = messages;
  return {{origin.received, heartbeat.uptime_s, heartbeat.ready != 0}};
}

CanVelocityCommand ToRecord(const MessagesOf<CanVelocityCommand>& messages, const Origin&) {
  const auto& [time, command] = messages;
  return {ToTime(time.utime_us),
          {{command.velocity_x_B_m_s, command.velocity_y_B_m_s, command.velocity_z_B_m_s},
           command.yaw_rate_rad_s}};
}

ThrusterCommand ToRecord(const MessagesOf<ThrusterCommand>& messages, const Origin&) {
  const auto& [a, b] = messages;
  return {{a.thrust_1, a.thrust_2, a.thrust_3, a.thrust_4, b.thrust_5, b.thrust_6, b.thrust_7,
           b.thrust_8}};
}

}  // namespace

MessagesOf<CanDvl> ToMessages(const CanDvl& dvl) {
  MessagesOf<CanDvl> messages;
  auto& [time, velocity, ranges] = messages;
  time.utime_us = FromTime(dvl.record.time);
  const Vec3& v = dvl.record.velocity_B_m_s;
  velocity.valid = dvl.record.valid;
  velocity.velocity_x_B_m_s = v.x();
  velocity.velocity_y_B_m_s = v.y();
  velocity.velocity_z_B_m_s = v.z();
  ranges.range_1_m = dvl.range_m[0].value_or(0);
  ranges.range_2_m = dvl.range_m[1].value_or(0);
  ranges.range_3_m = dvl.range_m[2].value_or(0);
  ranges.range_4_m = dvl.range_m[3].value_or(0);
  return messages;
}

MessagesOf<ImuRecord> ToMessages(const ImuRecord& imu) {
  MessagesOf<ImuRecord> messages;
  auto& [time, attitude, rates] = messages;
  time.utime_us = FromTime(imu.time);
  attitude.roll_rad = imu.roll_rad;
  attitude.pitch_rad = imu.pitch_rad;
  rates.rate_x_B_rad_s = imu.angular_velocity_B_rad_s.x();
  rates.rate_y_B_rad_s = imu.angular_velocity_B_rad_s.y();
  rates.rate_z_B_rad_s = imu.angular_velocity_B_rad_s.z();
  return messages;
}

MessagesOf<DepthRecord> ToMessages(const DepthRecord& depth) {
  MessagesOf<DepthRecord> messages;
  std::get<dbc::DepthTime>(messages).utime_us = FromTime(depth.time);
  std::get<dbc::Depth>(messages).depth_m = depth.depth_m;
  return messages;
}

MessagesOf<VehicleNavRecord> ToMessages(const VehicleNavRecord& nav) {
  MessagesOf<VehicleNavRecord> messages;
  auto& [time, start, x_y, z_yaw, roll_pitch, motion] = messages;
  const RollPitchYaw angles = AnglesOf(nav.X_OB);
  time.utime_us = FromTime(nav.time);
  start.origin = static_cast<double>(nav.origin);
  x_y.x_OB_m = nav.X_OB.translation().x();
  x_y.y_OB_m = nav.X_OB.translation().y();
  z_yaw.z_OB_m = nav.X_OB.translation().z();
  z_yaw.yaw_OB_rad = angles.yaw;
  roll_pitch.roll_OB_rad = angles.roll;
  roll_pitch.pitch_OB_rad = angles.pitch;
  motion.velocity_x_B_m_s = nav.velocity_B_m_s.x();
  motion.velocity_y_B_m_s = nav.velocity_B_m_s.y();
  motion.velocity_z_B_m_s = nav.velocity_B_m_s.z();
  motion.yaw_rate_rad_s = nav.yaw_rate_rad_s;
  return messages;
}

MessagesOf<VehicleTime> ToMessages(const VehicleTime& time) {
  dbc::VehicleTime message;
  message.utime_us = FromTime(time.time);
  return message;
}

MessagesOf<VehicleStatus> ToMessages(const VehicleStatus& status) {
  dbc::VehicleStatus message;
  message.mode = static_cast<int>(status.mode);
  message.battery_v = status.battery_v;
  message.battery_fraction = status.battery_fraction;
  message.leak = status.leak;
  return message;
}

MessagesOf<VehicleHeartbeat> ToMessages(const VehicleHeartbeat& heartbeat) {
  return HeartbeatMessage<dbc::VehicleHeartbeat>(heartbeat);
}

MessagesOf<PayloadHeartbeat> ToMessages(const PayloadHeartbeat& heartbeat) {
  return HeartbeatMessage<dbc::PayloadHeartbeat>(heartbeat);
}

MessagesOf<CanVelocityCommand> ToMessages(const CanVelocityCommand& command) {
  MessagesOf<CanVelocityCommand> messages;
  auto& [time, velocities] = messages;
  const Vec3& velocity_B_m_s = command.command.velocity_B_m_s;
  time.utime_us = FromTime(command.time);
  velocities.velocity_x_B_m_s = velocity_B_m_s.x();
  velocities.velocity_y_B_m_s = velocity_B_m_s.y();
  velocities.velocity_z_B_m_s = velocity_B_m_s.z();
  velocities.yaw_rate_rad_s = command.command.yaw_rate_rad_s;
  return messages;
}

MessagesOf<ThrusterCommand> ToMessages(const ThrusterCommand& command) {
  MessagesOf<ThrusterCommand> messages;
  auto& [a, b] = messages;
  const auto& thrust = command.thrust;
  std::tie(a.thrust_1, a.thrust_2, a.thrust_3, a.thrust_4) =
      std::tie(thrust[0], thrust[1], thrust[2], thrust[3]);
  std::tie(b.thrust_5, b.thrust_6, b.thrust_7, b.thrust_8) =
      std::tie(thrust[4], thrust[5], thrust[6], thrust[7]);
  return messages;
}

std::vector<CanFrame> CanRecordWriter::Write(const CanRecord& record) {
  int& counter = counters_[record.index()];
  std::vector<CanFrame> frames;
  const auto add = [&](const auto&... messages) {
    (frames.push_back(ToCanFrame(messages, counter)), ...);
  };
  std::visit([&](const auto& kind) { std::apply(add, ToMessages(kind)); }, record);
  counter = (counter + 1) % kCounters;
  return frames;
}

std::optional<CanRecord> CanRecordReader::Add(const CanFrame& frame) {
  std::optional<CanRecord> record;
  const auto try_groups = [&]<class... Record>(const std::tuple<CanGroup<Record>...>&) {
    static_cast<void>((TryGroup<Record>(frame, record) || ...));
  };
  try_groups(groups_);
  return record;
}

/// Whether the frame is one of this record's.
template <class Record>
bool CanRecordReader::TryGroup(const CanFrame& frame, std::optional<CanRecord>& record) {
  auto& group = std::get<CanGroup<Record>>(groups_);
  constexpr std::size_t kSize = std::tuple_size_v<MessagesOf<Record>>;
  const auto try_messages = [&]<std::size_t... I>(std::index_sequence<I...>) {
    return (TryMessage<Record, I>(frame, group) || ...);
  };
  if (!try_messages(std::make_index_sequence<kSize>())) return false;
  if (group.next == kSize) record = Finish(frame, group);
  return true;
}

template <class Record, std::size_t I>
bool CanRecordReader::TryMessage(const CanFrame& frame, CanGroup<Record>& group) {
  using Message = std::tuple_element_t<I, MessagesOf<Record>>;
  if (frame.id != Message::kId || frame.extended != Message::kExtended || frame.error) return false;
  const auto message = FromCanFrame<Message>(frame);
  if (!message) {
    ++rejected_frames_;
    return true;
  }
  const int counter = static_cast<int>(message->counter);
  const bool is_awaited = I == 0 || (group.next == I && group.counter == counter);
  if (!is_awaited) ++stray_frames_;
  if (I == 0) stray_frames_ += static_cast<std::int64_t>(group.next);
  group.next = is_awaited ? I + 1 : 0;
  group.counter = counter;
  std::get<I>(group.messages) = *message;
  return true;
}

template <class Record>
std::optional<CanRecord> CanRecordReader::Finish(const CanFrame& frame, CanGroup<Record>& group) {
  group.next = 0;
  const int step =
      (group.counter - group.newest.value_or(group.counter - 1) + kCounters) % kCounters;
  if (step == 0) {
    stray_frames_ += static_cast<std::int64_t>(std::tuple_size_v<MessagesOf<Record>>);
    return std::nullopt;
  }
  group.newest = group.counter;
  group.sequence += step;
  lost_records_ += step - 1;
  return CanRecord(ToRecord(group.messages, Origin{frame.time, group.sequence}));
}

}  // namespace vog
