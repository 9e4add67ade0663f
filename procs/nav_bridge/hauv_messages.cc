#include "procs/nav_bridge/hauv_messages.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "hardware/nav_payload/time_of_day.h"

namespace vog {
namespace {

std::optional<double> IfFinite(double number) {
  return std::isfinite(number) ? std::optional(number) : std::nullopt;
}

bool AreFinite(std::initializer_list<double> numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
}

bool IsUsable(const hauv::bs_rnv_2_t& m) {
  return AreFinite({m.horizontal, m.vertical, m.distance, m.heading, m.depth, m.absheading,
                    m.absroll, m.abspitch});
}
bool IsUsable(const hauv::bs_cnv_t& m) { return AreFinite({m.x, m.y, m.z, m.heading}); }
bool IsUsable(const hauv::bs_dvl_2_t&) { return true; }
bool IsUsable(const hauv::bs_imu_t& m) {
  return AreFinite({m.rate_x, m.rate_y, m.rate_z, m.acc_x, m.acc_y, m.acc_z});
}
bool IsUsable(const hauv::bs_rdp_t& m) { return AreFinite({m.pressure}); }

std::int64_t UtimeOf(const hauv::bs_cnv_t& message) { return message.time_nav; }
template <class Message>
std::int64_t UtimeOf(const Message& message) {
  return message.time;
}

}  // namespace

Sentence FromMessage(const hauv::bs_rnv_2_t& message) {
  RnvSentence rnv;
  rnv.time = TimeOfDay(FromUtime(message.time));
  rnv.horizontal_m = message.horizontal;
  rnv.vertical_m = message.vertical;
  rnv.distance_m = message.distance;
  rnv.heading_rad = message.heading;
  rnv.absolute = RnvAbsolute{message.depth, message.absheading, message.absroll, message.abspitch,
                             FromUtime(message.time_nav)};
  return rnv;
}

Sentence FromMessage(const hauv::bs_cnv_t& message) {
  return CnvSentence{FromUtime(message.time_nav), message.x, message.y, message.z, message.heading};
}

Sentence FromMessage(const hauv::bs_dvl_2_t& message) {
  Dv2Sentence dv2;
  dv2.time = dv2.time_measured = TimeOfDay(FromUtime(message.time));
  dv2.velocity_m_s = {IfFinite(message.velocity1), IfFinite(message.velocity2),
                      IfFinite(message.velocity3), IfFinite(message.velocity4)};
  dv2.range_m = {IfFinite(message.range1), IfFinite(message.range2), IfFinite(message.range3),
                 IfFinite(message.range4)};
  dv2.temperature_degc = IfFinite(message.temperature);
  return dv2;
}

Sentence FromMessage(const hauv::bs_imu_t& message) {
  ImuSentence imu;
  imu.time = imu.time_measured = TimeOfDay(FromUtime(message.time));
  imu.rate_rad_s = {message.rate_x, message.rate_y, message.rate_z};
  imu.acceleration_m_s2 = {message.acc_x, message.acc_y, message.acc_z};
  return imu;
}

Sentence FromMessage(const hauv::bs_rdp_t& message) {
  return RdpSentence{TimeOfDay(FromUtime(message.time)), message.pressure};
}

void SubscribeToHauv(Bus& bus, std::function<void(const Sentence&, Time)> handle,
                     std::function<void()> refuse) {
  const auto subscribe = [&]<class Message>(const Channel<Message>& channel) {
    bus.Subscribe(channel.name, [handle, refuse](Time, Bytes bytes) {
      Message message{};
      if (!Decode(bytes, message) || !IsUsable(message) || !IsUtime(UtimeOf(message))) {
        refuse();
      } else {
        handle(FromMessage(message), FromUtime(UtimeOf(message)));
      }
    });
  };
  subscribe(Channel<hauv::bs_rnv_2_t>{"HAUV_BS_RNV_2"});
  subscribe(Channel<hauv::bs_cnv_t>{"HAUV_BS_CNV"});
  subscribe(Channel<hauv::bs_dvl_2_t>{"HAUV_BS_DVL_2"});
  subscribe(Channel<hauv::bs_imu_t>{"HAUV_BS_IMU"});
  subscribe(Channel<hauv::bs_rdp_t>{"HAUV_BS_RDP"});
}

}  // namespace vog
